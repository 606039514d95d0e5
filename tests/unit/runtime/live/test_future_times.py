"""A live measurement from the future is rejected before it can advance the data time."""

import polars as pl

from multiradar.clock import FixedClock
from multiradar.runtime.live.service import Service
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.inputs.messages import radar
from support.processes.live_services import submit
from support.scenarios.live_scene import sensors

NOW_S = 1_800_000_000.0


def plots(*times_s: float) -> pl.DataFrame:
    return pl.DataFrame([radar(time_s=time_s, sensor_id=TABLE.ids[0]) for time_s in times_s])


TABLE = sensors()


def test_the_first_measurement_of_all_cannot_come_from_the_future() -> None:
    # It once set the data time to 2033, and every measurement after it was late for good.
    clock = FixedClock(NOW_S)
    journal = MemoryJournal()
    service = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
        clock=clock,
    )
    service.start()
    try:
        first = submit(service, plots(2e9))
        assert first.accepted == 0
        assert [row.code for row in first.rejected] == ["TIME_FUTURE"]
        mixed = submit(service, plots(NOW_S - 5.0, 2e9, NOW_S + 59.0, NOW_S + 61.0))
        assert mixed.accepted == 2
        assert [row.index for row in mixed.rejected] == [1, 3]
        clock.advance(2.0)
        assert submit(service, plots(NOW_S + 61.0)).accepted == 1
    finally:
        service.stop()
