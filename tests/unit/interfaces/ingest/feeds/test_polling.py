"""Snapshots that are fetched at an interval."""

import pytest

from multiradar.clock import FixedClock
from multiradar.ingest.feeds.configured import configured_feeds
from multiradar.ingest.feeds.polling import PolledSnapshots
from multiradar.settings.feeds import FeedSourceSettings, FeedsSettings, feed_address
from multiradar.wire.sensors import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.fakes.fake_service import FakeService, FakeView


def test_an_address_is_requested_in_ascii_with_its_escapes() -> None:
    address = feed_address("http://host/daten/übersicht%20neu.json?a=1&b=ä ö")
    assert address.path == "/daten/%C3%BCbersicht%20neu.json?a=1&b=%C3%A4%20%C3%B6"
    assert feed_address("http://host").path == "/"


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        (
            "https://host:8443/data/aircraft.json?apikey=secret",
            "https://host:8443/data/aircraft.json",
        ),
        ("http://host?apikey=secret", "http://host"),
        ("file:///run/aircraft.json?secret#secret", "file:///run/aircraft.json"),
    ],
)
def test_the_query_of_an_address_is_not_shown(url: str, shown: str) -> None:
    """Regression: it may contain a key, and was in the log and in the status."""
    settings = FeedsSettings(source=(FeedSourceSettings(url=url),))
    sensors = sensor_table(SensorsFile(sensor=(Sensor(id="adsb", kind="adsb"),)))
    gateway = configured_feeds(settings, sensors, FakeService(view=FakeView()))
    assert gateway is not None
    gateway.start()
    assert gateway.endpoints == (shown,)
    gateway.stop()


def test_a_snapshot_is_fetched_each_interval_and_missed_ones_are_not_made_up_for() -> None:
    clock = FixedClock(1000.0)
    waits: list[float] = []
    polled = PolledSnapshots("file:", lambda: b"[]", 5.0, clock, waits.append)
    assert polled.open()

    def fetched(after_s: float, *, attempts: int = 6) -> int:
        clock.advance(after_s)
        return sum(polled.receive() is not None for _ in range(attempts))

    # The first was fetched when it was opened.
    assert [fetched(one) for one in (0.0, 4.75, 0.25, 5.25, 4.5, 0.25)] == [1, 0, 1, 1, 0, 1]
    assert 0.0 < min(waits) <= max(waits) <= 5.0
    # One, not all ten.
    assert fetched(50.0) == 1
    assert [fetched(one) for one in (4.75, 0.25)] == [0, 1]
