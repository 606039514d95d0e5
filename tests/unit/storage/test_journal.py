"""What every journal promises, on disk and in memory."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from multiradar.errors import JournalError
from multiradar.storage.journal import Journal
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.storage.sqlite.chain import json_array
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry


def _on_disk(folder: Path) -> Journal:
    return SqliteJournal(folder / "journal.db", "f" * 64)


def _in_memory(_folder: Path) -> Journal:
    return MemoryJournal("f" * 64)


@pytest.fixture(params=[_on_disk, _in_memory], ids=["sqlite", "memory"])
def journal(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Journal]:
    make: Callable[[Path], Journal] = request.param
    made = make(tmp_path)
    yield made
    made.close()


def test_entries_come_back_in_order_as_they_were(journal: Journal) -> None:
    entries = [
        entry(number, rejects=number % 4, key=None if number == 7 else "") for number in range(20)
    ]
    assert journal.append(entries[:8]) == list(range(1, 9))
    assert journal.append(entries[8:]) == list(range(9, 21))
    stored = list(journal.read(0))
    assert [one.sequence for one in stored] == list(range(1, 21))
    assert [one.entry for one in stored] == entries


def test_reading_goes_on_after_a_sequence_number(journal: Journal) -> None:
    journal.append([entry(number) for number in range(600)])
    assert [one.sequence for one in journal.read(597)] == [598, 599, 600]
    assert list(journal.read(600)) == []


def test_entries_appended_while_reading_are_seen(journal: Journal) -> None:
    journal.append([entry(1)])
    reading = journal.read(0)
    assert next(reading).sequence == 1
    journal.append([entry(2)])
    assert [one.sequence for one in reading] == [2]


def test_an_empty_journal_says_so(journal: Journal) -> None:
    counts = journal.counts()
    assert (counts.entries, counts.accepted, counts.rejected, counts.admission) == (0, 0, 0, "")
    assert list(journal.read(0)) == []
    assert journal.find("key 1") is None
    assert journal.quarantined(0, 10) == []
    assert journal.skipped() == {}


def test_counts_follow_every_append(journal: Journal) -> None:
    journal.append([entry(3, rejects=2), entry(4, rejects=1)])
    journal.append([entry(6)])
    counts = journal.counts()
    assert (counts.entries, counts.accepted, counts.rejected) == (3, 13, 3)
    assert counts.admission == "state 6"


def test_an_entry_is_found_by_its_key(journal: Journal) -> None:
    journal.append([entry(1), entry(2, rejects=3), entry(4, key=None)])
    found = journal.find("key 2")
    assert found is not None
    assert found.sequence == 2
    assert found.entry == entry(2, rejects=3)
    assert journal.find("key 4") is None


def test_a_key_enters_once_and_the_whole_transaction_is_rejected(journal: Journal) -> None:
    journal.append([entry(1)])
    with pytest.raises(JournalError):
        journal.append([entry(2), entry(1)])
    assert journal.counts().entries == 1
    assert journal.find("key 2") is None


def test_the_quarantine_is_read_in_pages_without_gap_or_repetition(journal: Journal) -> None:
    journal.append([entry(number, rejects=number % 4) for number in range(30)])
    pages, after = [], 0
    while page := journal.quarantined(after, 4):
        assert len(page) <= 4
        pages += page
        after = page[-1].number
    assert [one.number for one in pages] == list(range(1, journal.counts().rejected + 1))
    expected = [
        (number + 1, f"source {number % 3}", row)
        for number in range(30)
        for row in entry(number, rejects=number % 4).rejects
    ]
    assert [(one.sequence, one.source, one.row) for one in pages] == expected


def test_marks_of_skipped_entries_are_kept(journal: Journal) -> None:
    journal.append([entry(1), entry(2)])
    journal.skip(2, "ValueError('no')")
    journal.skip(2, "ValueError('again no')")
    assert journal.skipped() == {2: "ValueError('again no')"}


def test_closing_twice_is_allowed(journal: Journal) -> None:
    journal.append([entry(1)])
    journal.close()
    journal.close()


@pytest.mark.parametrize("count", [0, 1, 199, 200, 201, 1000])
def test_an_array_encoded_in_pieces_is_the_same_text(count: int) -> None:
    values = [[index, "CODE", 'a "reason"', "é"] for index in range(count)]
    assert json_array(iter(values)) == json.dumps(values)
