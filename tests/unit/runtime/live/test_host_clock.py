"""The clock of the machine against those of all sensors, and streams in real time."""

import re
from pathlib import Path

import polars as pl
import pytest

from multiradar.clock import FixedClock
from multiradar.errors import IdempotencyConflictError, LiveStreamError
from multiradar.ingest.asterix_configured import asterix_gateway
from multiradar.ingest.feeds.configured import configured_feeds
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.service import Service
from multiradar.settings.service import load_settings
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording

DAY_S = 86_400.0
FRAME = recording(1300)


def _second(second: int, wanted: pl.Expr) -> pl.DataFrame:
    of_second = ((pl.col("time_s") - START_S) // 1.0) == second
    return FRAME.filter(of_second & wanted)


class Machine(FixedClock):
    """Its system time can be set."""

    set_by_s = 0.0

    def now_s(self) -> float:
        return self.monotonic_s() + self.set_by_s


class Live:
    """A service that receives a recording in real time, or faster."""

    def __init__(
        self, ahead_s: float = 0.0, wrong: tuple[str, ...] = (), wrong_s: float = 60.0,
        speed: float = 1.0, rows: int = 600,
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
        frame = recording(rows).with_columns(time_s=pl.col("time_s") + offset_s)
        for (_,), part in frame.group_by(
            ((pl.col("time_s") - START_S) // 1.0) % 60.0, maintain_order=True
        ):
            self.clock.advance(1.0 / speed)
            submit(self.service, part)

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *_: object) -> None:
        self.service.stop()

    def radars(self, second: int) -> int:
        """Receive a second of radars, dated as ASTERIX is; return the plots not accepted."""
        self.clock.advance(1.0)
        plots, now_s = _second(second, pl.col("kind") == "radar"), self.service.reception.now_s()
        of_day = pl.col("time_s") % DAY_S
        days = ((now_s + 3600.0 - of_day) / DAY_S).floor()
        dated = plots.with_columns(time_s=of_day + days * DAY_S)
        in_range = dated.filter(pl.col("time_s") >= now_s - 3600.0)
        return len(plots) - submit(self.service, in_range).accepted

    def clocked(self, second: int, lasts_s: float = 1.0) -> int:
        """Receive a second of sensors with dates of their own; return the rows not accepted."""
        self.clock.advance(lasts_s)
        return len(submit(self.service, _second(second, pl.lit(value=True))).rejected)

    @property
    def data_time_s(self) -> float:
        return float(settled(self.service)["data_time_s"])  # type: ignore[arg-type]

    @property
    def alarms(self) -> set[object]:
        return {*settled(self.service)["alarms"]}  # type: ignore[misc]

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
    with Live() as live:
        live.clock.set_by_s = -600.0
        apart, stepped = live.host_warnings
        assert "s ahead of the system clock" in apart
        assert "has been stepped by -600.0 s" in stepped


STEPS_S = [DAY_S, 7200.0, 1200.0, -90.0, -DAY_S]


@pytest.mark.parametrize("step_s", STEPS_S)
@pytest.mark.fault(8)
def test_a_wrong_step_of_the_system_time_changes_nothing(step_s: float) -> None:
    """A day for 10 s moved the data time by a day, and all radars were late afterwards."""
    with Live() as live:
        before_s = live.data_time_s
        for set_by_s, period in ((step_s, range(30, 45)), (0.0, range(45, 60))):
            live.clock.set_by_s = set_by_s
            for second in period:
                assert live.radars(second) == 0
                assert live.clocked(second, 0.0) == 0
        assert live.data_time_s == pytest.approx(before_s + 30.0, abs=1.0)
        assert settled(live.service)["silence_s"] == 0.0
        assert not live.host_warnings
        live.clock.set_by_s = step_s
        live.clock.advance(30.0)
        assert "no_data" in live.alarms
        assert set(live.service.view.tracks()["state"]) == {"stale"}


@pytest.mark.parametrize("wrong_s", [-7200.0, -DAY_S, 7200.0, 45.0, -45.0, 12.0, -12.0])
@pytest.mark.fault(8)
def test_a_wrong_clock_of_the_start_is_replaced_when_the_sensors_confirm_it(wrong_s: float) -> None:
    with Live(-wrong_s, rows=0) as live:
        for second in range(5):
            live.clocked(second)
        assert "host_clock" in live.alarms
        live.clock.set_by_s = -wrong_s
        live.clocked(5)
        for second in range(6, 12):
            assert live.clocked(second) == 0
        assert not live.host_warnings
        assert settled(live.service)["silence_s"] == 0.0


@pytest.mark.parametrize("wrong_s", [-18_000.0, -DAY_S - 1800.0])
@pytest.mark.fault(8)
def test_radars_confirm_it_by_the_time_of_day(wrong_s: float) -> None:
    with Live(-wrong_s, rows=0) as live:
        for second in range(6):
            live.radars(second)
        live.clock.set_by_s = -wrong_s
        for second in range(6, 30):
            live.radars(second)
        assert live.radars(30) == 0
        assert live.data_time_s == pytest.approx(START_S + 31.0, abs=2.0)
        assert not live.host_warnings


@pytest.mark.parametrize("wrong_s", [DAY_S, -3 * DAY_S])
@pytest.mark.fault(8)
def test_a_wrong_date_of_the_start_is_replaced_by_an_operator(wrong_s: float) -> None:
    """Radars report only the time of day, which is right with both dates."""
    with Live(-wrong_s, rows=0) as live:
        for second in range(6):
            assert live.radars(second) == 0
        live.clock.set_by_s = -wrong_s
        assert live.radars(6) == 0
        assert live.data_time_s == pytest.approx(START_S + 7 + wrong_s, abs=2)
        assert any("set the data time" in one for one in live.host_warnings)
        live.service.set_clock(START_S + 7.0, source="test").result(WAIT_TIMEOUT_S)
        for second in range(7, 20):
            assert live.radars(second) == 0
        assert live.data_time_s == pytest.approx(START_S + 20.0, abs=2.0)
        assert not live.host_warnings


def test_a_rejected_command_confirms_no_step() -> None:
    """Regression: the time of reception moved although nothing was executed."""
    with Live(ahead_s=DAY_S, rows=0) as live:
        for second in range(3):
            assert live.radars(second) == 0
        key = {"source": "test", "idempotency_key": "once"}
        service = live.service
        service.set_clock(live.data_time_s, **key).result(WAIT_TIMEOUT_S)
        live.clock.set_by_s = DAY_S
        before_s = service.reception.now_s()
        with pytest.raises(IdempotencyConflictError):
            service.set_clock(START_S + 4.0, **key).result(WAIT_TIMEOUT_S)
        assert service.reception.now_s() == before_s
        service.set_clock(START_S + 4.0, source="test").result(WAIT_TIMEOUT_S)
        assert service.reception.now_s() == before_s + DAY_S


def test_an_operator_who_sets_the_data_time_confirms_no_wrong_step() -> None:
    with Live() as live:
        settled(live.service)
        live.clock.set_by_s = DAY_S
        live.service.set_clock(START_S + 30.0, source="test").result(WAIT_TIMEOUT_S)
        for second in range(30, 40):
            assert live.radars(second) == 0
        assert live.data_time_s == pytest.approx(START_S + 40.0, abs=1.0)


@pytest.mark.parametrize("wrong_s", [8.0, -8.0, 3.0, -3.0])
@pytest.mark.fault(8)
def test_a_step_of_seconds_is_followed_if_the_sensors_confirm_it(wrong_s: float) -> None:
    with Live(-wrong_s, rows=0) as live:
        for second in range(10):
            live.clocked(second)
        live.clock.set_by_s = -wrong_s
        for second in range(10, 15):
            live.clocked(second)
        assert live.service.reception.now_s() == pytest.approx(START_S + 15.0, abs=1.0)


@pytest.mark.fault(8)
def test_an_operator_who_sets_another_time_confirms_no_wrong_step() -> None:
    """As for a replay of the day before."""
    with Live() as live:
        settled(live.service)
        live.clock.set_by_s = -3600.0
        before_s = live.service.reception.now_s()
        live.service.set_clock(START_S - DAY_S, source="test").result(WAIT_TIMEOUT_S)
        assert live.service.reception.now_s() == pytest.approx(before_s, abs=1.0)


def test_inputs_of_radars_and_feeds_date_by_the_time_of_reception(tmp_path: Path) -> None:
    file = tmp_path / "settings.toml"
    file.write_text(
        '[[asterix.listen]]\nport = 0\n[[feeds.source]]\nurl = "tcp://127.0.0.1:9"\n'
        'sensor = "adsb"\n'
    )
    settings = load_settings(file)
    with Live(rows=0) as live:
        gateway = asterix_gateway(settings, TABLE, live.service)
        feeds = configured_feeds(settings.feeds, TABLE, live.service, live.service.reception)
        assert gateway is not None
        assert feeds is not None
        assert gateway._clock is feeds._clock is live.service.reception


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
