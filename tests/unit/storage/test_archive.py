"""An archive has every entry of a journal, in sealed files; what is missing or damaged is named."""

import errno
import lzma
import os
import re
import shutil
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from multiradar.errors import ConfigurationError, InputError, JournalError, OutputExistsError
from multiradar.storage import archive as archives
from multiradar.storage import entries
from multiradar.storage.archive import (
    archive_entries,
    archive_journal,
    restore_archive,
    verify_archive,
)
from multiradar.storage.entries import Entry
from multiradar.storage.segments import sealed_after, segments_of
from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite import chain
from multiradar.storage.sqlite.chain import Columns
from multiradar.storage.sqlite.shortening import digests_of, remove_until
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry
from support.processes.waiting import WAIT_TIMEOUT_S, join
from unit.storage.test_verification import (
    ENTRIES,
    FINGERPRINT,
    _flip,
    _tamper,
    _writing,
    _written,
)

_MODULE: Any = archives
#: Four entries a segment.
OCTETS = 3600


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "state" / "journal.sqlite"
    journal = _written(path)
    journal.append([entry(ENTRIES, rejects=30), entry(ENTRIES + 1, key=None, size=0)])
    journal.close()
    return path


@pytest.fixture(name="folder")
def _folder(path: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "archive"
    archive_journal(path, folder, segment_octets=OCTETS)
    return folder


def _content(path: Path) -> list[object]:
    journal = SqliteJournal(path, FINGERPRINT)
    try:
        return [
            *journal.read(0), *journal.quarantined(0, 1000), journal.counts(), journal.skipped(),
            journal.find("key 11"),
        ]  # fmt: skip
    finally:
        journal.close()


def _parts(folder: Path) -> list[tuple[int, int]]:
    return [(one.first, one.last) for one in segments_of(folder)]


def test_a_journal_restored_from_segments_has_the_content_of_the_first(
    path: Path, folder: Path, tmp_path: Path
) -> None:
    assert _parts(folder)[:2] == [(1, 4), (5, 8)]
    found = verify_archive(folder)
    assert (found.first, found.last, found.damage) == (1, ENTRIES + 2, ())
    assert found.octets == sum(one.stat().st_size for one in folder.iterdir())
    restored = tmp_path / "restored" / "journal.sqlite"
    assert restore_archive(folder, restored) == found
    assert _content(restored) == _content(path)


def test_only_new_entries_are_sealed_and_no_file_changes(path: Path, folder: Path) -> None:
    before = {one.name: one.read_bytes() for one in folder.iterdir()}
    assert archive_journal(path, folder) == []
    journal = SqliteJournal(path, FINGERPRINT)
    journal.append([entry(100), entry(101)])
    (new,) = archive_journal(path, folder)
    journal.close()
    assert (new.first, new.last) == (ENTRIES + 3, ENTRIES + 4)
    assert {name: (folder / name).read_bytes() for name in before} == before
    assert verify_archive(folder).damage == ()


def test_segments_beside_a_service_that_writes_are_complete(tmp_path: Path) -> None:
    path, folder = tmp_path / "state" / "journal.sqlite", tmp_path / "archive"
    journal = _written(path)
    with _writing(journal, path) as state:
        while state.written < ENTRIES + 200:
            archive_journal(path, folder)
    archive_journal(path, folder)
    found = verify_archive(folder)
    assert (found.last, found.damage) == (state.written, ())
    assert found.digest == journal.digest(state.written).hex()
    journal.close()


@pytest.mark.slow
@pytest.mark.parametrize("call", ["open", "sync", "rename"])
def test_a_run_that_ends_at_any_step_leaves_complete_segments(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    """The disk fills up, or the process ends, at each step of each segment."""
    whole = tmp_path / "whole"
    archive_journal(path, whole, segment_octets=OCTETS)
    expected = _parts(whole)
    place = {"open": (_MODULE.lzma, "open"), "sync": (archives, "sync"), "rename": (os, "rename")}
    holder, name = place[call]
    real = getattr(holder, name)
    for step in range(len(expected) * (2 if call == "sync" else 1)):
        folder = tmp_path / f"{call}-{step}"
        steps = iter(range(step + 1))

        def failing(*args: object, **options: object) -> object:
            if next(steps, None) == step:  # noqa: B023
                raise OSError(errno.ENOSPC, "No space left on device")
            return real(*args, **options)

        with monkeypatch.context() as patch:
            patch.setattr(holder, name, failing)
            with pytest.raises(InputError, match=r"cannot write: No space .* are complete"):
                archive_journal(path, folder, segment_octets=OCTETS)
        left = _parts(folder)
        assert left == expected[: len(left)]
        # As a kill leaves it.
        (folder / "000000000001-000000000099.segment.xz.partial").write_bytes(b"half")
        archive_journal(path, folder, segment_octets=OCTETS)
        assert sorted(one.name for one in folder.iterdir()) == sorted(
            one.name for one in whole.iterdir()
        )
        assert verify_archive(folder).damage == ()


def test_every_damaged_segment_is_named_with_its_entry(folder: Path) -> None:
    for segment in segments_of(folder)[:3]:
        content = segment.path.read_bytes()
        for place in range(0, len(content), max(len(content) // 25, 1)):
            _flip(segment.path, place)
            damage = verify_archive(folder).damage
            assert damage, place
            assert f"{segment.path}: damaged at entry " in damage[0]
            segment.path.write_bytes(content)
        segment.path.write_bytes(content[: len(content) // 2])
        assert (
            f"{segment.path}: damaged at entry {segment.first}" in verify_archive(folder).damage[0]
        )
        segment.path.write_bytes(content)
    assert verify_archive(folder).damage == ()


def test_a_missing_segment_is_named_but_the_oldest_may_be_removed(
    path: Path, folder: Path, tmp_path: Path
) -> None:
    first, second, third = [one.path for one in segments_of(folder)[:3]]
    kept = third.read_bytes()
    third.unlink()
    (damage,) = verify_archive(folder).damage
    assert "entries 9 to 12 are missing" in damage
    third.write_bytes(kept)
    first.unlink()
    second.unlink()
    found = verify_archive(folder)
    assert (found.first, found.damage) == (9, ())
    # The archive goes on, the journal cannot be made of it.
    assert archive_journal(path, folder) == []
    with pytest.raises(InputError, match="starts at entry 9 instead of entry 1"):
        restore_archive(folder, tmp_path / "restored" / "journal.sqlite")


def test_segments_of_two_journals_are_not_mixed(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "journal.sqlite"
    _written(other, 60, size=901).close()
    with pytest.raises(JournalError, match=r"the last entry, 4, does not .*; choose another"):
        archive_journal(other, folder)
    own = tmp_path / "own"
    archive_journal(other, own, segment_octets=OCTETS)
    name = segments_of(folder)[1].path.name
    shutil.copy(own / name, folder / name)
    assert "entry 5 does not follow the preceding entry" in verify_archive(folder).damage[0]


@pytest.mark.parametrize("removed", [0, 8])
@pytest.mark.parametrize("grown", [0, 30])
def test_after_a_restored_backup_the_segments_of_lost_entries_are_named(
    path: Path, folder: Path, tmp_path: Path, removed: int, grown: int
) -> None:
    """The archive is newer than the backup, and the journal has grown since, or not yet."""
    restored = tmp_path / "restored" / "journal.sqlite"
    journal = _written(restored, 18)
    for number in range(grown):
        journal.append([entry(200 + number)])
    journal.close()
    if removed:
        _shortened(restored, removed)
    found = segments_of(folder)
    assert found[4][1:] == (17, 20)
    said = (
        f"{found[4].path}: the last entry, 20, does not match entry 20 of {restored}; if a backup "
        f"was restored, move {found[4].path.name} and all later segments to another folder, and "
        "run `multiradar archive` again; otherwise choose another archive"
    )
    with pytest.raises(JournalError, match=rf"^{re.escape(said)}$"):
        archive_journal(restored, folder)
    for one in found[4:]:
        one.path.unlink()
    assert archive_journal(restored, folder)
    assert (verify_archive(folder).last, verify_archive(folder).damage) == (18 + grown, ())


def _copy_into(folder: Path, source: Path, *numbers: int) -> None:
    found = segments_of(source)
    for number in numbers or range(len(found)):
        shutil.copy(found[number].path, folder)


@pytest.mark.parametrize("is_reversed", [False, True])
def test_overlapping_segments_are_named_in_any_order_of_the_folder(
    path: Path, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_reversed: bool
) -> None:
    other = tmp_path / "other"
    archive_journal(path, other, segment_octets=2 * OCTETS)
    counted = verify_archive(folder)
    _copy_into(folder, other)
    listed = Path.glob

    def ordered(self: Path, pattern: str) -> list[Path]:
        return sorted(listed(self, pattern), reverse=is_reversed)

    monkeypatch.setattr(Path, "glob", ordered)
    assert _parts(folder)[:3] == [(1, 4), (1, 8), (5, 8)]
    found = verify_archive(folder)
    said = (
        "entries 1 to 4 are in both 000000000001-000000000004.segment.xz and "
        "000000000001-000000000008.segment.xz; keep only the segments of one archive in the folder"
    )
    assert found.damage[0] == f"{folder}: {said}"
    assert found.accepted < counted.accepted
    with pytest.raises(JournalError, match=said), archive_entries(folder):
        pass
    with pytest.raises(JournalError, match=said):
        restore_archive(folder, tmp_path / "restored" / "journal.sqlite")
    with pytest.raises(JournalError, match=said):
        archive_journal(path, folder)


def test_a_foreign_segment_is_named_with_the_one_before(
    path: Path, folder: Path, tmp_path: Path
) -> None:
    other, own = tmp_path / "other" / "journal.sqlite", tmp_path / "own"
    _written(other, ENTRIES + 2, size=901).close()
    archive_journal(other, own, segment_octets=OCTETS)
    kept = {one.path.name: one.path.read_bytes() for one in segments_of(folder)}
    names = list(kept)
    for number in (0, 4):
        _copy_into(folder, own, number)
        follower = max(number, 1)
        said = f"{names[follower]}: entry {4 * follower + 1} does not follow the preceding entry in"
        assert f"{said} {names[follower - 1]}; keep" in verify_archive(folder).damage[0]
        with archive_entries(folder) as (_, _, entries), pytest.raises(JournalError, match=said):
            list(entries)
        rejected = said if number else f"{names[0]}: entry 4 does not match the journal; choose"
        with pytest.raises(JournalError, match=rejected):
            archive_journal(path, folder)
        for name, content in kept.items():
            (folder / name).write_bytes(content)
    assert archive_journal(path, folder) == []


def _lose(segment: Path) -> None:
    segment.unlink()


def _cut(segment: Path) -> None:
    segment.write_bytes(segment.read_bytes()[:-4])


def _shortened(path: Path, until: int) -> None:
    remove_until(path, Position(until, digests_of(path, [until])[until]))


@pytest.mark.parametrize("harm", [_lose, _cut])
def test_a_lost_segment_is_sealed_again_from_the_journal(
    path: Path, folder: Path, harm: Callable[[Path], None]
) -> None:
    before, found = _parts(folder), segments_of(folder)
    _shortened(path, 8)
    harm(found[3].path)
    first = found[4 if harm is _lose else 3].path.name
    said = f"the journal still has these entries: remove {first} and all later segments, and run"
    with pytest.raises(
        JournalError, match=rf"(13 to 16 are missing|damaged at entry 13: .*); {said}"
    ):
        archive_journal(path, folder)
    for one in found[3:]:
        one.path.unlink(missing_ok=True)
    assert archive_journal(path, folder, segment_octets=OCTETS)
    assert _parts(folder) == before
    assert verify_archive(folder).damage == ()


@pytest.mark.parametrize("harm", [_lose, _cut])
def test_a_lost_segment_of_removed_entries_comes_from_another_copy(
    path: Path, folder: Path, harm: Callable[[Path], None]
) -> None:
    found = segments_of(folder)
    _shortened(path, 16)
    harm(found[2].path)
    said = (
        "restore these segments from another copy of the archive; without one, move all segments "
        f"before {found[3].path.name} to another folder"
    )
    with pytest.raises(JournalError, match=rf"(entries 9 to 12 are missing|entry 9: .*); {said}"):
        archive_journal(path, folder)
    for one in found[:3]:
        one.path.unlink(missing_ok=True)
    assert archive_journal(path, folder) == []
    assert verify_archive(folder).damage == ()


def test_the_oldest_and_the_newest_segment_have_advice(path: Path, folder: Path) -> None:
    found = segments_of(folder)
    for number in (0, -1):
        kept = found[number].path.read_bytes()
        _cut(found[number].path)
        with pytest.raises(JournalError, match=f"remove {found[number].path.name} and all later"):
            archive_journal(path, folder)
        found[number].path.write_bytes(kept)
    _shortened(path, 8)
    for one in found[:2]:
        one.path.unlink()
    _cut(found[2].path)
    with pytest.raises(JournalError, match=r"from another copy of the archive$"):
        archive_journal(path, folder)


def test_damage_that_only_reading_finds_has_the_advice(path: Path, folder: Path) -> None:
    begin = Position(0, digests_of(path, [0])[0])
    second = segments_of(folder)[1].path
    _flip(second, second.stat().st_size // 2)
    with pytest.raises(JournalError, match=f"damaged at entry 5: .*; the journal .*{second.name}"):
        list(sealed_after(folder, begin))


def test_a_renamed_segment_is_damage(folder: Path) -> None:
    second = segments_of(folder)[1].path
    second.rename(second.with_name("000000000006-000000000008.segment.xz"))
    assert any(
        "the file name does not match entry 5" in one for one in verify_archive(folder).damage
    )


@pytest.mark.parametrize(("old", "new"), [(rb"\Z", b" "), (rb'"last": ?\d+', b'"last": 99')])
def test_a_segment_with_another_end_is_damaged(folder: Path, old: bytes, new: bytes) -> None:
    segment = segments_of(folder)[0]
    content = lzma.decompress(segment.path.read_bytes())
    end = content.rindex(b'"last"')
    changed, count = re.subn(old, new, content[end:], count=1)
    assert count == 1
    segment.path.write_bytes(lzma.compress(content[:end] + changed))
    assert "the digest does not match the entries" in verify_archive(folder).damage[0]


def test_a_damaged_journal_is_not_sealed(path: Path, tmp_path: Path) -> None:
    _tamper(path, "UPDATE entry SET source = 'x' WHERE sequence = 12")
    with pytest.raises(JournalError, match="entry 12 of the journal is damaged"):
        archive_journal(path, tmp_path / "archive", segment_octets=OCTETS)
    assert _parts(tmp_path / "archive") == [(1, 4), (5, 8)]
    _tamper(path, "UPDATE header SET format_version = 4")
    with pytest.raises(ConfigurationError, match="of format 2, was 4"):
        archive_journal(path, tmp_path / "archive")


def test_one_command_writes_an_archive_at_a_time(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "archive"
    entered, leave = threading.Event(), threading.Event()
    real = _MODULE.sync

    def waiting(synced: Path) -> None:
        entered.set()
        leave.wait(WAIT_TIMEOUT_S)
        real(synced)

    monkeypatch.setattr(archives, "sync", waiting)
    thread = threading.Thread(target=archive_journal, args=(path, folder))
    thread.start()
    try:
        assert entered.wait(WAIT_TIMEOUT_S)
        with pytest.raises(OutputExistsError, match="another command is writing to this archive"):
            archive_journal(path, folder)
    finally:
        leave.set()
        join(thread)
    assert verify_archive(folder).damage == ()


def test_rejected_rows_count_as_octets_of_a_segment_and_are_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All messages of a faulty sender were held in memory, unpacked, and in one segment."""
    path, folder = tmp_path / "state" / "journal.sqlite", tmp_path / "archive"
    journal = SqliteJournal(path, FINGERPRINT)
    for number in range(6):
        journal.append([entry(number, rejects=2000, size=0)])
    journal.close()
    octets = len(Columns.of(entry(5, rejects=2000, size=0)).rejects)
    with monkeypatch.context() as patch:
        for name in ("_unpacked", "_packed"):
            patch.setattr(chain, name, lambda _rows: pytest.fail("it was unpacked or packed"))
        archive_journal(path, folder, segment_octets=2 * octets)
    assert _parts(folder) == [(1, 2), (3, 4), (5, 6)]
    restored = tmp_path / "restored" / "journal.sqlite"
    monkeypatch.setattr(entries, "PIECE_OCTETS", 3 * 2000 * entries.ROW_OCTETS)
    pieces: list[int] = []
    append = SqliteJournal.append

    def counted(self: SqliteJournal, piece: Sequence[Entry]) -> list[int]:
        pieces.append(len(piece))
        return append(self, piece)

    monkeypatch.setattr(SqliteJournal, "append", counted)
    archive_journal(path, tmp_path / "one")
    restore_archive(tmp_path / "one", restored)
    assert pieces == [3, 3]
    assert _content(restored) == _content(path)


def test_few_large_entries_are_a_piece() -> None:
    small, large = entry(1), replace(entry(2), payload=bytes(entries.PIECE_OCTETS))
    pieces = entries.in_pieces([small] * 600 + [small, large, large, small])
    assert [len(one) for one in pieces] == [256, 256, 90, 1, 1]
    assert list(entries.in_pieces([])) == []
