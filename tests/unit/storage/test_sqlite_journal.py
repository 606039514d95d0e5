"""The journal on disk: durable, verified, used by one service at a time."""

import errno
import os
import shutil
import sqlite3
import sys
from contextlib import closing, nullcontext
from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, JournalError, JournalFullError
from multiradar.storage.sqlite import opening, sqlite_journal
from multiradar.storage.sqlite.sqlite_file import journal_errors, write_again
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry
from support.processes.waiting import run_to_end

FINGERPRINT = "a" * 64


def _written(path: Path, entries: int = 20) -> None:
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(number, rejects=number % 3) for number in range(entries)])
    journal.close()


def _read_everything(path: Path) -> list[object]:
    journal = SqliteJournal(path, FINGERPRINT)
    try:
        counts = journal.counts()
        return [*journal.read(0), *journal.quarantined(0, 1000), counts, journal.skipped()]
    finally:
        journal.close()


def _tamper(path: Path, statement: str) -> None:
    connection = sqlite3.connect(path)
    with connection:
        connection.execute(statement)
    connection.close()


def test_a_journal_survives_closing(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "journal.db"
    _written(path)
    journal = SqliteJournal(path, FINGERPRINT)
    assert journal.append([entry(99)]) == [21]
    assert len(list(journal.read(0))) == 21
    journal.close()


def test_a_second_service_must_use_another_journal(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    first = SqliteJournal(path, FINGERPRINT)
    with pytest.raises(JournalError, match=r"journal\.db: another service is using this journal"):
        SqliteJournal(path, FINGERPRINT)
    first.append([entry(1)])
    first.close()
    SqliteJournal(path, FINGERPRINT).close()


@pytest.mark.fault(30)
def test_another_configuration_is_rejected_and_says_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    _written(path)
    with pytest.raises(ConfigurationError, match=r"other sensors or .*multiradar migrate"):
        SqliteJournal(path, "b" * 64)
    assert len(_read_everything(path)) > 20


def test_the_setting_that_differs_is_named_where_it_is_known(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    _written(path)
    SqliteJournal(path, FINGERPRINT, "ci").close()

    def differences(before: str, now: str) -> str:
        return f"--filter {before}, now {now}" if before else ""

    with pytest.raises(
        ConfigurationError, match=r"created with --filter ci, now imm; use the original"
    ):
        SqliteJournal(path, "b" * 64, "imm", differences)


@pytest.mark.parametrize(
    ("name", "what"),
    [("measurements.parquet", "output of `convert`"), ("tracks.parquet", "output of `track`")],
)
def test_the_output_of_another_command_is_no_place_for_a_journal(
    tmp_path: Path, name: str, what: str
) -> None:
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(JournalError, match=f"expected a folder with a journal, was the {what}"):
        SqliteJournal(tmp_path / "journal.sqlite", FINGERPRINT)
    assert [one.name for one in tmp_path.iterdir()] == [name]


def test_a_journal_stays_usable_whatever_lies_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    _written(path)
    SqliteJournal(tmp_path / "second.sqlite", FINGERPRINT).close()
    (tmp_path / "measurements.parquet").write_bytes(b"")
    SqliteJournal(path, FINGERPRINT).close()


@pytest.mark.fault(30)
def test_another_format_is_rejected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "journal.db"
    with monkeypatch.context() as patch:
        patch.setattr(sqlite_journal, "FORMAT_VERSION", 4)
        _written(path)
    path.with_name("journal.db-tip").unlink()
    with pytest.raises(ConfigurationError, match="expected a journal of format 2, was 4"):
        SqliteJournal(path, FINGERPRINT)


@pytest.mark.parametrize("content", [b"not a database, but long enough to be looked at" * 50, b"x"])
def test_a_file_that_is_not_a_journal_is_rejected(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "journal.db"
    path.write_bytes(content)
    with pytest.raises(JournalError, match=r"journal\.db"):
        SqliteJournal(path, FINGERPRINT)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(JournalError, match="file"):
        SqliteJournal(tmp_path / "file" / "journal.db", FINGERPRINT)


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("DELETE FROM entry WHERE sequence = 7", "entry 7 "),
        ("DELETE FROM entry WHERE sequence > 15", "entry (16|20) "),
        ("UPDATE entry SET payload = x'00' WHERE sequence = 9", "entry 9 "),
        ("UPDATE entry SET payload = NULL || 'text' WHERE sequence = 9", "NOT NULL"),
        ("UPDATE entry SET payload = 'text' WHERE sequence = 9", "entry 9 "),
        ("UPDATE entry SET source = 'else' WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET kind = 'flush' WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET accepted = accepted + 1 WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET rejects = '[]' WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET admission = '' WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET idempotency_key = NULL WHERE sequence = 3", "entry 3 "),
        ("UPDATE entry SET sequence = 21 WHERE sequence = 20", "entry 20 "),
        ("UPDATE head SET sequence = 19", "entry 20 "),
        ("UPDATE head SET digest = x'00'", "entry 20 "),
        ("UPDATE head SET digest = 1", "head"),
        ("DELETE FROM head", "head"),
        ("DELETE FROM header", "header"),
        ("UPDATE quarantine SET first = 9 WHERE first = 10", "rejected rows"),
        ("UPDATE quarantine SET sequence = 4 WHERE first = 4", "rejected rows"),
        ("DELETE FROM quarantine WHERE first = 1", "rejected row"),
        ("DELETE FROM quarantine WHERE first > 15", "rejected row"),
        ("INSERT INTO skipped VALUES (3, 'reason', x'00')", "entry 3 "),
    ],
)
def test_tampering_is_reported_by_file_and_entry(tmp_path: Path, statement: str, said: str) -> None:
    path = tmp_path / "journal.db"
    _written(path)
    if "NULL ||" in statement:
        with pytest.raises(sqlite3.IntegrityError, match=said):
            _tamper(path, statement)
        return
    _tamper(path, statement)
    with pytest.raises(JournalError, match=rf"journal\.db: .*{said}"):
        _read_everything(path)


def test_an_entry_is_verified_when_it_is_found_by_its_key(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    _written(path)
    _tamper(path, "UPDATE entry SET payload = x'00' WHERE sequence = 9")
    journal = SqliteJournal(path, FINGERPRINT)
    assert journal.find("key 7") is not None
    with pytest.raises(JournalError, match="entry 9 "):
        journal.find("key 8")
    journal.close()


@pytest.mark.slow
def test_each_byte_of_one_payload_is_covered(tmp_path: Path) -> None:
    path, damaged = tmp_path / "journal.db", tmp_path / "damaged.db"
    _written(path)
    shutil.copy(tmp_path / "journal.db-tip", tmp_path / "damaged.db-tip")
    intact = path.read_bytes()
    payload = entry(8).payload
    start = intact.index(payload)
    for place in range(start, start + len(payload)):
        flipped = bytearray(intact)
        flipped[place] ^= 1
        damaged.write_bytes(bytes(flipped))
        with pytest.raises(JournalError, match="entry 9 of the journal is damaged"):
            _read_everything(damaged)


def test_an_incomplete_tail_is_truncated_and_acknowledged_entries_stay(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    journal = SqliteJournal(path, FINGERPRINT)
    wal = path.with_name(path.name + "-wal")
    journal.append([entry(number) for number in range(3)])
    acknowledged = wal.stat().st_size
    tip = (tmp_path / "journal.db-tip").read_bytes()
    journal.append([entry(number) for number in range(3, 6)])
    content = wal.read_bytes()
    random = np.random.default_rng(3)
    seen = set()
    for cut in [
        acknowledged,
        *random.integers(acknowledged, len(content), 40).tolist(),
        len(content),
    ]:
        crash = tmp_path / f"crash-{cut}"
        crash.mkdir(exist_ok=True)
        shutil.copy(path, crash / "journal.db")
        incomplete = bytearray(content[:cut])
        if cut % 2:
            # A sector that was never written.
            incomplete[cut - (cut - acknowledged) // 2 : cut] = bytes((cut - acknowledged) // 2)
        (crash / "journal.db-wal").write_bytes(bytes(incomplete))
        (crash / "journal.db-tip").write_bytes(tip)
        after = SqliteJournal(crash / "journal.db", FINGERPRINT)
        sequences = [stored.sequence for stored in after.read(0)]
        after.close()
        assert sequences in ([1, 2, 3], [1, 2, 3, 4, 5, 6])
        seen.add(len(sequences))
    assert seen == {3, 6}
    journal.close()


@pytest.mark.fault(24)
def test_a_full_disk_is_reported_and_the_journal_continues_when_space_is_free(
    tmp_path: Path,
) -> None:
    journal = SqliteJournal(tmp_path / "journal.db", FINGERPRINT)
    journal.append([entry(1)])
    pages = journal._writer.execute("PRAGMA page_count").fetchone()[0]
    journal._writer.execute(f"PRAGMA max_page_count={pages}")
    with pytest.raises(JournalFullError, match="disk full"):
        journal.append([entry(2), entry(3, size=100_000)])
    assert journal.counts().entries == 1
    journal._writer.execute("PRAGMA max_page_count=1000000")
    assert journal.append([entry(2)]) == [2]
    assert [stored.sequence for stored in journal.read(0)] == [1, 2]
    journal.close()


_FAILING_DISK = """
import resource, sys
from pathlib import Path
from multiradar.errors import JournalError
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry

journal = SqliteJournal(Path(sys.argv[1]), "a" * 64)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
acknowledged = 0
for number in range(1000):
    try:
        acknowledged = journal.append([entry(number, size=5000)])[-1]
    except JournalError as error:
        print("failed", error)
        break
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
try:
    journal.append([entry(2000)])
except JournalError:
    print("rejected")
print(len(list(journal.read(0))))
print(acknowledged)
"""


def test_a_failed_write_stops_the_journal_for_good_and_keeps_what_was_acknowledged(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.db"
    line = [sys.executable, "-c", _FAILING_DISK, str(path), "150000"]
    done = run_to_end(line, env={"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    failed, rejected, readable, acknowledged = done.stdout.splitlines()
    assert failed.startswith(f"failed {path}")
    assert rejected == "rejected"
    assert int(acknowledged) >= 3
    assert int(readable) == int(acknowledged)
    journal = SqliteJournal(path, FINGERPRINT)
    stored = [one.entry for one in journal.read(0)]
    journal.close()
    assert stored[: int(acknowledged)] == [
        entry(number, size=5000) for number in range(int(acknowledged))
    ]


_FAILING_SYNC = """
import sys
from pathlib import Path
from multiradar.errors import JournalError
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry

journal = SqliteJournal(Path(sys.argv[1]), "a" * 64)
acknowledged = 0
for number in range(20):
    try:
        acknowledged = journal.append([entry(number)])[-1]
    except JournalError as error:
        print("failed", error)
try:
    journal.append([entry(2000)])
except JournalError as error:
    print("rejected", error)
print(acknowledged)
"""


def _can_trace() -> bool:
    tracer = shutil.which("strace")
    return (
        tracer is not None and not run_to_end([tracer, "-qq", "-o", "/dev/null", "true"]).returncode
    )


@pytest.mark.slow
@pytest.mark.skipif(not _can_trace(), reason="needs strace, and leave to trace")
@pytest.mark.parametrize("call", [12, 16, 20])
@pytest.mark.fault(25)
def test_one_failed_sync_is_never_trusted_again(tmp_path: Path, call: int) -> None:
    """After it the next sync succeeds, although data was lost: it must not be asked."""
    path = tmp_path / "journal.db"
    inject = f"inject=fdatasync,fsync:error=EIO:when={call}"
    line = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", inject]
    line += [sys.executable, "-c", _FAILING_SYNC, str(path)]
    done = run_to_end(line, env={"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    *failed, rejected, acknowledged = done.stdout.splitlines()
    assert len(failed) == 20 - int(acknowledged) > 0
    assert "SQLITE_IOERR_FSYNC" in rejected
    journal = SqliteJournal(path, FINGERPRINT)
    stored = [one.entry for one in journal.read(0)]
    journal.close()
    # What was not acknowledged may be on disk all the same, but nothing after it.
    assert len(stored) - int(acknowledged) in (0, 1)
    assert stored == [entry(number) for number in range(len(stored))]


_RESTART_AFTER_FAILED_SYNC = """
import random
import sys
from contextlib import suppress
from pathlib import Path
from multiradar.errors import JournalError
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry
from support.simulation.disk import VirtualDisk

def opened(folder):
    return SqliteJournal(folder / "journal.db", "a" * 64)

folder, later = Path(sys.argv[1]), Path(sys.argv[2])
disk = VirtualDisk(folder, random.Random(1), {})
journal = opened(folder)
journal.append([entry(0)])
disk.failing_syncs = 1
with suppress(JournalError):
    journal.append([entry(1)])
# A kill: nothing that is closed reaches the disk.
disk.dead = True
journal.close()
disk.dead = False
journal = opened(folder)
assert journal.find("key 1") is not None
journal.append([entry(2)])
for name, content in disk.image(power_lost=True).items():
    (later / name).write_bytes(content)
left = opened(later)
print([one.entry == entry(number) for number, one in enumerate(left.read(0))])
left.close()
journal.close()
"""


@pytest.mark.fault(25)
def test_an_entry_of_a_failed_sync_that_a_restart_finds_survives_a_power_failure(
    tmp_path: Path,
) -> None:
    """The next process reads it from the memory of the system: if sent again, it is known."""
    folders = [tmp_path / "state", tmp_path / "later"]
    for folder in folders:
        folder.mkdir()
    line = [sys.executable, "-c", _RESTART_AFTER_FAILED_SYNC, *map(str, folders)]
    done = run_to_end(line, env={"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[True, True, True]\n"


@pytest.mark.parametrize(("code", "is_known"), [(errno.ENOSPC, True), (errno.EIO, False)])
def test_a_file_that_a_full_disk_cannot_write_again_is_synced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, is_known: bool
) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"content")
    synced: list[int] = []

    def failing(*_: object) -> int:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(os, "pwrite", failing)
    monkeypatch.setattr(os, "fsync", synced.append)
    with nullcontext() if is_known else pytest.raises(OSError, match="Input/output error"):
        write_again(path)
    assert bool(synced) is is_known


def test_a_closed_journal_is_one_file_without_open_handles(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(1)])
    assert len(list(journal.read(0))) == 1
    journal.close()
    assert {one.name for one in tmp_path.iterdir()} <= {"journal.db", "journal.db-tip"}
    if os.path.isdir("/proc/self/fd"):
        held = {os.path.realpath(one) for one in Path("/proc/self/fd").iterdir()}
        assert not {one for one in held if one.startswith(str(path))}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("SQLITE_IOERR_SHMSIZE", r"disk full \(SQLITE_IOERR_SHMSIZE\); free some space"),
        ("SQLITE_IOERR_READ", r"disk I/O error \(SQLITE_IOERR_READ\)"),
    ],
)
def test_no_room_for_the_index_of_the_log_is_a_full_disk(name: str, words: str) -> None:
    error = sqlite3.OperationalError("disk I/O error")
    error.sqlite_errorname = name
    with pytest.raises(JournalError, match=words), journal_errors(Path("journal.sqlite")):
        raise error


def test_a_journal_whose_creation_a_power_failure_interrupted_is_created_again(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal"
    SqliteJournal(path, FINGERPRINT).close()
    # The file was enlarged, its first page not written; its rollback journal was synced before:
    # magic, no pages, nonce, 0 pages to restore, sectors of 512 octets, pages of 4096.
    path.write_bytes(bytes(4096))
    numbers = b"".join(number.to_bytes(4, "big") for number in (0, 1, 0, 512, 4096))
    header = bytes.fromhex("d9d505f920a163d7") + numbers
    (tmp_path / "journal-journal").write_bytes(header.ljust(512, b"\0"))
    journal = SqliteJournal(path, FINGERPRINT)
    assert journal.append([entry(1)]) == [1]
    journal.close()


def test_the_pages_of_a_large_file_with_free_ones_are_verified_when_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal.sqlite"
    SqliteJournal(path, "f").close()
    verified: list[Path] = []
    monkeypatch.setattr(opening, "check_pages", lambda _, checked: verified.append(checked))
    monkeypatch.setattr(sqlite_journal, "check_pages", lambda _, checked: verified.append(checked))
    monkeypatch.setattr(opening, "_AT_ONCE_BYTES", 0)
    with closing(SqliteJournal(path, "f")) as journal:
        assert not verified
        for _ in range(2):
            journal.verify_pages()
        assert verified == [path]
        # Nothing is being verified.
        journal.stop_verifying()
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript("CREATE TABLE other (value); DROP TABLE other;")
    verified.clear()
    with closing(SqliteJournal(path, "f")) as journal:
        journal.verify_pages()
        assert verified == [path]
