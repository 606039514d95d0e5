"""The feeds of the settings."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from multiradar.clock import Clock, SystemClock
from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.feeds.blocks import BlockStream
from multiradar.ingest.feeds.connections import AcceptedConnection, FeedConnection, TcpConnection
from multiradar.ingest.feeds.gateway import FeedGateway, FeedPlan, Wait
from multiradar.ingest.feeds.polling import PolledSnapshots, file_fetch, http_fetch
from multiradar.ingest.feeds.reader import ReaderBounds
from multiradar.runtime.ports import MeasurementSink
from multiradar.settings.asterix import AsterixConnectSettings
from multiradar.settings.feeds import (
    FILE,
    LISTEN,
    TCP,
    FeedAddress,
    FeedSourceSettings,
    FeedsSettings,
)
from multiradar_converters.feeds.live import LiveFeed


def configured_feeds(
    settings: FeedsSettings,
    sensors: SensorTable,
    sink: MeasurementSink,
    clock: Clock | None = None,
) -> FeedGateway | None:
    """Return the feeds, not started; None without any.

    Parameters
    ----------
    settings : FeedsSettings
        The section `feeds`.
    sensors : SensorTable
        The sensors.
    sink : MeasurementSink
        The running service.
    clock : Clock, optional
        Time of reception; the system clock by default.

    Raises
    ------
    ConfigurationError
        If the sensor of a feed is not one of positions.
    """
    if not settings.source:
        return None
    clock = clock or SystemClock()
    plans = [_plan(one, settings.connect_timeout_s, sensors, clock) for one in settings.source]
    bounds = ReaderBounds(
        reconnect_min_s=settings.reconnect_min_s,
        reconnect_max_s=settings.reconnect_max_s,
        batch_interval_s=settings.batch_interval_s,
        quarantine_rows_max=settings.quarantine_rows_max,
    )
    return FeedGateway(plans, sink, bounds, clock)


def _plan(
    source: FeedSourceSettings, timeout_s: float, sensors: SensorTable, clock: Clock
) -> FeedPlan:
    _check_sensor(source, sensors)
    feed = LiveFeed(
        source.label,
        {"adsb": source.sensor, "mlat": source.mlat_sensor},
        at_reception=source.times == "reception",
    )
    return FeedPlan(source.label, partial(_open, source, timeout_s, clock), feed)


def _open(source: FeedSourceSettings, timeout_s: float, clock: Clock, wait: Wait) -> FeedConnection:
    scheme, path = source.address.scheme, source.address.path
    if scheme in (TCP, LISTEN):
        return open_stream(source.address, timeout_s, source.senders)
    if scheme == FILE:
        fetch = file_fetch(Path(path))
    else:
        fetch = http_fetch(source.address, timeout_s, clock)
    return PolledSnapshots(source.shown_url, fetch, source.interval_s, clock, wait)


def open_stream(address: FeedAddress, timeout_s: float, senders: Sequence[str]) -> FeedConnection:
    """Return a TCP connection, or the port that accepts one of these senders.

    Raises
    ------
    ConfigurationError
        If the port cannot be opened.
    """
    if address.scheme == TCP:
        return TcpConnection(address.host, address.port, timeout_s)
    return AcceptedConnection(address.host, address.port, senders)


def asterix_stream(source: AsterixConnectSettings, settings: FeedsSettings) -> BlockStream:
    """Return the blocks of a TCP connection; its times are those of the feeds.

    Raises
    ------
    ConfigurationError
        If the port cannot be opened.
    """
    connection = open_stream(source.address, settings.connect_timeout_s, source.senders)
    return BlockStream(
        connection, SystemClock(), settings.reconnect_min_s, settings.reconnect_max_s
    )


def _check_sensor(source: FeedSourceSettings, sensors: SensorTable) -> None:
    kinds = dict(zip(sensors.ids, sensors.kinds.tolist(), strict=True))
    kinds |= {name: int(sensors.kinds[row]) for name, row in sensors.aliases}
    positions = sorted(name for name, kind in kinds.items() if kind == KIND_POSITION)
    # Positions by multilateration are few receivers' only; without a sensor each is rejected.
    if source.sensor not in positions:
        known = ", ".join(positions) or "none"
        raise ConfigurationError(
            f"settings: feeds.source {source.label}: expected a sensor of kind adsb or mlat "
            f"from the sensors file (known: {known}), was {source.sensor}"
        )
