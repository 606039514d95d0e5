"""The history on disk has every row once, whatever happens, and answers what memory has lost."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from multiradar.cli.playback.view import run_files
from multiradar.errors import InputError, RequestError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.ports import View
from multiradar.runtime.queries.registry import BIASES, TRANSITIONS, UPDATES, History
from multiradar.runtime.recorded import history_files
from multiradar.runtime.recorded.history import keep_history
from multiradar.runtime.recorded.history_files import (
    STATE_FILE,
    HistoryFolder,
    HistoryState,
    Hour,
    Part,
    history_tables,
    hour_name,
    hours_of,
    parts_between,
    parts_of,
    run_tables,
)
from multiradar.runtime.recorded.history_writer import (
    HISTORY_INCOMPLETE,
    HISTORY_STOPPED,
    HistoryRules,
)
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.runtime.recorded.view import RecordedView
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.storage.recording import Recording
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.measurement import TIME_MAX_S
from support.inputs.picture_frames import decoded
from support.processes.live_services import settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios.live_scene import START_S, recording, sensors, sensors_file

pytestmark = pytest.mark.slow

TABLE = sensors()
#: Over the end of an hour of data time.
FRAME = recording(3600, step_s=1.0)
MESSAGE = 200
#: Memory that has soon lost the first rows: a write is due with a quarter of it.
SMALL = RuntimeLimits(
    events_max=300, history_rows_max=800, bias_history_rows_max=4000, transition_rows_max=400,
    plot_rows_max=800,
)  # fmt: skip


class Site:
    """A journal, snapshots and a history, for one service after the other."""

    def __init__(self, folder: Path, limits: RuntimeLimits = SMALL) -> None:
        self.journal = MemoryJournal("sensors and settings")
        self.history = folder / "history"
        self.rules = HistoryRules(self.history)
        self.limits = limits
        self._snapshots = SnapshotRules(
            SnapshotFolder(folder / "journal"), 1e9, 1500, "sensors and settings"
        )

    @contextmanager
    def service(self, *, history: bool = True) -> Iterator[Service]:
        """Run a service."""
        tracking = TrackingSettings()
        service = Service(
            open_journal=lambda: self.journal,
            open_engine=lambda: Engine(TABLE, tracking, sampling=Sampling.ALL),
            sensors=TABLE, tracking=tracking, limits=self.limits, snapshots=self._snapshots,
            described=sensors_file(),
        )  # fmt: skip
        if history:
            keep_history(service, self.rules, tracking)
        service.start()
        try:
            yield service
        finally:
            service.stop()

    def rows(self) -> dict[str, pl.DataFrame]:
        """Return the rows of all tables that have some."""
        tables = history_tables(self.history)
        return {name: pl.read_parquet(list(paths)) for name, paths in tables.items() if paths}

    def feed(self, service: Service, first: int = 0, last: int = len(FRAME)) -> dict[str, Any]:
        """Send a part of the recording; return the status."""
        for begin in range(first, last, MESSAGE):
            submit(service, FRAME[begin : begin + MESSAGE])
            # Not faster than the history: nothing is to be lost.
            service.settled().result(WAIT_TIMEOUT_S)
            if "history" in service.view.status():
                wait_until(lambda: not self._is_behind(service), "the history is written")
        return settled(service)

    def _is_behind(self, service: Service) -> bool:
        state = json.loads((self.history / STATE_FILE).read_bytes())
        log = service.publication.known.logs["history"]
        return bool(log.appended - state["positions"]["tracks.parquet"] > log.capacity // 2)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Site, Service]:
    """A service that has lost nothing, and its history after a clean stop."""
    site = Site(tmp_path_factory.mktemp("whole"), RuntimeLimits())
    with site.service() as service:
        site.feed(service)
    return site, service


def sorted_rows(frame: pl.DataFrame) -> pl.DataFrame:
    """Return rows in an order that does not depend on the parts."""
    return frame.sort(frame.columns)


def assert_same(found: dict[str, pl.DataFrame], expected: dict[str, pl.DataFrame]) -> None:
    """Compare histories by rows."""
    assert found.keys() == expected.keys()
    for name, rows in expected.items():
        assert_frame_equal(sorted_rows(found[name]), sorted_rows(rows))


def test_every_row_of_memory_is_in_the_history_once(whole: tuple[Site, Service]) -> None:
    site, service = whole
    found, known = site.rows(), service.publication.known
    tracks = pl.concat(
        known.history(one, None, 10_000) for one in found["tracks.parquet"]["track_id"].unique()
    )
    assert len(tracks) == known.counts()["output_sequence"] > 3000
    assert_frame_equal(sorted_rows(found["tracks.parquet"]), sorted_rows(tracks))
    biases = pl.concat(known.bias_history(one, None, 100_000) for one in TABLE.ids)
    assert_frame_equal(sorted_rows(found["biases.parquet"]), sorted_rows(biases))
    assert_frame_equal(
        found["measurements.parquet"].sort("time_s").select("time_s", "sensor_id", "range_m"),
        FRAME.sort("time_s").select("time_s", "sensor_id", "range_m"),
        check_dtypes=False,
    )
    health = found["health.parquet"]
    assert health.select("time_s", "sensor_id").is_unique().all()
    assert len(found["transitions.parquet"]) > 10


def test_an_hour_has_the_rows_of_its_hour_and_reads_like_a_run(
    whole: tuple[Site, Service],
) -> None:
    site, _ = whole
    hours = hours_of(site.history)
    assert [one.path.name for one in hours] == ["2023-11-14T22", "2023-11-14T23"]
    for hour in hours:
        times = pl.read_parquet(list(run_tables(hour.path / "tracks.parquet")["tracks.parquet"]))
        assert set((times["time_s"] // 3600).cast(pl.Int64)) == {hour.number}
    viewed = RecordedRun(run_files(hours[0].path, None, [hours[0].path]))
    assert (viewed.name, viewed.sensors.ids) == ("2023-11-14T22", TABLE.ids)
    assert viewed.report["settings"]["coast_after_s"] == viewed.coast_after_s
    # Without a report the settings are the defaults.
    bare = RecordedRun(replace(viewed.files, report=hours[0].path / "missing.json"))
    assert bare.coast_after_s == TrackingSettings().coast_after_s
    assert len(viewed.tracks(START_S + 1500.0)) == 12
    assert viewed.plots(START_S + 1400.0, START_S + 1500.0, 1000)[0].size > 90
    measured = [Recording(one.path / "measurements.parquet") for one in hours]
    assert [one.rows for one in measured] == [2800, 800]
    assert measured[1].octets == sum(
        one.stat().st_size for one in hours[1].path.glob("measurements.parquet/*")
    )
    assert len({one.content_sha256() for one in measured}) == 2
    everything = RecordedRun(run_files(site.history, None, [site.history]))
    assert everything.span_s()[1] - everything.span_s()[0] > 3000.0
    recorded, live = RecordedView([everything]), whole[1].view
    track = int(live.tracks(START_S + 1500.0)["track_id"][0])
    for history, subject in ((UPDATES, track), (TRANSITIONS, track), (BIASES, "41-10")):
        assert_last_rows(recorded, live, history, subject, columns=False)
        assert_last_rows(live, live, history, subject)


def test_a_history_of_services_that_were_killed_is_that_of_one(
    whole: tuple[Site, Service], tmp_path: Path
) -> None:
    site, kept = Site(tmp_path), tmp_path / "kept"
    for first, last in ((0, 1200), (1200, 2600), (2600, 3600)):
        with site.service() as service:
            site.feed(service, first, last)
            assert service.view.status()["history"]["rows"]["tracks.parquet"] > 100
            # What the disk has while rows wait in memory; the last one stops as it should.
            if last < len(FRAME):
                copied(site.history, kept)
        if last < len(FRAME):
            shutil.rmtree(site.history)
            shutil.copytree(kept, site.history)
            unfinished = next((site.history / "2023-11-14T22").glob("tracks.parquet/*"))
            shutil.copy(unfinished, unfinished.with_name("00009999-0000-0001.parquet"))
            shutil.rmtree(kept)
    assert service.view.status()["history"]["lost"] == {}
    assert_same(site.rows(), whole[0].rows())


def copied(folder: Path, to: Path) -> None:
    """Copy a history that may be written meanwhile, as a crash would leave it."""

    def state() -> bytes:
        return (folder / STATE_FILE).read_bytes()

    while True:
        before = state()
        shutil.copytree(folder, to, ignore=shutil.ignore_patterns(".*"))
        if state() == before == (to / STATE_FILE).read_bytes():
            return
        shutil.rmtree(to)


def test_times_that_memory_has_lost_are_answered_from_the_history(
    whole: tuple[Site, Service], tmp_path: Path
) -> None:
    site = Site(tmp_path)
    reference = whole[1].view
    with site.service() as service:
        site.feed(service)
        view = service.view
        at_s = START_S + 1500.3
        assert service.publication.known.past.complete_from_s("updates") > at_s + 1000.0
        assert_frame_equal(view.tracks(at_s), reference.tracks(at_s), rel_tol=1e-9)
        assert len(view.tracks(at_s)) == 12
        for one, other in zip(view.sensors(at_s), reference.sensors(at_s), strict=True):
            for name in ("id", "age_s", "biases", "health"):
                assert one[name] == other[name]
        frames = [decoded(one.past_picture(PastAsked(at_s))) for one in (view, reference)]
        (header, tables), (expected, others) = frames
        assert header["span_s"][0] == pytest.approx(expected["span_s"][0], abs=1.0)
        assert sorted(tables["tracks"]["track_id"]) == sorted(others["tracks"]["track_id"])
        assert len(tables["plots"]["time_s"]) == len(others["plots"]["time_s"]) > 20
        track = int(view.tracks(at_s)["track_id"][0])
        asked = ((UPDATES, track), (TRANSITIONS, track), (BIASES, "41-10"))
        for history, subject in asked:
            for limit, since_s in ((7, START_S), (5000, START_S), (5000, -TIME_MAX_S)):
                found = view.rows(history, subject, since_s, limit)
                assert_frame_equal(found, reference.rows(history, subject, since_s, limit))
            assert_last_rows(view, reference, history, subject)


def assert_last_rows(
    view: View, reference: View, history: History, subject: int | str, *, columns: bool = True
) -> None:
    """Compare the last rows up to a time with those of all."""
    every = reference.rows(history, subject, -TIME_MAX_S, 100_000)
    time_s = pl.col("time_s")
    for until_s in (START_S - 1.0, float(every["time_s"][2]), START_S + 1500.0, TIME_MAX_S):
        for limit, since_s in ((3, None), (7, START_S + 100.0), (5000, None)):
            begin_s = -TIME_MAX_S if since_s is None else since_s
            expected = every.filter(time_s >= begin_s, time_s <= until_s).tail(limit)
            found = view.rows(history, subject, since_s, limit, until_s)
            if columns:
                assert_frame_equal(found, expected)
            assert found["time_s"].to_list() == expected["time_s"].to_list()


def test_memory_answers_what_it_has_where_another_table_is_shorter(
    whole: tuple[Site, Service], tmp_path: Path
) -> None:
    """Tracks after the last write were lost where the plots in memory reach less far back."""
    site = Site(tmp_path, RuntimeLimits(plot_rows_max=60))
    reference = whole[1].view
    with site.service() as service:
        site.feed(service, 0, 1200)
    with site.service() as service:
        site.feed(service, 1200, 1500)
        view, past = service.view, service.publication.known.past
        times = [START_S + after_s for after_s in (1100.3, 1290.3)]
        assert past.complete_from_s("plots") > times[1]
        for at_s in times:
            assert_frame_equal(view.tracks(at_s), reference.tracks(at_s))
        (_, tables), (_, others) = (
            decoded(one.past_picture(PastAsked(times[0]))) for one in (view, reference)
        )
        assert len(tables["plots"]["time_s"]) == len(others["plots"]["time_s"]) > 20
        # Of memory, which has the covariances.
        assert np.isfinite(tables["tracks"]["sigma_major_m"]).all()
        track = int(view.tracks(times[1])["track_id"][0])
        found = view.rows(UPDATES, track, START_S, 5000)
        expected = reference.rows(UPDATES, track, START_S, 5000).head(len(found))
        assert_frame_equal(found, expected)
        assert found["time_s"][-1] > START_S + 1450.0


def test_a_time_that_is_not_retained_is_an_error_that_names_the_span(
    whole: tuple[Site, Service],
) -> None:
    for at_s in (START_S - 100.0, START_S + 1e6):
        with pytest.raises(
            RequestError, match=r"data times 17000000[^ ]* to .* are retained"
        ) as raised:
            whole[1].view.tracks(at_s)
        assert (raised.value.status, raised.value.code) == (404, "NOT_RETAINED")


def test_the_oldest_hours_are_removed_by_age_and_by_octets(
    whole: tuple[Site, Service], tmp_path: Path
) -> None:
    folder = tmp_path / "history"
    shutil.copytree(whole[0].history, folder)
    for name in ("2023-11-14T20", "2023-11-13T20"):
        shutil.copytree(folder / "2023-11-14T22", folder / name)
    kept = HistoryFolder(folder, dict)
    now_s = START_S + 1e9
    assert kept.remove_oldest(1.5, 0, now_s) == []
    # A data clock that was set far ahead removes nothing.
    assert kept.remove_oldest(1.0, 0, START_S - 86_400.0) == []
    assert kept.remove_oldest(1.0, 0, now_s) == ["2023-11-13T20"]
    assert kept.remove_oldest(0.0, kept.octets - 1, now_s) == ["2023-11-14T20"]
    # The last hour stays.
    assert kept.remove_oldest(0.0, 1, now_s) == ["2023-11-14T22"]
    assert [one.path.name for one in hours_of(folder)] == ["2023-11-14T23"]
    assert kept.octets == sum(one.stat().st_size for one in folder.glob("*/*/*.parquet"))
    kept.close()


def test_a_full_disk_stops_the_history_with_an_alarm_and_not_the_service(tmp_path: Path) -> None:
    site = Site(tmp_path)
    site.rules = HistoryRules(site.history, limits=RuntimeLimits(disk_free_bytes_min=1 << 60))
    with site.service() as service:
        for begin in range(0, 1000, MESSAGE):
            submit(service, FRAME[begin : begin + MESSAGE])
        wait_until(lambda: HISTORY_STOPPED in service.view.status()["alarms"], "the alarm")
        status = settled(service)
        assert status["accepted"] == 1000
        assert any("the history disk is full; free some space" in one for one in status["warnings"])  # type: ignore[attr-defined]
    assert site.rows() == {}


def test_what_was_overwritten_before_it_was_written_is_counted_with_an_alarm(
    tmp_path: Path,
) -> None:
    site = Site(tmp_path)
    with site.service() as service:
        site.feed(service, 0, 400)
    with site.service(history=False) as service:
        site.feed(service, 400, 2400)
    with site.service() as service:
        wait_until(lambda: service.view.status()["history"]["lost"], "the loss is counted")
        status = settled(service)
    history: dict[str, Any] = status["history"]  # type: ignore[assignment]
    assert HISTORY_INCOMPLETE in status["alarms"]  # type: ignore[operator]
    written = len(site.rows()["tracks.parquet"])
    assert written + history["lost"]["tracks.parquet"] == status["output_sequence"]
    # The journal has all measurements.
    assert len(site.rows()["measurements.parquet"]) == 2400


@pytest.mark.parametrize(
    ("batches", "named"),
    [(1, "another journal: entry 1 differs"), (2, "up to 2, but the journal ends with entry 1 (")],
)
def test_a_history_of_another_journal_is_left_alone_with_an_alarm(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, batches: int, named: str
) -> None:
    site = Site(tmp_path)
    with site.service() as service:
        for number in range(batches):
            submit(service, FRAME[400 * number : 400 * (number + 1)])
        settled(service)
    before = {one: one.read_bytes() for one in site.history.rglob("*") if one.is_file()}
    other = Site(tmp_path / "other")
    with other.service() as service:
        submit(service, FRAME[:300])
        settled(service)
    other.rules = site.rules
    with other.service() as service:
        submit(service, FRAME[300:400])
        status = settled(service)
        assert HISTORY_STOPPED in status["alarms"]  # type: ignore[operator]
        assert any("another journal" in one for one in status["warnings"])  # type: ignore[attr-defined]
    assert named in caplog.text
    assert {one: one.read_bytes() for one in site.history.rglob("*") if one.is_file()} == before


def test_a_write_that_did_not_finish_leaves_no_rows(tmp_path: Path) -> None:
    rows = pl.DataFrame({"time_s": [START_S + 1.0, START_S + 5000.0], "track_id": [1, 2]})
    folder = HistoryFolder(tmp_path / "history", dict)
    folder.write({"tracks.parquet": rows}, HistoryState(positions={"tracks.parquet": 2}))
    late = rows.with_columns(track_id=pl.lit(3, pl.Int64))
    # A folder in the place of a part: the second of two renames fails.
    table = tmp_path / "history" / "2023-11-14T23" / "tracks.parquet"
    broken = table / "00000002-2200-2200.parquet"
    broken.mkdir()
    (broken / "file").touch()
    with pytest.raises(OSError, match=r"Is a directory|not empty"):
        folder.write({"tracks.parquet": late}, HistoryState(positions={"tracks.parquet": 4}))
    shutil.rmtree(broken)
    tables = history_tables(tmp_path / "history")["tracks.parquet"]
    assert len(tables) == 3
    folder.write({"tracks.parquet": late}, HistoryState(positions={"tracks.parquet": 4}))
    tables = history_tables(tmp_path / "history")["tracks.parquet"]
    assert sorted(pl.read_parquet(list(tables))["track_id"]) == [1, 2, 3, 3]
    assert json.loads((tmp_path / "history" / STATE_FILE).read_bytes())["write"] == 2
    with pytest.raises(InputError, match="another service"):
        HistoryFolder(tmp_path / "history", dict)
    folder.close()


def test_a_folder_of_other_files_is_no_history(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="choose another folder"):
        HistoryFolder(tmp_path, dict)
    (tmp_path / STATE_FILE).write_text("{")
    with pytest.raises(InputError, match="damaged"):
        HistoryFolder(tmp_path, dict)


@pytest.mark.parametrize(
    ("after_s", "until_s", "expected"),
    [
        (650.0, 1100.0, "2"), (600.0, 1200.0, "123"), (1300.0, 3605.0, "34"), (3700.0, 3900.0, ""),
        (-TIME_MAX_S, 1300.0, "123"), (1300.0, TIME_MAX_S, "34"),
    ],
)  # fmt: skip
def test_only_the_parts_of_a_span_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after_s: float, until_s: float, expected: str
) -> None:
    """A page without a begin once looked into every hour since the year -1199."""
    looked: list[int] = []

    def counted(hour: Hour, table: str) -> list[Part]:
        looked.append(hour.number)
        assert len(looked) <= 2
        return parts_of(hour, table)

    monkeypatch.setattr(history_files, "parts_of", counted)
    parts = (0, "1-0000-0600"), (0, "2-0600-1200"), (0, "3-1200-1800"), (1, "4-0000-0010")
    for hour, name in parts:
        path = tmp_path / hour_name(hour) / "tracks" / f"0000000{name}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    found = parts_between(tmp_path, "tracks", after_s, until_s)
    assert "".join(path.name[7] for path in found) == expected
