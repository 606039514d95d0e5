"""A crash at every step of every transaction: what was answered is there, what follows is the same.

The disk is copied as a crash would leave it: before the commit, after the commit but before the
answer, and with the log cut anywhere within the last transaction.
"""

import shutil
import threading
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.errors import JournalError, PipelineError
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import Entry
from multiradar.storage.journal import Journal
from multiradar.storage.sqlite.journal_rows import Head
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.waiting import WAIT_TIMEOUT_S, join
from support.scenarios.live_scene import cut, recording, sensors

TABLE = sensors()


@dataclass(frozen=True)
class _Image:
    """A copy of the disk, and the keys that were answered before it was made."""

    path: Path
    answered: frozenset[str]


class _Watched(SqliteJournal):
    # Copies itself before and after each commit.
    def __init__(self, path: Path, images: Path, seed: int) -> None:
        super().__init__(path, "f")
        self._images = images
        self._random = np.random.default_rng(seed)
        self.answered: set[str] = set()
        self.taken: list[_Image] = []

    def append(self, entries: Sequence[Entry]) -> list[int]:
        wal = self._path.with_name(self._path.name + "-wal")
        before, tip = wal.stat().st_size, self._tip_path.read_bytes()
        answered = frozenset(self.answered)
        sequences = super().append(entries)
        self._copy(answered, None)
        if wal.stat().st_size > before:
            self._copy(answered, int(self._random.integers(before, wal.stat().st_size)), tip)
        return sequences

    def _insert(self, entries: Sequence[Entry]) -> Head:
        head = super()._insert(entries)
        self._copy(frozenset(self.answered), None)
        return head

    def _copy(self, answered: frozenset[str], cut_at: int | None, tip: bytes | None = None) -> None:
        folder = self._images / str(len(self.taken))
        folder.mkdir()
        for file in (self._path, self._log_path, self._tip_path):
            shutil.copy(file, folder / file.name)
        if tip is not None:
            (folder / self._tip_path.name).write_bytes(tip)
        if cut_at is not None:
            with (folder / (self._path.name + "-wal")).open("r+b") as stream:
                stream.truncate(cut_at)
        self.taken.append(_Image(folder / self._path.name, answered))


def _service(journal: Journal) -> Service:
    return Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
        # Ten transactions rather than one.
        limits=RuntimeLimits(commit_batches_max=3),
    )


def _play(service: Service, pieces: list[pl.DataFrame], answered: set[str]) -> dict[str, object]:
    service.start()
    futures: list[Future[Receipt]] = []
    for number, piece in enumerate(pieces):
        key = str(number)
        future = service.submit(piece, source="test", idempotency_key=key)
        future.add_done_callback(lambda _done, key=key: answered.add(key))  # type: ignore[misc]
        futures.append(future)
    futures.append(service.flush(source="test", idempotency_key="end"))
    for future in futures:
        future.result(WAIT_TIMEOUT_S)
    service.settled().result(WAIT_TIMEOUT_S)
    status = service.view.status()
    service.stop()
    return status


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.fault(21, 28)
def test_no_crash_loses_an_answered_message_or_changes_what_follows(
    tmp_path: Path, seed: int
) -> None:
    sizes = np.random.default_rng(seed).integers(1, 16, 30).tolist()
    pieces = cut(recording(250, seed=seed), sizes)
    (tmp_path / "images").mkdir()
    journal = _Watched(tmp_path / "journal.db", tmp_path / "images", seed)
    expected = _play(_service(journal), pieces, journal.answered)
    assert len(journal.taken) >= 24
    assert len({len(image.answered) for image in journal.taken}) >= 8
    for image in journal.taken:
        crashed = SqliteJournal(image.path, "f")
        held = {stored.entry.idempotency_key for stored in crashed.read(0)}
        assert image.answered <= held
        status = _play(_service(crashed), pieces, set())
        assert status["output_sha256"] == expected["output_sha256"]
        assert status["accepted"] == expected["accepted"]
        assert status["event_sequence"] == expected["event_sequence"]


@pytest.mark.fault(23)
def test_a_journal_that_is_damaged_stops_the_start_and_names_the_entry(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    pieces = cut(recording(300), [30] * 9)
    _play(_service(SqliteJournal(path, "f")), pieces, set())
    content = bytearray(path.read_bytes())
    place = content.index(b"41-10", len(content) // 2)
    content[place] ^= 4
    path.write_bytes(bytes(content))
    service = _service(SqliteJournal(path, "f"))
    with pytest.raises(JournalError, match=rf"{path}: entry \d+ of the journal is damaged"):
        service.start()
    # It let the journal go.
    SqliteJournal(path, "f").close()


def test_a_recovering_service_neither_answers_nor_accepts(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    _play(_service(SqliteJournal(path, "f")), [recording(300)], set())
    held, seen = threading.Event(), threading.Event()

    class _Slow(FakeEngine):
        def push(self, batch: MeasurementBatch, _clock_s: float | None = None) -> EngineOutput:
            seen.set()
            assert held.wait(WAIT_TIMEOUT_S)
            return super().push(batch)

    service = Service(
        open_journal=lambda: SqliteJournal(path, "f"),
        open_engine=_Slow,
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    starting = threading.Thread(target=service.start)
    starting.start()
    assert seen.wait(WAIT_TIMEOUT_S)
    assert str(service.state) == "recovering"
    with pytest.raises(PipelineError, match="the service is starting: replaying the journal"):
        service.submit(recording(1), source="test")
    with pytest.raises(PipelineError, match="the service is starting: replaying the journal"):
        service.settled()
    held.set()
    join(starting)
    assert str(service.state) == "running"
    service.stop()
