"""A start from a snapshot gives the same as the whole journal; only a sound one is used."""

import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import JournalError, PipelineError, SnapshotError
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules, Snapshots
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import StoredEntry
from multiradar.storage.journal import Space
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.storage.snapshots import KEPT, SnapshotFolder
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios.live_scene import recording

FRAME = recording(1000)
#: Of which a snapshot holds everything.
LIMITS = RuntimeLimits(
    events_max=300, history_rows_max=400, bias_history_rows_max=300, transition_rows_max=100,
    plot_rows_max=400, rejects_kept_max=5,
)  # fmt: skip


class Recorder(logging.Handler):
    """Keeps what the service logs about snapshots."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a line."""
        self.lines.append(record.getMessage())


@pytest.fixture
def log() -> Iterator[list[str]]:
    """What is logged about snapshots."""
    logger = logging.getLogger("multiradar.runtime.live.snapshots")
    recorder, level = Recorder(), logger.level
    logger.addHandler(recorder)
    logger.setLevel(logging.INFO)
    yield recorder.lines
    logger.removeHandler(recorder)
    logger.setLevel(level)


class Counted(FakeEngine):
    """Counts the measurements that reach an engine."""

    rows = 0

    def push(self, batch: Any, clock_s: float | None = None) -> EngineOutput:
        """Count them."""
        Counted.rows += len(batch)
        return super().push(batch, clock_s)


class DamagedJournal(MemoryJournal):
    """Finds an entry damaged when it is read."""

    damaged = 0

    def read(self, after: int) -> Iterator[StoredEntry]:
        """Yield the entries up to it."""
        for stored in super().read(after):
            if stored.sequence == self.damaged:
                raise JournalError(f"entry {self.damaged} is damaged")
            yield stored


class Site:
    """A journal and the folder of its snapshots, for one service after the other."""

    def __init__(self, folder: Path) -> None:
        self.journal = DamagedJournal("sensors and settings")
        self.rules = SnapshotRules(
            SnapshotFolder(folder / "journal"), 1e9, 1, "sensors and settings"
        )
        self.limits = LIMITS
        self.engine: type[FakeEngine] = Counted

    @contextmanager
    def service(self, *, snapshots: bool = True) -> Iterator[Service]:
        """Run a service; `Counted.rows` has the measurements replayed at its start."""
        service = Service(
            open_journal=lambda: self.journal,
            open_engine=self.engine,
            sensors=TABLE,
            tracking=TrackingSettings(),
            limits=self.limits,
            snapshots=self.rules if snapshots else None,
        )
        Counted.rows = 0
        service.start()
        try:
            yield service
        finally:
            service.stop()

    def fill(self) -> dict[str, Any]:
        """Run a service with measurements and two clean stops; return what the last one knew."""
        for first, last in ((0, 600), (600, 900)):
            with self.service() as service:
                for begin in range(first, last, 100):
                    submit(service, FRAME[begin : begin + 110], key=str(begin))
                known = everything(service)
        return known

    @property
    def files(self) -> list[Path]:
        """The snapshots, the newest first."""
        return self.rules.folder.files()


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """An empty one."""
    return Site(tmp_path)


def everything(service: Service) -> dict[str, Any]:
    """Return all that a service publishes."""
    status = settled(service)
    # Counts since the start of the process, and what it is at work on.
    for name in ("arrivals", "warnings", "sources", "subscribers", "lags_s", "received_age_s"):
        del status[name]
    reader = service.view.subscribe(0, 10**6)
    events = []
    while part := reader.poll(1000):
        events += [(one.sequence, one.kind, one.key, one.payload) for one in part]
    known = service.publication.view._known
    return {
        # Whole chunks are retained: there may be more events than the limit.
        "status": status, "events": events[-LIMITS.events_max :],
        "tracks": service.view.tracks().to_dicts(), "sensors": service.view.sensors(),
        "history": [known.history(track, None, 50).to_dicts() for track in range(1, 14)],
        "biases": known.bias_history("41-10", 0.0, 100).to_dicts(),
        "rejects": [service.quarantined(0, 100, code) for code in ("TIME_LATE", "DUPLICATE")],
    }  # fmt: skip


def whole(site: Site) -> dict[str, Any]:
    """Return what a service without snapshots knows."""
    with site.service(snapshots=False) as service:
        assert Counted.rows == site.journal.counts().accepted
        return everything(service)


def test_a_start_after_a_clean_stop_processes_nothing_again(site: Site) -> None:
    known = site.fill()
    assert len(site.files) == KEPT
    with site.service() as service:
        assert Counted.rows == 0
        assert everything(service) == whole(site)
        # The payloads of the first have the delay of the machine.
        assert [one[:3] for one in known["events"]] == [
            one[:3] for one in everything(service)["events"]
        ]


def test_rows_that_have_been_overwritten_are_removed(site: Site) -> None:
    site.limits = replace(LIMITS, events_max=100, history_rows_max=100)
    for begin in range(0, 320, 40):
        with site.service() as service:
            submit(service, FRAME[begin : begin + 40])
            settled(service)
    ends = [int(one.name.split("-")[2]) for one in site.files[0].parent.glob("history-*.rows")]
    # The older of the two snapshots has the 100 rows before its own end.
    assert len(ends) >= KEPT
    assert min(ends) > sorted(ends)[-KEPT] - 100


@pytest.mark.slow
def test_the_rest_of_the_journal_follows_a_snapshot(site: Site) -> None:
    site.fill()
    site.files[0].unlink()
    with site.service() as service:
        assert 0 < Counted.rows < 400
        assert everything(service) == whole(site)
        submit(service, FRAME[900:])
        again = everything(service)
    expected = whole(site)
    assert again["status"] == expected["status"]
    assert again["tracks"] == expected["tracks"]


def test_a_snapshot_is_written_while_measurements_arrive(site: Site) -> None:
    site.rules = replace(site.rules, rows=100)
    with site.service() as service:
        submit(service, FRAME[:150])
        settled(service)
        processor: Any = service._processor
        processor._snapshots.wait()
        assert [path.name for path in site.files] == ["000000000001.snapshot"]


Spoil = Callable[[Path, Path], None]


def _flip(path: Path, _rows: Path) -> None:
    octets = bytearray(path.read_bytes())
    octets[len(octets) // 2] ^= 1
    path.write_bytes(octets)


def _cut(path: Path, _rows: Path) -> None:
    os.truncate(path, path.stat().st_size - 1)


def _newer(path: Path, _rows: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b"snapshot 2\n", b"snapshot 3\n", 1))


def _no_rows(_path: Path, rows: Path) -> None:
    rows.unlink()


def _other_rows(_path: Path, rows: Path) -> None:
    _flip(rows, rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (_flip, "damaged: the SHA-256 does not match"),
        (_cut, "damaged: the SHA-256 does not match"),
        (lambda path, _: path.write_bytes(b""), "damaged: no snapshot header"),
        (_newer, "expected format 2, was 3"),
        (_no_rows, "No such file"),
        (_other_rows, "damaged: the SHA-256 does not match"),
    ],
)
def test_a_damaged_snapshot_is_named_and_the_one_before_used(
    site: Site, log: list[str], spoil: Spoil, reason: str
) -> None:
    site.fill()
    newest, older = site.files
    rows = {path.name: site.rules.folder.read(path).tables["history"] for path in site.files}
    only = set(rows[newest.name]) - set(rows[older.name])
    spoil(newest, site.rules.folder.path / only.pop().name)
    log.clear()
    with site.service() as service:
        assert 0 < Counted.rows < 400
        assert everything(service) == whole(site)
    assert [one for one in log if newest.name in one and reason in one], log


def test_each_damaged_octet_is_found(site: Site) -> None:
    folder, rows = site.rules.folder, FRAME["time_s"].to_numpy()[:20]
    file = folder.write_rows("x", 0, rows)
    path = folder.path / file.name
    sound = path.read_bytes()
    for octet in range(len(sound)):
        damaged = bytearray(sound)
        damaged[octet] ^= 1 << octet % 8
        path.write_bytes(damaged)
        with pytest.raises(SnapshotError, match=r"x-0-20-"):
            folder.read_rows([file])
    path.write_bytes(sound)
    assert folder.read_rows([file]).tolist() == rows.tolist()


def _other_settings(site: Site) -> None:
    site.rules = replace(site.rules, fingerprint="others")


def _other_limits(site: Site) -> None:
    site.limits = replace(LIMITS, history_rows_max=401)


def _older_journal(site: Site) -> None:
    site.journal = _copy(site.journal, 5)


def _other_journal(site: Site) -> None:
    site.journal = _copy(site.journal, 100, source="another")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (_other_settings, "differs from this service in: configuration"),
        (_other_limits, "differs from this service in: limits"),
        (_older_journal, "which is not in the journal"),
        (_other_journal, "another journal: entry"),
    ],
)
def test_a_foreign_snapshot_is_not_used_and_replaced(
    site: Site, log: list[str], change: Callable[[Site], None], reason: str
) -> None:
    site.fill()
    change(site)
    log.clear()
    with site.service() as service:
        assert Counted.rows == site.journal.counts().accepted
        assert everything(service) == whole(site)
    assert sum(reason in line for line in log) == KEPT, log
    with site.service() as service:
        assert Counted.rows == 0


def _copy(journal: DamagedJournal, entries: int, source: str = "test") -> DamagedJournal:
    copy = DamagedJournal("sensors and settings")
    for stored in list(journal.read(0))[:entries]:
        copy.append([replace(stored.entry, source=source)])
    return copy


def test_damage_before_the_snapshot_stops_the_service_and_the_next_start(
    site: Site, log: list[str]
) -> None:
    site.fill()
    site.journal.damaged = 3
    with site.service() as service:
        assert Counted.rows == 0
        wait_until(lambda: service.failure is not None, "the damage is found")
        assert str(service.failure) == "entry 3 is damaged"
        assert service.state == "failed"
    assert site.files == []
    with pytest.raises(JournalError, match="entry 3 is damaged"), site.service():
        pass


def test_damage_that_also_hides_whether_the_journal_was_shortened_stops_the_service(
    site: Site, log: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread ended with a second error, and the service went on acknowledging."""
    site.fill()
    removed_until = site.journal.removed_until

    def verify() -> None:
        raise JournalError("page 7 is damaged")

    def unreadable() -> int:
        if threading.current_thread().name == "journal-check":
            raise JournalError("page 1 is damaged")
        return removed_until()

    monkeypatch.setattr(site.journal, "verify_pages", verify)
    monkeypatch.setattr(site.journal, "removed_until", unreadable)
    with site.service() as service:
        wait_until(lambda: service.failure is not None, "the damage is found")
        assert str(service.failure) == "page 7 is damaged"
    assert len(site.files) == KEPT
    assert any("snapshots are kept: page 1 is damaged" in line for line in log)


def test_a_service_that_stops_does_not_wait_for_the_verification(
    site: Site, log: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    site.fill()
    verifying, stopped = threading.Event(), threading.Event()

    def verify() -> None:
        verifying.set()
        assert stopped.wait(WAIT_TIMEOUT_S)
        raise JournalError("interrupted")

    monkeypatch.setattr(site.journal, "verify_pages", verify)
    monkeypatch.setattr(site.journal, "stop_verifying", stopped.set)
    with site.service() as service:
        assert verifying.wait(WAIT_TIMEOUT_S)
    assert service.failure is None
    assert len(site.files) == KEPT


def test_an_entry_that_is_skipped_since_then_is_not_in_a_snapshot(
    site: Site, log: list[str]
) -> None:
    site.fill()
    site.journal.skip(2, "poison")
    with site.service() as service:
        assert everything(service)["status"]["skipped"] == [2]
        assert Counted.rows == site.journal.counts().accepted - 110
    assert sum("differs from this service in: skipped entries" in line for line in log) == KEPT


@pytest.mark.slow
def test_a_full_disk_costs_the_snapshot_alone(
    site: Site, log: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    site.fill()
    before = sorted(os.listdir(site.rules.folder.path))
    write = os.write

    def full(file: int, octets: Any) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with site.service() as service:
        submit(service, FRAME[900:])
        settled(service)
    assert any("snapshot at entry" in line and "No space left" in line for line in log)
    assert sorted(os.listdir(site.rules.folder.path)) == before
    monkeypatch.setattr(os, "write", write)
    with site.service() as service:
        assert Counted.rows == len(FRAME) - 900
        assert everything(service) == whole(site)


def test_a_snapshot_that_fails_raises_an_alarm_until_one_is_written(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("multiradar.runtime.live.snapshots.SHARE_MAX", 1e9)
    require = Snapshots._require_space
    free = [0]

    def space(snapshots: Snapshots, _space: Space | None, octets: int) -> None:
        require(snapshots, Space(free[0], 10**12, 0), octets)

    monkeypatch.setattr(Snapshots, "_require_space", space)
    with site.service() as service:
        submit(service, FRAME[:100])
        wait_until(lambda: service.view.status()["alarms"] == ["snapshots_failing"], "alarm")
        (warning,) = [one for one in service.view.status()["warnings"] if "snapshot" in one]
        assert "the last snapshot, at entry 1, failed" in warning
        assert "the next start replays the journal from an earlier entry on" in warning
        assert "MB left; free some space" in warning
        free[0] = 10**12
        submit(service, FRAME[100:200])
        wait_until(lambda: service.view.status()["alarms"] == [], "no alarm")
        free[0] = 0
        submit(service, FRAME[200:300])
        wait_until(lambda: service.view.status()["alarms"] == ["snapshots_failing"], "alarm")
        free[0] = 10**12
    # The stop tries again, although there are no further measurements.
    assert [int(one.stem) for one in site.files] == [3, 2]


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_a_start_that_fails_within_an_entry_leaves_no_snapshot(
    site: Site, error: type[BaseException]
) -> None:
    """The next start used it, and processed the rest of that entry twice."""

    class Failing(Counted):
        def push(self, batch: Any, clock_s: float | None = None) -> EngineOutput:
            output = super().push(batch, clock_s)
            if self._sequence > 200:
                raise error
            return output

    site.limits = replace(LIMITS, push_rows_max=100)
    site.rules = replace(site.rules, rows=10**9)
    with site.service(snapshots=False) as service:
        for begin in range(0, 300, 100):
            submit(service, FRAME[begin : begin + 100])
        settled(service)
    site.engine = Failing
    with pytest.raises((PipelineError, KeyboardInterrupt)), site.service():
        pass
    assert site.files == []
    site.engine = Counted
    with site.service() as service:
        assert everything(service) == whole(site)


def test_a_service_that_could_not_restore_everything_takes_none(site: Site, log: list[str]) -> None:
    site.limits = replace(LIMITS, history_rows_max=200)
    site.fill()
    assert site.files == []
    assert any("history_rows_max is less than events_max" in line for line in log)
