"""A history that cannot be opened is tried again, and the alarm says what to do."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
import pytest

from multiradar.errors import RemovedEntriesError
from multiradar.runtime.live.service import Service
from multiradar.runtime.recorded import history_writer
from multiradar.runtime.recorded.history import keep_history
from multiradar.runtime.recorded.history_files import STATE_FILE, HistoryFolder, history_tables
from multiradar.runtime.recorded.history_writer import HISTORY_STOPPED, HistoryRules
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.processes.live_services import TABLE, settled, submit
from support.processes.waiting import wait_until
from support.scenarios.live_scene import recording, sensors_file

FRAME = recording(600)


class ShortenedJournal(MemoryJournal):
    """Has lost its first entries, once that is said."""

    removed = 0

    def removed_until(self) -> int:
        return self.removed

    def digest(self, sequence: int) -> bytes:
        if 0 < sequence < self.removed:
            raise RemovedEntriesError("see the log, and restore the archive")
        return super().digest(sequence)


@contextmanager
def running(journal: MemoryJournal, folder: Path) -> Iterator[Service]:
    service = Service(
        open_journal=lambda: journal, open_engine=FakeEngine, sensors=TABLE,
        tracking=TrackingSettings(), described=sensors_file(),
    )  # fmt: skip
    keep_history(service, HistoryRules(folder), TrackingSettings())
    service.start()
    try:
        yield service
    finally:
        service.stop()


def test_a_history_that_cannot_be_opened_at_the_start_is_written_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(history_writer, "_RETRY_S", 0.05)
    folder = tmp_path / "disk" / "history"
    with running(MemoryJournal(), folder) as service:
        submit(service, FRAME[:300])
        assert HISTORY_STOPPED in settled(service)["alarms"]  # type: ignore[operator]
        folder.parent.mkdir()
        wait_until(lambda: service.view.status()["alarms"] == [], "the history")
        submit(service, FRAME[300:])
        settled(service)
    rows = pl.read_parquet(list(history_tables(folder)["tracks.parquet"]))
    assert len(rows) == 600


def test_a_history_that_another_service_still_writes_is_continued_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(history_writer, "_RETRY_S", 0.05)
    journal, folder = MemoryJournal(), tmp_path / "history"
    with running(journal, folder) as service:
        submit(service, FRAME[:300])
    held = HistoryFolder(folder, dict)
    with running(journal, folder) as service:
        submit(service, FRAME[300:])
        status = settled(service)
        assert HISTORY_STOPPED in status["alarms"]  # type: ignore[operator]
        # Also at each takeover, until the primary has written its last rows.
        assert "another service is still writing it; this service tries again" in str(
            status["warnings"]
        )
        held.close()
        wait_until(lambda: service.view.status()["alarms"] == [], "the history")
    rows = pl.read_parquet(list(history_tables(folder)["tracks.parquet"]))
    assert len(rows) == 600


def test_a_history_with_epochs_by_name_is_continued(tmp_path: Path) -> None:
    journal, folder = MemoryJournal(), tmp_path / "history"
    with running(journal, folder) as service:
        submit(service, FRAME[:300])
    state = json.loads((folder / STATE_FILE).read_bytes())
    for name in (None, [1, 4.0]):
        state["positions"]["health.parquet"] = name
        (folder / STATE_FILE).write_text(json.dumps(state))
        with running(journal, folder) as service:
            assert settled(service)["alarms"] == []
    with running(journal, folder) as service:
        submit(service, FRAME[300:])
        assert settled(service)["alarms"] == []
    rows = pl.read_parquet(list(history_tables(folder)["tracks.parquet"]))
    assert len(rows) == 600


def test_a_history_before_a_shortened_journal_needs_a_new_folder(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The advice was to restore the archive, and that the folder could not be written."""
    journal, folder = ShortenedJournal(), tmp_path / "history"
    with running(journal, folder) as service:
        submit(service, FRAME[:100])
    for begin in range(100, 600, 100):
        with running(journal, tmp_path / "other") as service:
            submit(service, FRAME[begin : begin + 100])
    journal.removed = 4
    with running(journal, folder) as service:
        warnings = settled(service)["warnings"]
    assert "choose a new folder" in str(warnings)
    assert "the journal now starts with entry 5; choose a new folder" in caplog.text
    assert "restore the archive" not in caplog.text
