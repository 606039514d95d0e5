"""A journal that one service writes and another follows; two never write."""

import sqlite3
from pathlib import Path

import pytest

from multiradar.errors import ConfigurationError, JournalError
from multiradar.storage.sqlite.file_lock import FileLock
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry

FINGERPRINT = "a" * 64


def _opened(path: Path, *, standby: bool = False) -> SqliteJournal:
    return SqliteJournal(path, FINGERPRINT, standby=standby)


def test_a_follower_reads_what_is_acknowledged_and_leads_when_the_other_has_closed(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.db"
    first = _opened(path)
    first.append([entry(1), entry(2, rejects=2)])
    second = _opened(path, standby=True)
    assert (second.following, second.acknowledged()) == (True, 2)
    first.append([entry(3)])
    assert second.acknowledged() == 3
    assert list(second.read(0)) == list(first.read(0))
    assert second.counts() == first.counts()
    assert second.quarantined(0, 10) == first.quarantined(0, 10)
    with pytest.raises(JournalError, match="another service is writing this journal"):
        second.append([entry(4)])
    assert not second.lead()
    first.close()
    assert second.lead()
    assert not second.following
    assert second.append([entry(4)]) == [4]
    second.close()
    third = _opened(path, standby=True)
    assert (third.following, third.counts().entries) == (False, 4)
    third.close()


def test_marks_of_a_follower_are_written_when_it_leads(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    first = _opened(path)
    first.append([entry(1), entry(2)])
    second = _opened(path, standby=True)
    first.skip(1, "the first")
    second.skip(1, "the second")
    second.skip(2, "the second")
    assert first.skipped() == {1: "the first"}
    assert second.skipped() == {1: "the first", 2: "the second"}
    first.close()
    assert second.lead()
    second.close()
    again = _opened(path)
    assert again.skipped() == {1: "the first", 2: "the second"}
    again.close()


@pytest.mark.fault(29)
def test_a_service_whose_lock_was_lost_writes_no_more(tmp_path: Path) -> None:
    """As after an error of the file system, or with one whose locks do not work."""
    path = tmp_path / "journal.db"
    first = _opened(path)
    first.append([entry(1)])
    second = _opened(path, standby=True)
    first._lock.release()
    assert second.lead()
    with pytest.raises(JournalError, match=r"another service has opened this journal for writing"):
        first.append([entry(2)])
    with pytest.raises(JournalError, match=r"another service has opened this journal for writing"):
        first.append([entry(2)])
    assert second.append([entry(3)]) == [2]
    assert [one.entry for one in second.read(1)] == [entry(3)]
    first.close()
    second.close()


def test_a_journal_in_whose_place_another_was_put_is_not_continued(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    first = _opened(path)
    second = _opened(path, standby=True)
    path.rename(tmp_path / "moved.db")
    with pytest.raises(JournalError, match=r"journal\.db: removed while the service was using it"):
        second.lead()
    path.write_bytes((tmp_path / "moved.db").read_bytes())
    with pytest.raises(
        JournalError, match="replaced by another file while the service was using it"
    ):
        second.lead()
    for one in (first, second):
        one.close()


def test_a_follower_needs_the_same_configuration_and_format(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    first = _opened(path)
    with pytest.raises(ConfigurationError, match="the journal was created with other sensors"):
        SqliteJournal(path, "b" * 64, standby=True)
    first.close()
    connection = sqlite3.connect(path)
    with connection:
        connection.execute("UPDATE header SET format_version = 9")
    connection.close()
    lock = FileLock(path)
    with pytest.raises(ConfigurationError, match="expected a journal of format 2, was 9"):
        _opened(path, standby=True)
    lock.release()


def test_a_follower_finds_a_damaged_entry(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    first = _opened(path)
    first.append([entry(1), entry(2)])
    second = _opened(path, standby=True)
    connection = sqlite3.connect(path)
    with connection:
        connection.execute("UPDATE entry SET source = 'forged' WHERE sequence = 2")
    connection.close()
    with pytest.raises(JournalError, match="entry 2 of the journal is damaged"):
        list(second.read(0))
    for one in (first, second):
        one.close()


def test_a_follower_without_a_journal_gives_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal.db"
    lock = FileLock(path)
    monkeypatch.setattr("multiradar.storage.sqlite.sqlite_journal._TRIES", 2)
    with pytest.raises(JournalError, match="journal not yet created by the service"):
        _opened(path, standby=True)
    lock.release()
