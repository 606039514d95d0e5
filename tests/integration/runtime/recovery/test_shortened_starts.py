"""The real service on a shortened journal: the bytes of the whole one, and a specific error."""

import shutil
import sqlite3
import threading
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from integration.runtime.recovery.test_snapshot_starts import (
    FINGERPRINT,
    FRAME,
    TABLE,
    TRACKING,
    _known,
)
from multiradar.clock import FixedClock
from multiradar.errors import IdempotencyConflictError, RemovedEntriesError
from multiradar.runtime.admission.admission_by_time import data_clock_of
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.processor import Processor
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules, usable_snapshots
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.archive import archive_journal, restore_archive
from multiradar.storage.backup import copy_backup, write_backup
from multiradar.storage.entries import StoredEntry
from multiradar.storage.retention import Retained, Rules, Shortened, shorten
from multiradar.storage.snapshots import Position, SnapshotFolder
from multiradar.storage.sqlite.reading import journal_entries
from multiradar.storage.sqlite.shortening import digests_of, marks_of
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import verify_journal
from multiradar.tracking.forecast.state_samples import Sampling
from support.processes.waiting import WAIT_TIMEOUT_S, join, wait_until
from support.scenarios.live_scene import cut

PIECES = [*cut(FRAME, [100] * 15)]
KINDS = {"engine": Engine, "processor": Processor, "publication": Publication}


def _service(journal: Path, *, snapshots: bool = True) -> Service:
    """Return a service that takes snapshots when it is stopped only."""
    rules = SnapshotRules(SnapshotFolder(journal), 1e9, 10**9, FINGERPRINT)
    return Service(
        open_journal=lambda: SqliteJournal(journal, FINGERPRINT),
        open_engine=lambda: Engine(TABLE, TRACKING, sampling=Sampling.ALL),
        sensors=TABLE,
        tracking=TRACKING,
        snapshots=rules if snapshots else None,
    )


def _feed(service: Service, first: int, end: int) -> None:
    for number in range(first, end):
        sent = service.submit(PIECES[number], source="test", idempotency_key=f"piece {number}")
        sent.result(WAIT_TIMEOUT_S)


def _usable(journal: Path, limits: RuntimeLimits | None = None) -> list[Position]:
    rules = SnapshotRules(SnapshotFolder(journal), 1e9, 1, FINGERPRINT)
    return usable_snapshots(
        rules, limits or RuntimeLimits(), KINDS, marks_of(journal),
        lambda numbers: digests_of(journal, numbers),
    )  # fmt: skip


def _shorten(journal: Path, archive: Path) -> Shortened:
    archive_journal(journal, archive, segment_octets=1)
    return shorten(
        journal, archive, Rules(octets=1), snapshots=_usable(journal), time_of=data_clock_of,
        now_s=1e12,
    )  # fmt: skip


@pytest.fixture(name="journal")
def _journal(tmp_path: Path) -> Path:
    """A journal of 12 messages; a clean stop after 5, 8 and 12 of them, each with a snapshot."""
    journal = tmp_path / "state" / "journal.sqlite"
    for first, end in ((0, 5), (5, 8), (8, 12)):
        service = _service(journal)
        service.start()
        _feed(service, first, end)
        service.stop()
    return journal


def _output(journal: Path, *, snapshots: bool = True, more: bool = True) -> dict[str, Any]:
    service = _service(journal, snapshots=snapshots)
    service.start()
    try:
        if more:
            _feed(service, 12, 15)
            service.flush(source="test").result(WAIT_TIMEOUT_S)
        known = _known(service)
        # Delays are those of the machine.
        known["events"] = [one.key for one in known["events"]]
        return known
    finally:
        service.stop()


def test_a_start_gives_the_same_bytes_as_before_the_journal_was_shortened(
    journal: Path, tmp_path: Path
) -> None:
    whole = tmp_path / "whole" / "journal.sqlite"
    shutil.copytree(journal.parent, whole.parent)
    found = _shorten(journal, tmp_path / "archive")
    assert (found.removed, found.first) == (8, 9)
    assert verify_journal(journal).damage == ()
    assert verify_journal(journal).digest == verify_journal(whole).digest
    out, restored = tmp_path / "backup", tmp_path / "restored"
    for folder in (out, restored):
        folder.mkdir()
    write_backup(journal, out, {}, time_s=0.0, version="0")
    copy_backup(out, restored)
    expected = _output(whole, snapshots=False)
    assert _output(journal) == expected
    assert _output(restored / "journal.sqlite") == expected
    # The next start, with the newer of the snapshots damaged.
    newest, before = SnapshotFolder(journal).files()
    assert before.name == "000000000012.snapshot"
    newest.write_bytes(newest.read_bytes()[:-1])
    assert _output(journal, more=False) == expected


# Of the database the entries: its header has the number of the opening.
def _content(journal: Path) -> tuple[list[StoredEntry], dict[Path, bytes]]:
    files = {path: path.read_bytes() for path in journal.parent.rglob("*") if path.is_file()}
    del files[journal]
    with journal_entries(journal) as (_, _, entries):
        return list(entries), files


def test_a_message_that_was_removed_is_still_a_duplicate(journal: Path, tmp_path: Path) -> None:
    _shorten(journal, tmp_path / "archive")
    service = _service(journal)
    service.start()
    sent = service.submit(PIECES[2], source="test", idempotency_key="piece 2")
    receipt = sent.result(WAIT_TIMEOUT_S)
    assert (receipt.duplicate, receipt.journal_sequence) == (True, 3)
    assert receipt.accepted + len(receipt.rejected) == len(PIECES[2])
    other = service.submit(PIECES[2][:7], source="test", idempotency_key="piece 2")
    with pytest.raises(IdempotencyConflictError, match="was already used for a different message"):
        other.result(WAIT_TIMEOUT_S)
    assert service.view.status()["journal_sequence"] == 12
    service.stop()


def test_without_a_usable_snapshot_a_start_says_that_the_journal_was_shortened(
    journal: Path, tmp_path: Path
) -> None:
    archive, whole = tmp_path / "archive", tmp_path / "whole" / "journal.sqlite"
    shutil.copytree(journal.parent, whole.parent)
    _shorten(journal, archive)
    for snapshot in SnapshotFolder(journal).files():
        snapshot.write_bytes(snapshot.read_bytes()[:-1])
    state = _content(journal)
    service = _service(journal)
    with pytest.raises(RemovedEntriesError, match="entries up to 8 are only in the archive"):
        service.start()
    assert _usable(journal) == []
    assert _content(journal) == state
    # The way out: the rest is sealed, and the archive has the whole journal.
    archive_journal(journal, archive)
    again = tmp_path / "again" / "journal.sqlite"
    restore_archive(archive, again)
    assert _output(again) == _output(whole)


def test_snapshots_of_other_limits_do_not_count(journal: Path) -> None:
    assert [one.sequence for one in _usable(journal)] == [12, 8]
    assert _usable(journal, RuntimeLimits(events_max=1000)) == []


def test_damage_after_the_removed_entries_stops_the_service_and_keeps_the_snapshots(
    journal: Path, tmp_path: Path
) -> None:
    _shorten(journal, tmp_path / "archive")
    with closing(sqlite3.connect(journal)) as connection, connection:
        connection.execute("UPDATE entry SET source = 'x' WHERE sequence = 10")
    service = _service(journal)
    service.start()
    wait_until(lambda: service.failure is not None, "the damage is found")
    assert "entry 10 of the journal is damaged" in str(service.failure)
    service.stop()
    assert len(SnapshotFolder(journal).files()) == 2


def test_the_status_shows_what_is_retained(journal: Path, tmp_path: Path) -> None:
    clock = FixedClock()
    retained = Retained(journal, tmp_path / "archive", data_clock_of, clock)
    before = retained.document()
    first_s = before.pop("first_time_s")
    assert before.pop("used_bytes") > 10_000
    assert before == {"first_entry": 1, "snapshots": [12, 8], "archive": None}
    _shorten(journal, tmp_path / "archive")
    assert retained.document()["first_entry"] == 1
    clock.advance(10.0)
    after = retained.document()
    assert (after["first_entry"], after["snapshots"]) == (9, [12, 8])
    assert after["first_time_s"] > first_s
    sealed = after["archive"]
    assert (sealed["first_entry"], sealed["last_entry"], sealed["segments"]) == (1, 12, 12)
    nothing = Retained(tmp_path / "none", None, data_clock_of, clock).document()
    assert (nothing["first_entry"], nothing["snapshots"], nothing["archive"]) == (None, [], None)


def test_a_running_service_is_shortened_while_measurements_arrive(
    journal: Path, tmp_path: Path
) -> None:
    whole = tmp_path / "whole" / "journal.sqlite"
    shutil.copytree(journal.parent, whole.parent)
    service = _service(journal)
    service.start()
    found: list[Shortened] = []
    removing = threading.Thread(
        target=lambda: found.append(_shorten(journal, tmp_path / "archive"))
    )
    removing.start()
    _feed(service, 12, 15)
    join(removing)
    service.flush(source="test").result(WAIT_TIMEOUT_S)
    known = _known(service)
    known["events"] = [one.key for one in known["events"]]
    service.stop()
    assert found[0].first == 9
    assert known == _output(whole)
    assert verify_journal(journal).damage == ()
