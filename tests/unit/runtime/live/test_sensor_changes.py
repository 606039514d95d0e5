"""Sensors change: all readers of the output follow, and a change that fails changes nothing."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.errors import (
    ConfigurationError,
    IdempotencyConflictError,
    JournalFullError,
    PipelineError,
)
from multiradar.ingest.asterix_output.sender import AsterixSender, Outlet
from multiradar.ingest.asterix_output.sinks import MemorySink
from multiradar.runtime.admission.sensors_in_force import sensor_change
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.output_feed import OutputFeed
from multiradar.runtime.live.service import Service
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.storage.entries import Entry
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.asterix.reports import SENDER
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import recording, sensors_file

NEW = "41-15"
_SITE = {"kind": "radar", "latitude_deg": 50.0, "longitude_deg": 14.0, "height_m": 400.0}


class _Journal(MemoryJournal):
    """A journal whose disk may be full."""

    full = False

    def append(self, entries: Sequence[Entry]) -> list[int]:
        if self.full:
            raise JournalFullError("journal", "the disk is full")
        return super().append(entries)


def _service(journal: MemoryJournal) -> Service:
    tracking = TrackingSettings()
    return Service(
        open_journal=lambda: journal,
        open_engine=lambda: Engine(TABLE, tracking),
        sensors=TABLE,
        tracking=tracking,
        described=sensors_file(),
    )


class _Run:
    """A service with all that reads its output."""

    def __init__(self, journal: MemoryJournal) -> None:
        tracking = TrackingSettings()
        self.service = _service(journal)
        feed = OutputFeed()
        self.service.publication.feed(feed, "test")
        outlet = Outlet("display", Channel(ChannelOptions(SENDER)), MemorySink())
        self.sender = AsterixSender(feed, self.service.view.live_ids, TABLE, tracking, [outlet])
        self.trajectories = TrajectoryFeed(trajectory_options(20, 1000, 3.0, 2.0), TABLE, tracking)
        self.service.publication.keep(self.trajectories)
        self.trajectories.start()
        self.sender.start()
        self.service.start()
        self.trajectories.go_live()
        self.sender.begin()

    def change(self, sensor_id: str, values: dict[str, Any]) -> None:
        known = self.service.describe_sensor(sensor_id) or {}
        plan = self.service.plan_sensor(sensor_id, known | values)
        self.service.change_sensor(plan.change, source="operator").result(WAIT_TIMEOUT_S)

    def stop(self) -> None:
        self.trajectories.stop()
        self.service.stop()
        self.sender.stop()


@pytest.fixture
def journal() -> _Journal:
    return _Journal()


@pytest.fixture
def run(journal: _Journal) -> Iterator[_Run]:
    running = _Run(journal)
    yield running
    running.stop()


def _renamed(frame: pl.DataFrame) -> pl.DataFrame:
    """Half of the plots of the first radar are of the new one."""
    own = pl.col("sensor_id").eq("41-10") & pl.col("track_number").mod(2).eq(0)
    return frame.with_columns(sensor_id=pl.when(own).then(pl.lit(NEW)).otherwise("sensor_id"))


@pytest.mark.slow
def test_all_readers_follow_an_added_and_a_moved_radar(run: _Run) -> None:
    frame = recording(900)
    assert not submit(run.service, frame[:400]).rejected
    run.change(NEW, _SITE)
    run.change("41-20", {"latitude_deg": 49.2001})
    assert not submit(run.service, _renamed(frame[400:])).rejected
    settled(run.service)
    assert run.trajectories.settle(WAIT_TIMEOUT_S)
    assert run.trajectories.counts()["failure"] is None
    assert run.sender.counts()["failure"] is None
    by_name = {one["id"]: one for one in run.service.view.sensors()}
    assert by_name[NEW]["updates"] > 10
    assert by_name[NEW]["biases"]
    assert by_name["41-20"]["latitude_deg"] == pytest.approx(49.2001)
    assert len(run.service.view.tracks().filter(pl.col("sensor_id") == NEW)) > 0


def test_trajectories_continue_when_the_engine_is_rebuilt_after_a_sensor_was_added(
    run: _Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The replay begins with fewer sensors; the service stopped for good."""
    frame, push = recording(900), Engine.push
    submit(run.service, frame[:300])
    run.change(NEW, _SITE)
    submit(run.service, _renamed(frame[300:600]))
    settled(run.service)

    def failing(engine: Engine, batch: MeasurementBatch, clock_s: float | None) -> EngineOutput:
        monkeypatch.setattr(Engine, "push", push)
        raise MemoryError

    monkeypatch.setattr(Engine, "push", failing)
    submit(run.service, _renamed(frame[600:]))
    assert settled(run.service)["state"] == "running"
    assert run.trajectories.settle(WAIT_TIMEOUT_S)
    assert run.trajectories.counts()["failure"] is None


def test_a_disabled_radar_is_named_and_counted_without_an_alarm(run: _Run) -> None:
    frame = recording(3000)
    submit(run.service, frame[:600])
    run.change("41-20", {"enabled": False})
    rejected = submit(run.service, frame[600:]).rejected
    off = int((frame[600:]["sensor_id"] == "41-20").sum())
    assert [row.code for row in rejected] == ["SENSOR_DISABLED"] * off
    assert rejected[0].reason.startswith("sensor_id: expected a sensor that is enabled")
    status: Any = settled(run.service)
    assert status["rejected_by_code"] == {"SENSOR_DISABLED": off}
    assert any(one.startswith("41-20: disabled") for one in status["warnings"])
    (change,) = status["sensor_changes"]
    assert {name: change[name] for name in ("sensor_id", "source", "fields", "biases_reset")} == {
        "sensor_id": "41-20", "source": "operator", "fields": ["enabled"], "biases_reset": False,
    }  # fmt: skip
    assert change["data_time_s"] == pytest.approx(frame[:600]["time_s"].max())
    assert "41-20" not in status["sensor_alarms"]
    assert [one["enabled"] for one in run.service.view.sensors()] == [True, False, True]
    run.change("41-20", {"enabled": True})
    assert not any("disabled" in one for one in run.service.view.status()["warnings"])


def test_each_change_is_one_event_that_names_what_changed(run: _Run) -> None:
    frame = recording(600)
    submit(run.service, frame)
    settled(run.service)
    reader = run.service.view.subscribe(None, 1000)
    run.change(NEW, _SITE)
    run.change("41-20", {"latitude_deg": 49.2001})
    run.change("41-20", {"range_sigma_m": 80.0, "enabled": False})
    run.change("41-20", {"enabled": True})
    settled(run.service)
    events = [one for one in reader.poll(1000) if one.kind == "sensor"]
    assert [one.key for one in events] == [NEW, "41-20", "41-20", "41-20"]
    found = [json.loads(one.payload) for one in events]
    data_time_s = pytest.approx(frame["time_s"].max())
    given = ["height_m", "id", "kind", "latitude_deg", "longitude_deg"]
    expected = [
        (NEW, True, given, True, True),
        ("41-20", False, ["latitude_deg"], True, True),
        ("41-20", False, ["enabled", "range_sigma_m"], False, False),
        ("41-20", False, ["enabled"], True, False),
    ]
    for number, (event, values) in enumerate(zip(found, expected, strict=True)):
        names = ("sensor_id", "added", "fields", "enabled", "biases_reset")
        assert tuple(event[name] for name in names) == values
        assert event["journal_sequence"] == 2 + number
        assert event["time_s"] == data_time_s


def test_a_change_before_the_first_measurement_has_no_time(run: _Run) -> None:
    run.change("41-20", {"enabled": False})
    (event,) = run.service.view.subscribe(0, 10).poll(10)
    assert (event.sequence, event.kind) == (1, "sensor")
    assert json.loads(event.payload)["time_s"] is None


def test_interfaces_hear_of_sensors_at_the_start_and_at_changes(journal: _Journal) -> None:
    heard: list[tuple[str, ...]] = []
    for expected in ([TABLE.ids, (*TABLE.ids, NEW)], [(*TABLE.ids, NEW)]):
        service = _service(journal)
        service.sensor_listeners.append(lambda table: heard.append(table.ids))
        service.start()
        if len(expected) > 1:
            plan = service.plan_sensor(NEW, _SITE)
            service.change_sensor(plan.change, source="a").result(WAIT_TIMEOUT_S)
        service.stop()
        assert heard == expected
        heard.clear()


def test_a_full_disk_changes_nothing(run: _Run, journal: _Journal) -> None:
    journal.full = True
    with pytest.raises(JournalFullError):
        run.change("41-20", {"enabled": False})
    journal.full = False
    assert run.service.describe_sensor("41-20") == {
        name: value
        for name, value in sensors_file().sensor[1].model_dump(exclude_unset=True).items()
    }
    assert not submit(run.service, recording(100)).rejected


def test_a_change_of_the_moment_before_is_respected(run: _Run) -> None:
    first = run.service.plan_sensor(NEW, _SITE | {"also": ["west"]})
    second = run.service.plan_sensor("41-16", _SITE | {"also": ["west"]})
    run.service.change_sensor(first.change, source="a").result(WAIT_TIMEOUT_S)
    late = run.service.change_sensor(second.change, source="b")
    with pytest.raises(ConfigurationError, match="two sensors are named west"):
        late.result(WAIT_TIMEOUT_S)
    assert settled(run.service)["journal_sequence"] == 1


def test_a_change_with_the_key_of_an_earlier_one_changes_nothing(run: _Run) -> None:
    known = run.service.describe_sensor("41-10") or {}
    first, other = (
        sensor_change("41-10", known | {"range_sigma_m": sigma_m}, reset_biases=False)
        for sigma_m in (60.0, 70.0)
    )
    assert not run.service.has_message("one")
    made = run.service.change_sensor(first, source="a", idempotency_key="one")
    run.service.change_sensor(other, source="a", idempotency_key="two").result(WAIT_TIMEOUT_S)
    assert run.service.has_message("one")
    again = run.service.change_sensor(first, source="a", idempotency_key="one")
    assert again.result(WAIT_TIMEOUT_S) == replace(made.result(WAIT_TIMEOUT_S), duplicate=True)
    assert (run.service.describe_sensor("41-10") or {})["range_sigma_m"] == 70.0
    reused = run.service.change_sensor(other, source="a", idempotency_key="one")
    with pytest.raises(IdempotencyConflictError):
        reused.result(WAIT_TIMEOUT_S)


def test_what_the_engine_could_not_use_is_rejected_before(run: _Run) -> None:
    far = _SITE | {"latitude_deg": -60.0, "longitude_deg": -170.0}
    with pytest.raises(ConfigurationError, match=f"sensor {NEW}: "):
        run.service.plan_sensor(NEW, far)
    slow = {"bias": {"time_offset_s": {"estimate": False, "prior": 9.0}}}
    with pytest.raises(ConfigurationError, match="reorder_horizon_s"):
        run.service.plan_sensor(NEW, _SITE | slow)
    with pytest.raises(ConfigurationError, match="cannot change while the service runs"):
        run.service.plan_sensor("41-10", {"kind": "adsb"})


def test_two_changes_that_the_engine_could_not_use_together_do_not_both_enter(
    run: _Run, journal: _Journal
) -> None:
    clocks = {NEW: 4.2, "41-16": -4.2}
    plans = [
        run.service.plan_sensor(
            name, _SITE | {"bias": {"time_offset_s": {"estimate": False, "prior": offset_s}}}
        )
        for name, offset_s in clocks.items()
    ]
    first, second = (run.service.change_sensor(one.change, source="a") for one in plans)
    first.result(WAIT_TIMEOUT_S)
    with pytest.raises(ConfigurationError, match=r"reorder_horizon_s: expected at least 8\.4 s"):
        second.result(WAIT_TIMEOUT_S)
    assert not submit(run.service, recording(100)).rejected
    assert settled(run.service)["state"] == "running"
    run.stop()
    again = _service(journal)
    again.start()
    assert again.describe_sensor("41-16") is None
    again.stop()


def test_a_service_without_descriptions_changes_nothing() -> None:
    service = Service(
        open_journal=MemoryJournal,
        open_engine=lambda: Engine(TABLE, TrackingSettings()),
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    with pytest.raises(PipelineError, match="not running"):
        service.plan_sensor("41-10", {})
    service.start()
    with pytest.raises(ConfigurationError, match="without sensor descriptions"):
        service.plan_sensor("41-10", {"kind": "radar"})
    assert service.describe_sensor("41-10") is None
    service.stop()
    assert np.isfinite(TABLE.range_sigma_m).all()
