"""Only what is sealed and not needed is removed from a journal, and no step loses an entry."""

import os
import shutil
import sqlite3
import sys
import threading
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import (
    DamageError,
    InputError,
    JournalError,
    OutputExistsError,
    RemovedEntriesError,
)
from multiradar.storage.archive import (
    archive_journal,
    locked_archive,
    restore_archive,
    verify_archive,
)
from multiradar.storage.backup import copy_backup, verify_backup, write_backup
from multiradar.storage.entries import StoredEntry
from multiradar.storage.retention import Rules, Shortened, shorten
from multiradar.storage.segments import sealed_after, segments_of
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite import shortening
from multiradar.storage.sqlite.file_lock import unchanged
from multiradar.storage.sqlite.shortening import extent_of, remove_until
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.sqlite.tip import Tip
from multiradar.storage.verification import verify_journal
from support.inputs.journal_entries import entry
from support.processes.killed_removal import CALLS, removing
from support.processes.waiting import join
from unit.storage.test_sqlite_journal import _can_trace
from unit.storage.test_verification import FINGERPRINT, _add_snapshot, _content, _flip, _tamper

_MODULE: Any = shortening
ENTRIES = 60
#: Entries of a segment of the archive: 4, of which the payloads have 900 octets.
OCTETS = 3600
#: The snapshots are of these entries.
NEEDED, NEWEST = 42, 50
DAY_S = 86_400.0
ALL = Rules(octets=1)


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "state" / "journal.sqlite"
    journal = SqliteJournal(path, FINGERPRINT)
    for number in range(ENTRIES):
        key = None if number % 7 == 3 else ""
        journal.append([entry(number, key=key, rejects=number % 3, size=900)])
    journal.skip(7, "poison")
    for sequence in (NEEDED, NEWEST):
        _add_snapshot(path, journal, sequence)
    journal.close()
    return path


@pytest.fixture(name="archive")
def _archive(path: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "archive"
    archive_journal(path, folder, segment_octets=OCTETS)
    return folder


def _snapshots(path: Path) -> list[Position]:
    journal = SqliteJournal(path, FINGERPRINT)
    try:
        return [Position(one, journal.digest(one)) for one in (NEWEST, NEEDED)]
    finally:
        journal.close()


# The data time of entry n is day n.
def _time_of(admission: str) -> float:
    return float(admission.removeprefix("state ")) * DAY_S


def _shorten(
    path: Path, archive: Path, rules: Rules = ALL, *, now_s: float = 1e12,
    snapshots: list[Position] | None = None,
) -> Shortened:  # fmt: skip
    return shorten(
        path, archive, rules, now_s=now_s, time_of=_time_of,
        snapshots=_snapshots(path) if snapshots is None else snapshots,
    )  # fmt: skip


def _entries(path: Path) -> list[StoredEntry]:
    journal = SqliteJournal(path, FINGERPRINT)
    try:
        return list(journal.read(journal.removed_until()))
    finally:
        journal.close()


def test_entries_before_both_snapshots_are_removed_and_the_rest_is_as_it_was(
    path: Path, archive: Path
) -> None:
    before = _entries(path)
    sound = verify_journal(path)
    found = _shorten(path, archive)
    # Segments end with entries 4, 8 … 40, 44; a start needs those after 42.
    assert (found.removed, found.first, found.segments) == (40, 41, ())
    assert found.reason == (
        "entries after 42 are needed to start from the snapshots, and the next segment, "
        f"{segments_of(archive)[10].path.name}, ends with entry 44"
    )
    assert _entries(path) == before[40:]
    again = verify_journal(path)
    assert (again.damage, again.snapshots, again.first) == ((), 2, 41)
    assert (again.entries, again.accepted, again.rejected, again.digest) == (
        sound.entries, sound.accepted, sound.rejected, sound.digest,
    )  # fmt: skip
    assert _shorten(path, archive).removed == 0


def test_the_octets_of_removed_entries_are_used_again(path: Path, archive: Path) -> None:
    used = extent_of(path).used_octets
    assert _shorten(path, archive).used_octets < 0.7 * used
    size = path.stat().st_size
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(1000 + number, size=900) for number in range(20)])
    journal.close()
    assert path.stat().st_size == size


def test_what_a_sender_or_reader_may_still_ask_for_is_answered(path: Path, archive: Path) -> None:
    journal = SqliteJournal(path, FINGERPRINT)
    quarantine = journal.quarantined(0, 1000)
    counts, skipped = journal.counts(), journal.skipped()
    known = {f"key {number}": journal.find(f"key {number}") for number in range(ENTRIES)}
    _shorten(path, archive, snapshots=[Position(one, b"") for one in (NEWEST, NEEDED)])
    assert (journal.counts(), journal.skipped()) == (counts, skipped)
    assert journal.removed_until() == 40
    for key, whole in known.items():
        found = journal.find(key)
        if whole is None or whole.sequence > 40:
            assert found == whole
            continue
        assert found is not None
        assert found.sequence == whole.sequence
        assert (found.entry.kind, found.entry.accepted, found.entry.rejects) == (
            whole.entry.kind, whole.entry.accepted, whole.entry.rejects,
        )  # fmt: skip
    left = [one for one in quarantine if one.sequence > 40]
    for after in (0, left[0].number, left[3].number):
        later = [one for one in left if one.number > after]
        assert journal.quarantined(after, 2) == later[:2]
        assert journal.quarantined(after, 1000) == later
    assert journal.append([entry(3000, rejects=2)]) == [ENTRIES + 1]
    assert journal.quarantined(left[-1].number, 10)[-1].number == left[-1].number + 2
    with pytest.raises(JournalError, match="the key 'key 5' belongs to a removed entry"):
        journal.append([entry(2000, key="key 5")])
    journal.close()
    assert len(_entries(path)) == ENTRIES + 1 - 40


def test_reading_what_was_removed_says_where_it_is(path: Path, archive: Path) -> None:
    _shorten(path, archive)
    journal = SqliteJournal(path, FINGERPRINT)
    said = r"no longer starts with entry 1: entries up to 40 are only in the archive, and no "
    for read in (lambda: next(journal.read(0)), lambda: journal.digest(39)):
        with pytest.raises(RemovedEntriesError, match=said):
            read()
    assert next(journal.read(40)).sequence == 41
    journal.close()


def test_a_reader_that_is_overtaken_gets_an_error(path: Path, archive: Path) -> None:
    journal = SqliteJournal(path, FINGERPRINT)
    sqlite_journal: Any = sys.modules[SqliteJournal.__module__]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sqlite_journal, "_PIECE_ENTRIES", 10)
        reading = journal.read(0)
        assert [next(reading).sequence for _ in range(11)] == [*range(1, 12)]
        end = [position for _, position, _ in sealed_after(archive, Position(
            0, journal.digest(0)))][9]  # fmt: skip
        remove_until(path, end)
        with pytest.raises(RemovedEntriesError):
            list(reading)
    journal.close()


@pytest.mark.parametrize(
    ("rules", "first"),
    [
        # Segments that end with entry n have the time n − 1.
        (Rules(age_s=40.0 * DAY_S), 21),
        (Rules(age_s=59.0 * DAY_S), 1),
        (Rules(age_s=1.0), 41),
        (Rules(octets=1 << 40), 1),
        (Rules(octets=1), 41),
    ],
)
def test_rules_by_age_and_octets(path: Path, archive: Path, rules: Rules, first: int) -> None:
    assert _shorten(path, archive, rules).first == first
    assert verify_journal(path).damage == ()


def test_a_segment_that_is_old_only_in_part_is_named(path: Path, tmp_path: Path) -> None:
    """The reason was that nothing exceeds the age, although most entries of the segment do."""
    archive = tmp_path / "one"
    (segment,) = archive_journal(path, archive)
    assert _shorten(path, archive, Rules(age_s=10.0 * DAY_S)).reason == (
        f"{segment.path.name} remains in the journal: its last entry, 60, is within the "
        "configured age and size, and only whole segments are removed"
    )


def test_octets_are_removed_until_the_journal_is_small_enough(path: Path, archive: Path) -> None:
    whole = extent_of(path).used_octets
    found = _shorten(path, archive, Rules(octets=whole - 20_000))
    assert 1 < found.first < 41
    assert found.used_octets <= whole - 20_000


def test_a_data_time_in_the_future_makes_nothing_older(path: Path, archive: Path) -> None:
    # The machine says day 20: nothing is older than 20 days.
    assert _shorten(path, archive, Rules(age_s=20.0 * DAY_S), now_s=20.0 * DAY_S).first == 1
    assert _shorten(path, archive, Rules(age_s=10.0 * DAY_S), now_s=20.0 * DAY_S).first == 9


# ---------------------------------------------------------------- the archive


def _aged(archive: Path, days: float, now_s: float) -> None:
    for one in segments_of(archive):
        os.utime(one.path, (now_s - days * DAY_S,) * 2)


def test_segments_are_removed_by_their_own_rule_after_the_time_of_recording(
    path: Path, archive: Path
) -> None:
    now_s = 1000.0 * DAY_S
    rules = Rules(octets=1, archive_age_s=30.0 * DAY_S)
    # They were sealed yesterday: their data may be as old as they are.
    _aged(archive, 1.0, now_s)
    assert _shorten(path, archive, rules, now_s=now_s).segments == ()
    _aged(archive, 400.0, now_s)
    found = _shorten(path, archive, rules, now_s=now_s)
    # The newest data are of day 59: entries up to that of day 29 are 30 days old.
    assert [int(name[13:25]) for name in found.segments] == [4, 8, 12, 16, 20, 24, 28]
    assert segments_of(archive)[0].first == 29
    assert verify_archive(archive).damage == ()
    assert archive_journal(path, archive, segment_octets=OCTETS) == []


def test_octets_of_the_archive_do_not_end_the_time_of_recording(path: Path, archive: Path) -> None:
    now_s = 1000.0 * DAY_S
    rules = Rules(octets=1, archive_octets=1, recording_s=50.0 * DAY_S)
    _aged(archive, 400.0, now_s)
    found = _shorten(path, archive, rules, now_s=now_s)
    assert [int(name[13:25]) for name in found.segments] == [4, 8]
    no_limit = Rules(octets=1, archive_octets=1, recording_s=0.0)
    _shorten(path, archive, no_limit, now_s=now_s)
    # What the journal still has stays, since it could not be removed from it without them.
    assert segments_of(archive)[0].first == 41


def test_an_archive_goes_on_behind_a_shortened_journal(path: Path, archive: Path) -> None:
    expected = _entries(path)
    _shorten(path, archive)
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(500), entry(501)])
    digest = journal.digest(ENTRIES + 2).hex()
    journal.close()
    (new,) = archive_journal(path, archive, segment_octets=OCTETS)
    assert (new.first, new.last) == (ENTRIES + 1, ENTRIES + 2)
    whole = path.parent.parent / "whole" / "journal.sqlite"
    assert restore_archive(archive, whole).digest == digest
    assert _entries(whole)[:ENTRIES] == expected
    with pytest.raises(JournalError, match="entries 1 to 40 were removed from "):
        archive_journal(path, path.parent.parent / "other")


# ---------------------------------------------------------------- nothing is removed


def _damage_segment(archive: Path) -> None:
    _flip(segments_of(archive)[3].path, 300)


def _remove_segment(archive: Path) -> None:
    segments_of(archive)[3].path.unlink()


def _cut_segment(archive: Path) -> None:
    path = segments_of(archive)[3].path
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize("harm", [_damage_segment, _remove_segment, _cut_segment])
def test_only_what_is_sound_in_the_archive_is_removed(path: Path, archive: Path, harm: Any) -> None:
    before = _entries(path)
    harm(archive)
    lost = r"damaged at entry 13|entries 13 to 16 are missing"
    with pytest.raises(JournalError, match=rf"({lost}).*; the journal still has these entries: "):
        _shorten(path, archive)
    assert _entries(path) == before
    assert verify_journal(path).damage == ()


def test_the_archive_of_another_journal_removes_nothing(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "journal.sqlite"
    journal = SqliteJournal(other, FINGERPRINT)
    journal.append([entry(number + 1, size=900) for number in range(ENTRIES)])
    journal.close()
    archive_journal(other, tmp_path / "foreign", segment_octets=OCTETS)
    before = _entries(path)
    with pytest.raises(JournalError, match="entry 4 does not match the journal; choose"):
        _shorten(path, tmp_path / "foreign")
    assert _entries(path) == before


def test_a_start_needs_two_snapshots_an_archive_and_one_command_at_a_time(
    path: Path, archive: Path, tmp_path: Path
) -> None:
    snapshots = _snapshots(path)
    before = _content(path)
    with pytest.raises(InputError, match=r"expected 2 snapshots that this version .* 1;"):
        _shorten(path, archive, snapshots=snapshots[:1])
    with pytest.raises(InputError, match="no segments; run `multiradar archive` first"):
        _shorten(path, tmp_path / "none", snapshots=snapshots)
    with locked_archive(archive), pytest.raises(OutputExistsError, match="another command is"):
        _shorten(path, archive, snapshots=snapshots)
    assert _content(path) == before


def test_the_last_entry_and_damaged_entries_stay(path: Path, archive: Path) -> None:
    end = _entries(path)[-1]
    with pytest.raises(JournalError, match="entry 60 is the last entry and cannot be removed"):
        remove_until(path, Position(end.sequence, end.digest))
    _tamper(path, "UPDATE entry SET source = 'x' WHERE sequence = 6")
    with pytest.raises(JournalError, match="entry 6 of the journal is damaged"):
        _shorten(path, archive)
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT min(sequence) FROM entry").fetchone() == (5,)


# ---------------------------------------------------------------- verification and backup


@pytest.mark.parametrize(
    ("statement", "named"),
    [
        ("UPDATE base SET sequence = 36", "entries 37 to 40 of the journal are missing"),
        (
            "UPDATE base SET sequence = 41",
            "entry 41 of the journal is damaged: marked as removed",
        ),
        ("UPDATE base SET digest = x'00'", "entry 41 of the journal is damaged"),
        ("UPDATE base SET accepted = accepted + 1", "the counts do not match"),
        ("UPDATE base SET rejected = rejected + 1", "rejected rows starting at number"),
        ("UPDATE base SET keys = keys + 1", "expected 35 keys of removed entries, found 34"),
        ("DELETE FROM base", "expected one record of the last removed entry"),
        ("DELETE FROM removed WHERE sequence = 9", "expected 34 keys of removed entries, found 33"),
        ("UPDATE removed SET accepted = 1 WHERE sequence = 9", "entry 9 of the journal is damaged"),
        ("DELETE FROM entry WHERE sequence = 41", "entry 41 of the journal is missing"),
        ("UPDATE header SET format_version = 2", "entries 1 to 40 of the journal are missing"),
    ],
)
def test_damage_of_a_shortened_journal_is_named(
    path: Path, archive: Path, statement: str, named: str
) -> None:
    _shorten(path, archive)
    _tamper(path, statement)
    assert named in " ".join(verify_journal(path).damage)


def test_without_a_sound_snapshot_the_verification_says_that_no_start_is_possible(
    path: Path, archive: Path, tmp_path: Path
) -> None:
    _shorten(path, archive)
    snapshots = sorted((path.parent / "journal.sqlite-snapshots").glob("*.snapshot"))
    _flip(snapshots[-1], 200)
    assert len(verify_journal(path).damage) == 1
    _flip(snapshots[0], 200)
    damage = verify_journal(path).damage
    assert len(damage) == 3
    assert damage[-1].endswith(
        "entries up to 40 are only in the archive, and no intact snapshot follows them: a "
        "service cannot start; restore the archive"
    )
    (tmp_path / "backup").mkdir()
    with pytest.raises(DamageError, match="no intact snapshot"):
        write_backup(path, tmp_path / "backup", {}, time_s=0.0, version="0")


def test_a_backup_of_a_shortened_journal_is_restored(
    path: Path, archive: Path, tmp_path: Path
) -> None:
    _shorten(path, archive)
    folder, to = tmp_path / "backup", tmp_path / "restored"
    folder.mkdir()
    to.mkdir()
    made = write_backup(path, folder, {}, time_s=0.0, version="0")
    assert (made.entries, made.snapshot) == (ENTRIES, f"{NEWEST:012d}.snapshot")
    assert verify_backup(folder).damage == ()
    copy_backup(folder, to)
    assert _entries(to / "journal.sqlite") == _entries(path)


# ---------------------------------------------------------------- kills and neighbours


@pytest.mark.slow
@pytest.mark.skipif(not _can_trace(), reason="needs strace, and leave to trace")
@pytest.mark.parametrize("runs", [False, True], ids=["stopped", "running"])
def test_a_kill_at_each_step_leaves_each_entry_in_the_journal_or_noted_as_removed(
    path: Path, archive: Path, tmp_path: Path, runs: bool
) -> None:
    """Killed before each write, sync and removal of a file, without a service and beside one."""
    before, end = _entries(path), _entries(path)[23]
    killed = 0
    with removing(Position(24, end.digest)) as remove:
        for kind in CALLS:
            bases: list[int] = []
            complete = False
            while not complete:
                state = tmp_path / "copy" / "state"
                shutil.copytree(path.parent, state)
                copy = state / path.name
                running = SqliteJournal(copy, FINGERPRINT) if runs else None
                complete = remove(kind, len(bases) + 1, copy)
                journal = running or SqliteJournal(copy, FINGERPRINT)
                base = journal.removed_until()
                assert base in (0, 8, 16, 24)
                assert list(journal.read(base)) == before[base:]
                assert journal.append([entry(900)]) == [ENTRIES + 1]
                journal.close()
                assert verify_journal(copy).damage == ()
                remove_until(copy, Position(24, end.digest))
                assert [one.sequence for one in _entries(copy)] == [*range(25, ENTRIES + 2)]
                shutil.rmtree(state)
                bases.append(base)
            assert bases == sorted(bases)
            assert bases[-1] == 24
            killed += len(bases) - 1
    assert killed > 20


def test_a_service_writes_and_reads_while_entries_are_removed(
    path: Path, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_MODULE, "ENTRIES_MAX", 2)
    ends = [end for _, end, _ in sealed_after(archive, Position(0, extent_of(path).base.digest))]
    journal = SqliteJournal(path, FINGERPRINT)
    failures: list[Exception] = []

    def remove() -> None:
        try:
            for end in ends[:10]:
                remove_until(path, end)
        except Exception as error:
            failures.append(error)

    removing = threading.Thread(target=remove)
    removing.start()
    acknowledged: list[int] = []
    while removing.is_alive() or len(acknowledged) < 20:
        acknowledged += journal.append([entry(5000 + len(acknowledged), size=300)])
        assert journal.counts().entries == acknowledged[-1]
    join(removing)
    assert failures == []
    assert journal.removed_until() == 40
    assert [one.sequence for one in journal.read(40)] == [*range(41, acknowledged[-1] + 1)]
    journal.close()
    assert verify_journal(path).damage == ()


def test_a_start_waits_while_entries_are_removed(
    path: Path, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    locks: Any = sys.modules[unchanged.__module__]
    monkeypatch.setattr(locks, "_TRIES", 2)
    tip = path.with_name(f"{path.name}-tip")
    with unchanged(tip), pytest.raises(JournalError, match="another process is changing this"):
        SqliteJournal(path, FINGERPRINT)
    SqliteJournal(path, FINGERPRINT).close()


def test_a_tip_of_a_removed_entry_is_that_of_a_power_failure(path: Path, archive: Path) -> None:
    tip = path.with_name(f"{path.name}-tip")
    journal = SqliteJournal(path, FINGERPRINT)
    old = Tip(20, journal.digest(20)).line()
    journal.close()
    _shorten(path, archive)
    tip.write_bytes(old)
    assert verify_journal(path).damage == ()
    assert _entries(path)[0].sequence == 41
