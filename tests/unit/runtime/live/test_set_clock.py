"""An operator sets the data clock: at once, on disk, and the same after a restart."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from multiradar.errors import IdempotencyConflictError
from multiradar.ingest.asterix_output.sender import AsterixSender, Outlet
from multiradar.ingest.asterix_output.sinks import MemorySink
from multiradar.runtime.asterix.channel import Channel, ChannelOptions
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.output_feed import OutputFeed
from multiradar.runtime.live.service import Service
from multiradar.runtime.picture.air_picture import Asked
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.queries.registry import RESIDUALS
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.asterix.reports import SENDER
from support.inputs.picture_frames import decoded
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, recording

AHEAD_S = 600.0


class Run:
    """A service with all that reads its output."""

    def __init__(self, journal: MemoryJournal) -> None:
        self.service = Service(
            open_journal=lambda: journal,
            open_engine=lambda: Engine(TABLE, TrackingSettings()),
            sensors=TABLE,
            tracking=TrackingSettings(),
        )
        feed = OutputFeed()
        self.service.publication.feed(feed, "test")
        self.sink = MemorySink()
        outlet = Outlet("display", Channel(ChannelOptions(SENDER)), self.sink)
        self.sender = AsterixSender(
            feed, self.service.view.live_ids, TABLE, TrackingSettings(), [outlet]
        )
        self.sender.start()
        self.service.start()
        self.sender.begin()

    def stop(self) -> None:
        self.service.stop()
        self.sender.stop()


@pytest.fixture
def journal() -> MemoryJournal:
    return MemoryJournal()


@pytest.fixture
def run(journal: MemoryJournal) -> Iterator[Run]:
    running = Run(journal)
    yield running
    running.stop()


def _send(service: Service, frame: pl.DataFrame) -> int:
    parts = frame.iter_slices(50)
    return sum(len(submit(service, part).rejected) for part in parts)


def _set(service: Service, time_s: float) -> int:
    future = service.set_clock(time_s, source="test", idempotency_key="set")
    return future.result(WAIT_TIMEOUT_S).journal_sequence


def _tracks(service: Service) -> set[int]:
    return set(service.view.tracks()["track_id"].to_list())


@pytest.mark.slow
@pytest.mark.fault(8)
def test_a_step_back_ends_all_tracks_and_a_restart_does_the_same(
    run: Run, journal: MemoryJournal
) -> None:
    service, frame = run.service, recording(1500)
    # All sensors are ahead, and then right.
    assert _send(service, frame.with_columns(time_s=pl.col("time_s") + AHEAD_S)) == 0
    settled(service)
    before = _tracks(service)
    assert submit(service, frame[:1]).rejected[0].code == "TIME_LATE"
    assert _set(service, START_S) == _set(service, START_S)
    assert service.view.status()["data_time_s"] == START_S
    assert before
    assert not _tracks(service)
    with pytest.raises(IdempotencyConflictError):
        _set(service, START_S + 1.0)
    reader = service.view.subscribe(service.view.status()["event_sequence"], 100_000)
    assert _send(service, frame) == 0
    status = settled(service)
    after = _tracks(service)
    assert len(after) == len(before)
    assert min(after) > max(before)
    assert status["engine"]["LATE"] == 0  # type: ignore[index]
    events = reader.poll(100_000)
    times = [json.loads(one.payload)["time_s"] for one in events if one.kind == "status"]
    assert times == sorted(times)
    assert times[0] <= START_S + 10.0
    assert run.sender.counts()["failure"] is None
    again = Run(journal)
    try:
        known = settled(again.service)
        for name in ("output_sha256", "data_time_s", "output_sequence", "engine"):
            assert known[name] == status[name], name
    finally:
        again.stop()


@pytest.mark.slow
def test_past_times_after_a_step_back_are_those_of_the_tracks_since_then(
    run: Run, journal: MemoryJournal
) -> None:
    service, view = run.service, run.service.view
    frame = recording(1500, step_s=0.2)
    assert _send(service, frame.with_columns(time_s=pl.col("time_s") + 100.0)) == 0
    settled(service)
    before = _tracks(service)
    _set(service, START_S)
    # A radar that sends no more.
    frame = frame.filter(pl.col("sensor_id") != "41-20")
    assert _send(service, frame) == 0
    status = settled(service)
    after = _tracks(service)
    assert len(after) == len(before) == 12
    ages_s: Any = status["sensor_ages_s"]
    assert ages_s["41-20"] == pytest.approx(300.0, abs=5.0)
    assert ages_s["41-10"] < 10.0
    times = np.sort(frame["time_s"].to_numpy())
    for at_s in (START_S + 60.3, START_S + 200.3):
        found = view.tracks(at_s)
        assert set(found["track_id"]) == after
        assert found["time_s"].is_between(at_s - 60.0, at_s).all()
        header, tables = decoded(view.past_picture(PastAsked(at_s)))
        assert set(tables["tracks"]["track_id"]) == after
        assert len(tables["plots"]["time_s"]) == np.ptp(
            np.searchsorted(times, [at_s - 30.0, at_s], "right")
        )
        assert set(tables["path"]["track_id"]) == after
    assert header["span_s"] == [START_S, view.status()["data_time_s"]]
    # A new page has no plots of the superseded times.
    _, tables = decoded(view.picture(Asked()))
    assert 0 < len(tables["plots"]["time_s"]) <= np.count_nonzero(times > times[-1] - 40.0)
    radars: Any = view.ask(RESIDUALS, window_s=600.0)
    assert [one["sensor_id"] for one in radars["sensors"]] == ["41-10"]
    again = Run(journal)
    try:
        settled(again.service)
        assert_frame_equal(again.service.view.tracks(at_s), view.tracks(at_s))
        assert again.service.view.status()["sensor_ages_s"] == ages_s
    finally:
        again.stop()


def test_a_step_forward_makes_earlier_measurements_late(run: Run) -> None:
    frame = recording(600)
    assert _send(run.service, frame[:300]) == 0
    tracks = _tracks(run.service)
    end_s = float(frame["time_s"].max())  # type: ignore[arg-type]
    _set(run.service, end_s + 30.0)
    assert _tracks(run.service) == tracks
    (row,) = submit(run.service, frame[300:301]).rejected
    assert row.code == "TIME_LATE"
