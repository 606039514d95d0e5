"""The receiver of ASTERIX of the settings."""

from functools import partial

from multiradar.access.security_log import RepeatedEvents
from multiradar.clock import SystemClock
from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.asterix_gateway import AsterixGateway
from multiradar.ingest.asterix_inlet import InletBounds
from multiradar.ingest.asterix_queue import DatagramQueue
from multiradar.ingest.asterix_sensors import of_sensors
from multiradar.ingest.asterix_source import UdpSource
from multiradar.ingest.feeds.configured import asterix_stream
from multiradar.runtime.live.service import Service
from multiradar.settings.service import Settings
from multiradar_converters.asterix.decoding.editions import parse_editions
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from multiradar_converters.errors import ProfileError


def asterix_gateway(
    settings: Settings, sensors: SensorTable, service: Service
) -> AsterixGateway | None:
    """Return the receiver of ASTERIX, not started; None without listeners.

    Raises
    ------
    ConfigurationError
        If an edition is unknown.
    """
    wanted = settings.asterix
    if not (wanted.listen or wanted.connect):
        return None
    try:
        editions = parse_editions(list(wanted.editions))
    except ProfileError as error:
        raise ConfigurationError(f"settings: asterix.editions: {error}") from error
    options = LiveOptions(
        {},
        editions=editions,
        all_targets=wanted.all_targets,
        duplicate_window_s=wanted.duplicate_window_s,
        behind_max_s=wanted.behind_max_s,
    )
    decoder = LiveDecoder(of_sensors(sensors, options))
    service.sensor_listeners.append(lambda table: decoder.use(of_sensors(table, options)))
    # One of all listeners: forged datagrams may be sent to each.
    events = RepeatedEvents(SystemClock())
    gateway = AsterixGateway(
        labels=wanted.input_labels,
        sources=[
            *(
                partial(
                    UdpSource,
                    one.address,
                    one.port,
                    one.interface,
                    one.receive_buffer_octets,
                    senders=one.senders,
                    events=events,
                )
                for one in wanted.listen
            ),
            *(partial(asterix_stream, one, settings.feeds) for one in wanted.connect),
        ],
        sink=service,
        decoder=decoder,
        queue=DatagramQueue(wanted.queue_datagrams_max, wanted.queue_octets_max),
        bounds=InletBounds(wanted.batch_interval_s, wanted.quarantine_rows_max),
        clock=service.reception,
    )
    service.publication.count_edge("asterix", gateway.counts.document)
    return gateway
