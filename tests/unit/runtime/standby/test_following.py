"""A standby computes what the primary does, writes nothing, and continues where it ends."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from multiradar.cli.serve import advice_after
from multiradar.clock import SystemClock
from multiradar.errors import JournalError, PipelineError, RemovedEntriesError
from multiradar.runtime.admission.admission_by_time import data_clock_of
from multiradar.runtime.engine.tracking_engine import TrackingEngine
from multiradar.runtime.live.processor import Processor
from multiradar.runtime.live.readiness import STANDBY, ServiceState
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.runtime.memory.regions.areas import Areas
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.runtime.memory.regions.messages import packed
from multiradar.runtime.standby.following import Standby
from multiradar.storage.archive import archive_journal
from multiradar.storage.retention import Rules, shorten
from multiradar.storage.snapshots import Position, SnapshotFolder
from multiradar.storage.sqlite.shortening import digests_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios.live_scene import recording
from unit.runtime.memory.test_regions import AREAS, handover

FRAME = recording(1000)
FINGERPRINT = "a" * 64
SNAPSHOT_ROWS = 100


class Pair:
    """A primary and its standby on one journal."""

    def __init__(self, path: Path, areas: Areas | None = None) -> None:
        self._path, self._areas = path, areas
        self.failed = 0
        self.began = 0
        self.primary, journal = self._service()
        assert not journal.following
        self.primary.start()
        self.second, self.journal = self._service()
        self.standby = Standby(self.second, self.journal, SystemClock(), self._begin)

    def _service(
        self, engine: Callable[[], TrackingEngine] = FakeEngine
    ) -> tuple[Service, SqliteJournal]:
        service = Service(
            open_journal=lambda: SqliteJournal(self._path, FINGERPRINT, standby=True),
            open_engine=engine,
            sensors=TABLE,
            tracking=TrackingSettings(),
            snapshots=SnapshotRules(
                SnapshotFolder(self._path), math.inf, SNAPSHOT_ROWS, FINGERPRINT
            ),
            on_failure=self._fail,
        )
        if self._areas is not None:
            service.publication.divide(RegionBoard(self._areas, RegionRules()))
        journal = service.open()
        assert isinstance(journal, SqliteJournal)
        return service, journal

    def _fail(self) -> None:
        self.failed += 1

    def _begin(self) -> None:
        self.began += 1

    def level(self) -> None:
        """Wait until the standby has processed all that the primary has acknowledged."""
        last = self.primary.view.status()["journal_sequence"]
        wait_until(lambda: self.second.view.status()["processed_sequence"] == last, "the standby")

    def stop(self) -> None:
        """Stop both."""
        self.standby.stop()
        self.primary.stop()
        self.second.stop()


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    """Both are stopped at the end."""
    made = Pair(tmp_path / "journal.db")
    yield made
    made.stop()


SAME = ("processed_sequence", "journal_sequence", "output_sha256", "event_sequence", "accepted")


def test_a_standby_follows_without_accepting_and_takes_over(pair: Pair) -> None:
    submit(pair.primary, FRAME[:300], "a")
    pair.standby.start()
    submit(pair.primary, FRAME[300:500], "b")
    settled(pair.primary)
    pair.level()
    before, followed = pair.primary.view.status(), pair.second.view.status()
    assert {name: followed[name] for name in SAME} == {name: before[name] for name in SAME}
    assert (before["role"], followed["role"]) == ("primary", "standby")
    assert (followed["lag_entries"], followed["lag_s"]) == (0, 0.0)
    assert [one.code for one in pair.second.unready()] == [STANDBY]
    with pytest.raises(PipelineError, match="this service is the standby"):
        pair.second.submit(FRAME[:1], source="test")
    assert pair.began == 0

    pair.primary.stop()
    wait_until(lambda: pair.began, "the takeover")
    assert (pair.second.state, pair.second.unready()) == (ServiceState.RUNNING, ())
    assert pair.second.view.status()["role"] == "primary"
    # A sender that does not know whether its message was acknowledged.
    assert submit(pair.second, FRAME[300:500], "b").duplicate
    submit(pair.second, FRAME[500:], "c")
    after = settled(pair.second)
    assert (after["journal_sequence"], after["accepted"]) == (3, 1000)
    assert pair.failed == 0


def test_only_a_running_service_is_asked_for_an_earlier_message(pair: Pair) -> None:
    """A standby answered a flush with a key with an internal error, which ended a replay."""
    submit(pair.primary, FRAME[:300], "a")
    pair.standby.start()
    pair.level()

    def assert_rejected(service: Service, reason: str) -> None:
        for key in ("a", "b", None):
            with pytest.raises(PipelineError, match=reason):
                service.flush(source="test", idempotency_key=key)
        with pytest.raises(PipelineError, match=reason):
            service.has_message("a")

    assert_rejected(pair.second, "this service is the standby")
    pair.primary.drain()
    assert_rejected(pair.primary, "the service is draining")
    wait_until(lambda: pair.began, "the takeover")
    assert pair.second.has_message("a")
    flushed = pair.second.flush(source="test", idempotency_key="b").result(WAIT_TIMEOUT_S)
    assert not flushed.duplicate


def test_what_a_standby_has_processed_has_been_counted(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair.second.start(following=True)
    submit(pair.primary, FRAME[:300])
    seen: list[dict[str, Any]] = []
    follow = Processor.follow

    def followed(processor: Processor, until: int) -> None:
        follow(processor, until)
        seen.append(pair.second.view.status())

    monkeypatch.setattr(Processor, "follow", followed)
    pair.second.follow(1)
    assert [(one["processed_sequence"], one["accepted"]) for one in seen] == [(1, 300)]


def test_the_output_is_that_of_one_service(pair: Pair, tmp_path: Path) -> None:
    pair.standby.start()
    submit(pair.primary, FRAME[:500])
    pair.primary.stop()
    wait_until(lambda: pair.began, "the takeover")
    submit(pair.second, FRAME[500:])
    found = settled(pair.second)
    alone = Pair(tmp_path / "alone.db")
    submit(alone.primary, FRAME[:500])
    submit(alone.primary, FRAME[500:])
    expected = settled(alone.primary)
    alone.stop()
    for name in ("output_sha256", "event_sequence", "output_sequence", "accepted"):
        assert found[name] == expected[name]


def test_a_standby_has_what_the_neighbouring_regions_hand_over(tmp_path: Path) -> None:
    pair, alone = Pair(tmp_path / "journal.db", AREAS), Pair(tmp_path / "alone.db", AREAS)

    def send(service: Service, number: int) -> None:
        submit(service, FRAME[200 * number : 200 * (number + 1)])
        time_s = float(FRAME["time_s"][200 * (number + 1) - 1])
        message = handover(track_id=7 + number).replace(b": 10.0", f": {time_s}".encode())
        service.hand_over(packed(message), source="region east").result(WAIT_TIMEOUT_S)
        settled(service)

    def known(service: Service) -> list[Any]:
        reader = service.view.subscribe(0, 10**6)
        events = [one.key for one in reader.poll(10**6)]
        reader.close()
        board = service.view.regions
        assert board is not None
        return [board.figures(), events, service.view.tracks()["responsible"]]

    send(pair.primary, 0)
    pair.standby.start()
    send(pair.primary, 1)
    pair.level()
    followed, expected = known(pair.second), known(pair.primary)
    (neighbour,) = expected[0]["neighbours"]
    assert (neighbour["messages"], neighbour["tracks"]) == (2, 1)
    assert followed[:2] == expected[:2]
    pair.primary.stop()
    wait_until(lambda: pair.began, "the takeover")
    send(pair.second, 2)
    for number in range(3):
        send(alone.primary, number)
    found, expected = known(pair.second), known(alone.primary)
    assert found[:2] == expected[:2]
    assert len(expected[2])
    assert found[2].equals(expected[2])
    pair.stop()
    alone.stop()


def test_snapshots_are_written_by_the_primary_alone(pair: Pair, tmp_path: Path) -> None:
    folder = SnapshotFolder(tmp_path / "journal.db")
    pair.standby.start()
    submit(pair.primary, FRAME[:SNAPSHOT_ROWS])
    wait_until(folder.files, "the snapshot of the primary")
    pair.level()
    submit(pair.primary, FRAME[SNAPSHOT_ROWS : SNAPSHOT_ROWS + 1])
    pair.level()
    pair.standby.stop()
    written = sorted(folder.path.iterdir())
    pair.second.stop()
    assert sorted(folder.path.iterdir()) == written


def test_a_snapshot_after_a_takeover_needs_no_rows_that_the_primary_has_removed(
    pair: Pair, tmp_path: Path
) -> None:
    folder = SnapshotFolder(tmp_path / "journal.db")
    submit(pair.primary, FRAME[:200])
    wait_until(folder.files, "the snapshot of the primary")
    pair.standby.start()
    pair.primary.stop()
    wait_until(lambda: pair.began, "the takeover")
    for path in folder.path.glob("*.rows"):
        path.unlink()
    submit(pair.second, FRAME[200:400])
    settled(pair.second)
    pair.second.stop()
    newest = folder.files()[0]
    assert newest.name == "000000000002.snapshot"
    for files in folder.read(newest).tables.values():
        folder.read_rows(files)


class Picky(FakeEngine):
    """Fails on a batch of 13 measurements."""

    def push(self, batch: object, clock_s: float | None = None) -> object:  # type: ignore[override]
        if len(batch) == 13:  # type: ignore[arg-type]
            raise ValueError("thirteen")
        return super().push(batch, clock_s)  # type: ignore[arg-type]


@pytest.mark.fault(27)
def test_an_entry_that_cannot_be_processed_is_skipped_by_both(tmp_path: Path) -> None:
    pair = Pair(tmp_path / "journal.db")
    pair.second.stop()
    pair.primary.stop()
    pair.primary, _ = pair._service(Picky)  # type: ignore[arg-type]
    pair.second, pair.journal = pair._service(Picky)  # type: ignore[arg-type]
    pair.primary.start()
    pair.standby = Standby(pair.second, pair.journal, SystemClock(), pair._begin)
    pair.standby.start()
    for begin, end in ((0, 20), (20, 33), (33, 60)):
        submit(pair.primary, FRAME[begin:end])
    settled(pair.primary)
    pair.level()
    expected = pair.primary.view.status()
    pair.primary.stop()
    wait_until(lambda: pair.began, "the takeover")
    found = settled(pair.second)
    pair.stop()
    assert found["skipped"] == expected["skipped"] == [2]
    assert found["output_sha256"] == expected["output_sha256"]


def test_entries_in_a_snapshot_of_the_primary_are_not_processed_again(tmp_path: Path) -> None:
    """A standby that was built again from a snapshot beyond its last entry went back to it."""
    pair = Pair(tmp_path / "journal.db")
    pair.second.stop()
    pair.primary.stop()
    pair.primary, _ = pair._service(Picky)  # type: ignore[arg-type]
    pair.second, pair.journal = pair._service(Picky)  # type: ignore[arg-type]
    pair.primary.start()
    submit(pair.primary, FRAME[:20])
    pair.second.start(following=True)
    for begin, end in ((20, 33), (33, 60), (60, 200)):
        submit(pair.primary, FRAME[begin:end])
    expected = settled(pair.primary)
    wait_until(lambda: len(SnapshotFolder(tmp_path / "journal.db").files()), "the snapshot")
    assert pair.second.follow(2) == 4
    assert pair.second.follow(4) == 4
    found = pair.second.view.status()
    pair.stop()
    assert {name: found[name] for name in SAME} == {name: expected[name] for name in SAME}


def test_entries_that_arrive_during_the_replay_are_processed(tmp_path: Path) -> None:
    """A replay that took the end of the journal for its own end left them out."""
    primary: list[Service] = []

    class Slow(FakeEngine):
        def push(self, batch: object, clock_s: float | None = None) -> object:  # type: ignore[override]
            if primary:
                submit(primary.pop(), FRAME[100:200])
            return super().push(batch, clock_s)  # type: ignore[arg-type]

    pair = Pair(tmp_path / "journal.db")
    submit(pair.primary, FRAME[:100])
    pair.second.stop()
    pair.second, pair.journal = pair._service(Slow)  # type: ignore[arg-type]
    pair.standby = Standby(pair.second, pair.journal, SystemClock(), pair._begin)
    primary.append(pair.primary)
    pair.standby.start()
    assert primary == []
    settled(pair.primary)
    pair.level()
    digests = {one.view.status()["output_sha256"] for one in (pair.primary, pair.second)}
    pair.stop()
    assert len(digests) == 1


def test_a_standby_that_is_replaying_is_behind_by_the_whole_journal(tmp_path: Path) -> None:
    """It stated a lag of 0 entries, so that an upgrade took it for ready to take over."""
    found: list[dict[str, Any]] = []
    pair = Pair(tmp_path / "journal.db")

    class Looking(FakeEngine):
        def push(self, batch: object, clock_s: float | None = None) -> object:  # type: ignore[override]
            found.append(pair.second.view.status())
            return super().push(batch, clock_s)  # type: ignore[arg-type]

    submit(pair.primary, FRAME[:100])
    submit(pair.primary, FRAME[100:200])
    settled(pair.primary)
    pair.second.stop()
    pair.second, pair.journal = pair._service(Looking)  # type: ignore[arg-type]
    pair.standby = Standby(pair.second, pair.journal, SystemClock(), pair._begin)
    pair.standby.start()
    wait_until(lambda: pair.standby.document()["lag_s"] == 0.0, "the standby")
    after = pair.second.view.status()
    pair.stop()
    assert found
    assert {one["lag_entries"] for one in found} == {2}
    assert (after["lag_entries"], after["lag_s"]) == (0, 0.0)


def test_a_reader_that_is_ahead_of_the_standby_waits_for_its_next_event(pair: Pair) -> None:
    pair.standby.start()
    submit(pair.primary, FRAME[:300])
    settled(pair.primary)
    pair.level()
    pair.standby.stop()
    submit(pair.primary, FRAME[300:400])
    submit(pair.primary, FRAME[400:500])
    settled(pair.primary)
    everything = pair.primary.view.subscribe(0, 10_000).poll(10_000)
    head = pair.second.view.status()["event_sequence"]
    ahead = pair.second.view.subscribe(head + 50, 10_000)
    foreign = pair.second.view.subscribe(10_000, 10_000)
    assert (ahead.poll(100), foreign.poll(100)) == ([], [])
    pair.primary.stop()
    pair.standby = Standby(pair.second, pair.journal, SystemClock(), pair._begin)
    assert pair.standby.step()
    assert ahead.poll(10_000) == everything[head + 50 :]
    # It was never that of this journal.
    assert [one.kind for one in foreign.poll(10)] == ["gap"]


def test_a_standby_that_can_no_longer_follow_ends_with_the_reason(pair: Pair) -> None:
    pair.standby.start()
    path = pair.journal._path
    path.rename(path.with_name("moved.db"))
    wait_until(lambda: pair.failed, "the failure of the standby")
    assert isinstance(pair.second.failure, JournalError)
    assert "journal.db: removed while the service was using it" in str(pair.second.failure)
    assert pair.second.state is ServiceState.FAILED
    assert pair.began == 0


def test_a_standby_left_behind_by_a_shortened_journal_is_to_be_started_again(
    pair: Pair, tmp_path: Path
) -> None:
    pair.second.start(following=True)
    for begin in range(0, 900, 100):
        submit(pair.primary, FRAME[begin : begin + 100])
    path = pair.journal._path
    archive_journal(path, tmp_path / "archive", segment_octets=1)
    marks = [Position(one, digest) for one, digest in digests_of(path, [8, 4]).items()]
    found = shorten(
        path, tmp_path / "archive", Rules(octets=1), snapshots=marks, time_of=data_clock_of,
        now_s=1e12,
    )  # fmt: skip
    assert found.removed == 4
    pair.standby._run()
    failure = pair.second.failure
    assert isinstance(failure, RemovedEntriesError)
    assert "start it again" in str(failure)
    assert "restore the archive" not in str(failure)
    assert advice_after(failure) == ""
    assert pair.second.state is ServiceState.FAILED


def test_a_service_that_is_no_standby_does_not_follow(pair: Pair) -> None:
    with pytest.raises(PipelineError, match="the service is not a standby: running"):
        pair.primary.follow(1)
    pair.standby.start()
    pair.standby.stop()
    pair.standby.stop()
    assert pair.primary.submit(FRAME[:1], source="test").result(WAIT_TIMEOUT_S).accepted == 1
