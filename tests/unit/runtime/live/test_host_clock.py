"""The clock of the machine against those of all sensors, and streams in real time."""

import re

import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.errors import LiveStreamError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.service import Service
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording


class Machine(FixedClock):
    """Its system time can be set."""

    set_by_s = 0.0

    def now_s(self) -> float:
        return self.monotonic_s() + self.set_by_s


class Live:
    """A service that receives a recording in real time, or faster."""

    def __init__(
        self, ahead_s: float = 0.0, wrong: tuple[str, ...] = (), wrong_s: float = 60.0,
        speed: float = 1.0,
    ):  # fmt: skip
        self.clock = Machine(START_S - ahead_s)
        self.service = Service(
            open_journal=MemoryJournal,
            open_engine=lambda: Engine(TABLE, TrackingSettings()),
            sensors=TABLE,
            tracking=TrackingSettings(),
            clock=self.clock,
        )
        self.service.start()
        offset_s = pl.when(pl.col("sensor_id").is_in(wrong)).then(wrong_s).otherwise(0.0)
        frame = recording(600).with_columns(time_s=pl.col("time_s") + offset_s)
        for (_,), part in frame.group_by(
            ((pl.col("time_s") - START_S) // 1.0) % 60.0, maintain_order=True
        ):
            self.clock.advance(1.0 / speed)
            submit(self.service, part)

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *_: object) -> None:
        self.service.stop()

    @property
    def host_warnings(self) -> list[str]:
        status = settled(self.service)
        found = [one for one in status["warnings"] if "system clock" in one]  # type: ignore[attr-defined]
        assert ("host_clock" in status["alarms"]) == any("all " in one for one in found)  # type: ignore[operator]
        return found


@pytest.mark.parametrize(
    ("ahead_s", "words"),
    [
        (-600.0, "60[01] s behind the system clock"),
        (90.0, "(89|90) s ahead of the system clock"),
        (0.0, ""),
    ],
)
@pytest.mark.fault(8)
def test_all_sensors_against_the_clock_of_the_machine(ahead_s: float, words: str) -> None:
    with Live(ahead_s) as live:
        found = live.host_warnings
        assert bool(found) == bool(words)
        assert all(
            re.match(f"the clocks of all 3 real-time sensors are {words}", one) for one in found
        )


@pytest.mark.parametrize("wrong_s", [60.0, 600.0])
def test_one_wrong_sensor_is_named_and_not_the_machine(wrong_s: float) -> None:
    with Live(wrong=("41-20",), wrong_s=wrong_s) as live:
        assert not live.host_warnings
        assert live.service.view.clock_leads() == {"41-20": pytest.approx(wrong_s, abs=2.0)}


def test_a_machine_whose_time_is_set_says_so() -> None:
    with Live(-600.0) as live:
        live.clock.set_by_s = -600.0
        (sentence,) = live.host_warnings
        assert "has been stepped by -600.0 s" in sentence


def test_a_replay_of_older_data_is_no_wrong_machine() -> None:
    with Live(-3e6) as live:
        assert not live.host_warnings


@pytest.mark.parametrize(("ahead_s", "speed"), [(0.0, 20.0), (-3e6, 1.0)])
def test_the_stream_of_a_replay_ends(ahead_s: float, speed: float) -> None:
    with Live(ahead_s, speed=speed) as live:
        assert not live.service.flush(source="test").result(WAIT_TIMEOUT_S).duplicate


def test_a_live_stream_ends_only_by_force() -> None:
    with Live() as live:
        clock_s = settled(live.service)["data_time_s"]
        with pytest.raises(LiveStreamError, match="41-10"):
            live.service.flush(source="test")
        # A slower radar loses nothing.
        row = recording(600)[:1].with_columns(time_s=pl.lit(clock_s) - 5.0)
        assert not submit(live.service, row).rejected
        live.service.flush(source="test", force=True).result(WAIT_TIMEOUT_S)
        assert submit(live.service, row).rejected[0].code == "TIME_LATE"


def test_a_repeated_end_of_a_stream_is_a_duplicate_also_while_data_arrive() -> None:
    with Live() as live:
        settled(live.service)
        for force, duplicate in ((True, False), (False, True)):
            done = live.service.flush(source="test", idempotency_key="end", force=force)
            assert done.result(WAIT_TIMEOUT_S).duplicate == duplicate
        with pytest.raises(LiveStreamError):
            live.service.flush(source="test", idempotency_key="another end")
