"""No damage to the files of a journal loses acknowledged entries silently.

Each damage is either reported, and the files stay as they are, or has no effect: the content is
complete, and the journal goes on.
"""

import itertools
import os
import shutil
import sqlite3
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, JournalError
from multiradar.storage.archive import archive_journal
from multiradar.storage.segments import segments_of
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite.shortening import digests_of, remove_until
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.sqlite.tip import Tip
from multiradar.storage.sqlite.write_ahead_log import log_damage
from support.inputs.journal_entries import entry

FINGERPRINT = "a" * 64
FILES = ("journal.db", "journal.db-wal", "journal.db-tip")
ENTRIES = 30
#: Flipped bits of a file; `TEST_FLIPS=5000` for the long run.
FLIPS = int(os.environ.get("TEST_FLIPS", "60"))
_FRAME = 24 + 4096


def _open(folder: Path) -> SqliteJournal:
    return SqliteJournal(folder / "journal.db", FINGERPRINT)


def _copy(folder: Path, to: Path) -> Path:
    to.mkdir()
    for file in folder.glob("journal.db*"):
        if not file.name.endswith("-shm"):
            shutil.copy(file, to / file.name)
    return to


@pytest.fixture(name="killed", scope="module")
def _killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    # All entries are in the log, as after a kill.
    folder = tmp_path_factory.mktemp("running")
    journal = _open(folder)
    for number in range(ENTRIES):
        journal.append([entry(number, rejects=number % 3, size=900)])
    killed = _copy(folder, tmp_path_factory.mktemp("killed") / "copy")
    journal.close()
    return killed


@pytest.fixture(name="stopped", scope="module")
def _stopped(killed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    # All entries are in the database, as after a stop.
    folder = _copy(killed, tmp_path_factory.mktemp("stopped") / "copy")
    _open(folder).close()
    assert not (folder / "journal.db-wal").exists()
    return folder


def _content(folder: Path) -> list[object]:
    journal = _open(folder)
    try:
        found = [journal.find(f"key {number}") for number in range(ENTRIES)]
        rejected = journal.quarantined(0, 1000)
        return [*journal.read(0), journal.counts(), *rejected, journal.skipped(), *found]
    finally:
        journal.close()


def _bytes(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in FILES if (folder / name).exists()}


# Whether damage to one file is reported; else it must have no effect.
def _reported(folder: Path, work: Path, file: str, content: bytes, expected: object) -> bool:
    shutil.rmtree(work, ignore_errors=True)
    _copy(folder, work)
    (work / file).write_bytes(content)
    before = _bytes(work)
    try:
        found = _content(work)
    except (JournalError, ConfigurationError) as error:
        said = str(error)
        assert "journal.db" in said
        # Found before SQLite trims the log, or in content that it does not change.
        if "-wal" in said or "acknowledged" in said:
            assert _bytes(work) == before | {"journal.db-wal": before.get("journal.db-wal", b"")}
        return True
    assert found == expected
    journal = _open(work)
    assert journal.append([entry(ENTRIES)]) == [ENTRIES + 1]
    journal.close()
    assert _content(work)[:ENTRIES] == list(expected)[:ENTRIES]
    return False


def _flipped(content: bytes, bit: int) -> bytes:
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def _bits(content: bytes, count: int, seed: int) -> list[int]:
    drawn = np.random.default_rng(seed).integers(0, len(content) * 8, count).tolist()
    return sorted(set(drawn))


@pytest.mark.fault(23)
def test_every_flipped_bit_of_the_log_is_reported(killed: Path, tmp_path: Path) -> None:
    content = (killed / "journal.db-wal").read_bytes()
    expected = _content(_copy(killed, tmp_path / "intact"))
    headers = [place * 8 for place in range(0, 32, 2)]
    frames = [(32 + place * _FRAME + byte) * 8 + 1 for place in (0, 40) for byte in range(0, 24, 3)]
    ends = [len(content) * 8 - 1, (len(content) - _FRAME) * 8 + 4]
    for bit in [*headers, *frames, *ends, *_bits(content, FLIPS, seed=5)]:
        damaged = _flipped(content, bit)
        assert _reported(killed, tmp_path / "work", "journal.db-wal", damaged, expected), bit


@pytest.mark.slow
@pytest.mark.parametrize("state", ["killed", "stopped"])
@pytest.mark.fault(23)
def test_no_flipped_bit_of_the_database_loses_entries(
    state: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    folder: Path = request.getfixturevalue(state)
    content = (folder / "journal.db").read_bytes()
    expected = _content(_copy(folder, tmp_path / "intact"))
    header = [place * 8 + place % 8 for place in range(0, 100, 100 // min(FLIPS, 100))]
    reported = [
        _reported(folder, tmp_path / "work", "journal.db", _flipped(content, bit), expected)
        for bit in [*header, *_bits(content, FLIPS, seed=6)]
    ]
    # Of what is not reported nothing is content: free space, counters of SQLite. After a kill the
    # log has all pages.
    assert any(reported) or state == "killed"


@pytest.mark.fault(23)
def test_every_truncation_is_reported(killed: Path, stopped: Path, tmp_path: Path) -> None:
    work = tmp_path / "work"
    log = (killed / "journal.db-wal").read_bytes()
    for cut in [0, 1, 31, 32, *range(32 + _FRAME, len(log), _FRAME * 19)]:
        for size in (cut, cut + 24):
            assert _reported(killed, work, "journal.db-wal", log[:size], []), size
    assert _reported(killed, work, "journal.db-wal", log[:-1], [])
    database = (stopped / "journal.db").read_bytes()
    for size in [0, 1, 50, 99, *range(4096, len(database), 4096), len(database) - 1]:
        assert _reported(stopped, work, "journal.db", database[:size], []), size
    tip = (stopped / "journal.db-tip").read_bytes()
    for size in range(0, len(tip), 9):
        assert _reported(stopped, work, "journal.db-tip", tip[:size], []), size


def test_a_truncated_database_is_reported_unless_the_log_has_all_of_it(
    killed: Path, tmp_path: Path
) -> None:
    expected = _content(_copy(killed, tmp_path / "intact"))
    database = (killed / "journal.db").read_bytes()
    reported = [
        _reported(killed, tmp_path / "work", "journal.db", database[:size], expected)
        for size in (0, 1, 50, 99, 4000)
    ]
    assert reported[0]


def test_every_flipped_bit_of_the_tip_is_reported(stopped: Path, tmp_path: Path) -> None:
    tip = (stopped / "journal.db-tip").read_bytes()
    for bit in range(0, len(tip) * 8, 29):
        assert _reported(stopped, tmp_path / "work", "journal.db-tip", _flipped(tip, bit), []), bit


def test_damage_to_the_log_is_named_by_frame_and_byte(killed: Path, tmp_path: Path) -> None:
    folder = _copy(killed, tmp_path / "copy")
    content = (folder / "journal.db-wal").read_bytes()
    (folder / "journal.db-wal").write_bytes(_flipped(content, (32 + 12 * _FRAME + 500) * 8))
    place = f"frame 13 \\(byte {32 + 12 * _FRAME}\\) is invalid"
    with pytest.raises(JournalError, match=rf"journal\.db-wal is damaged: {place}"):
        _open(folder)


@pytest.mark.parametrize("harm", ["log", "tip"])
def test_commands_change_nothing_of_a_stopped_journal_that_lacks_entries(
    killed: Path, tmp_path: Path, harm: str
) -> None:
    """`shorten` removed the log with the sound frames behind the damage; `archive` succeeded."""
    folder = _copy(killed, tmp_path / "copy")
    path = folder / "journal.db"
    until = Position(5, digests_of(path, [5])[5])
    content = (folder / "journal.db-wal").read_bytes()
    if harm == "log":
        (folder / "journal.db-wal").write_bytes(_flipped(content, (32 + 40 * _FRAME + 500) * 8))
    else:
        (folder / "journal.db-tip").write_bytes(Tip(ENTRIES + 1, bytes(32)).line())
    before = {name: (folder / name).read_bytes() for name in FILES}
    said = "frame 41 .* is invalid" if harm == "log" else "31 were acknowledged"
    with pytest.raises(JournalError, match=said):
        remove_until(path, until)
    with pytest.raises(JournalError, match=r"3. entries were acknowledged, but it contains only"):
        archive_journal(path, tmp_path / "archive")
    assert {name: (folder / name).read_bytes() for name in FILES} == before
    assert segments_of(tmp_path / "archive") == []
    # What the operator accepts is lost.
    (folder / "journal.db-tip").write_text("accept")
    assert archive_journal(path, tmp_path / "archive")
    remove_until(path, until)


def test_a_rolled_back_transaction_is_not_damage(tmp_path: Path) -> None:
    """A full disk leaves frames of it behind the frames that overwrote its begin."""
    path = tmp_path / "any.db"
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA cache_size=10")
    connection.execute("CREATE TABLE any (content BLOB)")
    connection.execute("BEGIN")
    for _ in range(200):
        connection.execute("INSERT INTO any VALUES (randomblob(4000))")
    connection.execute("ROLLBACK")
    log = path.with_name("any.db-wal")
    assert log.stat().st_size > 100 * _FRAME
    for _ in range(4):
        connection.execute("INSERT INTO any VALUES ('small')")
        assert log_damage(log) is None
    content = log.read_bytes()
    log.write_bytes(_flipped(content, (32 + 2 * _FRAME + 99) * 8))
    assert log_damage(log) is not None
    connection.close()


def test_entries_beyond_the_tip_are_kept(killed: Path, tmp_path: Path) -> None:
    """They were on disk when the process was killed before it acknowledged them."""
    expected = _content(_copy(killed, tmp_path / "intact"))
    folder = _copy(killed, tmp_path / "copy")
    digest = next(one.digest for one in expected if getattr(one, "sequence", 0) == 20)  # type: ignore[attr-defined]
    (folder / "journal.db-tip").write_bytes(Tip(20, digest).line())
    assert _content(folder) == expected
    tip = Tip.read(folder / "journal.db-tip")
    assert tip is not None
    assert tip.sequence == ENTRIES


def test_copies_that_are_incomplete_say_what_is_missing(killed: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(killed / "journal.db", alone)
    with pytest.raises(JournalError, match=r"journal\.db-tip is missing; restore all files"):
        _open(alone)
    without = _copy(killed, tmp_path / "without")
    (without / "journal.db-wal").unlink()
    with pytest.raises(
        JournalError, match="30 entries were acknowledged, but the journal contains none"
    ):
        _open(without)
    gone = _copy(killed, tmp_path / "gone")
    (gone / "journal.db").unlink()
    with pytest.raises(
        JournalError, match="missing or empty, although other files of this journal exist"
    ):
        _open(gone)


@pytest.mark.fault(23)
def test_an_older_or_another_journal_is_reported(tmp_path: Path) -> None:
    current, older, other = tmp_path / "current", tmp_path / "older", tmp_path / "other"
    current.mkdir()
    for numbers in (range(5), range(5, 9)):
        journal = _open(current)
        journal.append([entry(number) for number in numbers])
        journal.close()
        if numbers.start == 0:
            _copy(current, older)
    other.mkdir()
    journal = _open(other)
    journal.append([entry(number) for number in range(20, 40)])
    journal.close()
    for folder, said in (
        (older, "entry 6 of the journal is missing: 9 were acknowledged, but it contains only 5"),
        (other, "entry 9 differs from the acknowledged entry"),
    ):
        shutil.copy(current / "journal.db-tip", folder / "journal.db-tip")
        with pytest.raises(JournalError, match=said):
            _open(folder)


def test_an_operator_may_continue_with_what_is_left(killed: Path, tmp_path: Path) -> None:
    folder = _copy(killed, tmp_path / "copy")
    content = (folder / "journal.db-wal").read_bytes()
    (folder / "journal.db-wal").write_bytes(_flipped(content, len(content) * 4))
    with pytest.raises(JournalError, match=r'write "accept" into journal\.db-tip to continue'):
        _open(folder)
    (folder / "journal.db-tip").write_text("accept\n")
    journal = _open(folder)
    left = len(list(journal.read(0)))
    assert 5 < left < ENTRIES
    assert journal.append([entry(99)]) == [left + 1]
    journal.close()
    _open(folder).close()


@pytest.mark.parametrize("file", FILES)
@pytest.mark.parametrize("how", ["removed", "replaced by another file"])
def test_nothing_is_acknowledged_once_a_file_is_gone(tmp_path: Path, file: str, how: str) -> None:
    journal = _open(tmp_path)
    journal.append([entry(number) for number in range(3)])
    if how == "removed":
        (tmp_path / file).unlink()
    else:
        shutil.copy(tmp_path / file, tmp_path / "copy")
        (tmp_path / "copy").replace(tmp_path / file)
    for number in (3, 4):
        with pytest.raises(JournalError, match=f"{file}: {how} while the service was using it"):
            journal.append([entry(number)])
    journal.close()
    try:
        journal = _open(tmp_path)
    except JournalError as error:
        assert "missing" in str(error) or "acknowledged" in str(error)  # noqa: PT017
    else:
        assert len(list(journal.read(0))) >= 3
        journal.close()


def test_removing_files_does_not_admit_a_second_service(tmp_path: Path) -> None:
    first = _open(tmp_path)
    first.append([entry(1)])
    for file in tmp_path.iterdir():
        if file.name != "journal.db":
            file.unlink()
            with pytest.raises(JournalError, match="another service is using this journal"):
                _open(tmp_path)
    (tmp_path / "journal.db").unlink()
    with pytest.raises(JournalError, match="removed"):
        first.append([entry(2)])
    first.close()


@pytest.mark.parametrize("end", ["", "-wal", "-shm", "-tip"])
def test_a_file_that_is_removed_beside_a_service_stops_it(tmp_path: Path, end: str) -> None:
    """Without the index of the log, other processes would use another one, and other locks."""
    journal = _open(tmp_path)
    journal.append([entry(1)])
    (tmp_path / f"journal.db{end}").unlink()
    with pytest.raises(JournalError, match=rf"journal\.db{end}: removed while the service was us"):
        journal.append([entry(2)])
    journal.close()


def test_a_log_that_cannot_be_synced_is_named(
    killed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = _copy(killed, tmp_path / "copy")

    def failing(_: int) -> None:
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", failing)
        with pytest.raises(JournalError, match=r"journal\.db-wal: Input/output error"):
            _open(folder)
    _open(folder).close()


def test_a_second_service_does_not_replace_a_removed_journal(tmp_path: Path) -> None:
    first = _open(tmp_path)
    first.append([entry(1)])
    (tmp_path / "journal.db").unlink()
    with pytest.raises(
        JournalError, match="missing or empty, although other files of this journal exist"
    ):
        _open(tmp_path)
    first.close()


@pytest.mark.parametrize("made", [0, 1])
def test_a_start_that_was_killed_is_repeated(tmp_path: Path, made: int) -> None:
    (tmp_path / "journal.db-tip").write_bytes(Tip(0, b"\1" * 32).line())
    (tmp_path / "journal.db").touch()
    if made:
        connection = sqlite3.connect(tmp_path / "journal.db")
        connection.execute("PRAGMA journal_mode=WAL")
        connection.close()
    journal = _open(tmp_path)
    assert journal.append([entry(1)]) == [1]
    journal.close()
    assert len(_content(tmp_path)) > 1


def test_a_start_that_was_killed_before_its_tip_was_written_is_repeated(tmp_path: Path) -> None:
    (tmp_path / "journal.db").touch()
    (tmp_path / "journal.db-tip").touch()
    journal = _open(tmp_path)
    assert journal.append([entry(1)]) == [1]
    journal.close()
    assert len(_content(tmp_path)) > 1


def test_a_start_that_was_killed_within_the_first_change_is_repeated(tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    connection = sqlite3.connect(tmp_path / "made" / "journal.db", isolation_level=None)
    connection.execute("PRAGMA user_version=1")
    connection.execute("PRAGMA cache_size=1")
    connection.execute("BEGIN")
    connection.execute("CREATE TABLE large (content BLOB)")
    connection.execute("INSERT INTO large VALUES (zeroblob(100000))")
    # As the kill leaves it: a change on disk that is to be rolled back.
    for file in (tmp_path / "made").iterdir():
        shutil.copy(file, tmp_path / file.name)
    connection.close()
    assert all((tmp_path / f"journal.db{end}").stat().st_size for end in ("", "-journal"))
    (tmp_path / "journal.db-tip").write_bytes(Tip(0, b"\1" * 32).line())
    journal = _open(tmp_path)
    assert journal.append([entry(1)]) == [1]
    journal.close()
    assert not (tmp_path / "journal.db-journal").exists()


def test_a_journal_behind_a_link_has_its_files_beside_itself(tmp_path: Path) -> None:
    (tmp_path / "linked").mkdir()
    (tmp_path / "journal.db").symlink_to(tmp_path / "linked" / "journal.db")
    journal = _open(tmp_path)
    assert journal.append([entry(1)]) == [1]
    journal.close()
    assert (tmp_path / "linked" / "journal.db-tip").exists()


def _appending(journal: SqliteJournal, acknowledged: list[int], end: threading.Event) -> None:
    for number in itertools.count():
        if end.is_set():
            return
        acknowledged[0] = journal.append([entry(number, size=60_000)])[0]


@pytest.fixture(name="running")
def _running(tmp_path: Path) -> Iterator[tuple[Path, list[int]]]:
    folder = tmp_path / "running"
    journal = _open(folder)
    acknowledged, end = [0], threading.Event()
    thread = threading.Thread(target=_appending, args=(journal, acknowledged, end))
    thread.start()
    yield folder, acknowledged
    end.set()
    thread.join()
    journal.close()


@pytest.mark.slow
def test_a_copy_of_a_running_journal_is_complete_or_says_what_is_missing(
    running: tuple[Path, list[int]], tmp_path: Path
) -> None:
    folder, acknowledged = running
    orders = itertools.cycle(itertools.permutations(FILES))
    for number in range(24):
        before = acknowledged[0]
        copy = tmp_path / str(number)
        copy.mkdir()
        for file in next(orders):
            shutil.copy(folder / file, copy / file)
        try:
            journal = _open(copy)
        except JournalError as error:
            assert str(copy) in str(error)  # noqa: PT017
        else:
            try:
                assert len(list(journal.read(0))) >= before
            except JournalError as error:
                assert "is damaged" in str(error)  # noqa: PT017
            journal.close()
        shutil.rmtree(copy)
