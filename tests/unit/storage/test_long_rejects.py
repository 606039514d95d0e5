"""Rejected rows cost little, whatever a sender sends, and are read back as they were."""

import base64
import hashlib
import json
import sqlite3
import tracemalloc
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import JournalError
from multiradar.storage.entries import (
    MEASUREMENTS_BYTES_MAX,
    RAW_BYTES_MAX,
    RAWS_BYTES_MAX,
    REASON_CHARACTERS_MAX,
    RECOVERABLE,
    RejectedRow,
    bounded,
)  # fmt: skip
from multiradar.storage.sqlite.chain import Columns
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar_converters.normalised.text import parse_ndjson
from support.inputs.journal_entries import entry as journal_entry

#: Octets of the note that replaces the rest of a content.
NOTE_MAX = 128


@pytest.mark.parametrize("letter", ["x", "é", "\N{AIRPLANE}", "\x01", "\ud800"])
def test_of_a_long_content_the_beginning_and_the_hash_are_kept(letter: str) -> None:
    raw = letter * 1_000_000
    row = RejectedRow(0, "MALFORMED_JSON", "why" * 1000, raw)
    octets = raw.encode("utf-8", "surrogatepass")
    note = f"… [{len(octets)} octets, sha256 {hashlib.sha256(octets).hexdigest()}]"
    assert row.raw.endswith(note)
    kept = row.raw.removesuffix(note)
    assert raw.startswith(kept)
    assert len(kept.encode()) <= RAW_BYTES_MAX
    assert len(row.reason) == REASON_CHARACTERS_MAX
    assert RejectedRow(0, row.code, row.reason, row.raw) == row


@pytest.mark.parametrize("length", [0, 1, RAW_BYTES_MAX])
def test_a_content_of_the_limit_is_kept_whole(length: int) -> None:
    assert RejectedRow(0, "MALFORMED_JSON", "", "x" * length).raw == "x" * length


def test_of_many_contents_the_first_are_kept() -> None:
    rows = [RejectedRow(index, "MALFORMED_JSON", "", f"{index:04}" * 500) for index in range(2000)]
    kept = bounded(rows)
    assert [row.index for row in kept] == list(range(2000))
    whole = [row for row, before in zip(kept, rows, strict=True) if row == before]
    assert whole == rows[: RAWS_BYTES_MAX // 2000]
    assert kept[-1].raw.startswith("… [2000 octets, sha256 ")
    assert len("".join(row.raw for row in kept)) < 2 * RAWS_BYTES_MAX


@pytest.mark.parametrize("code", RECOVERABLE)
def test_all_measurements_of_a_long_message_are_kept(code: str) -> None:
    # A feed sends what it has collected while it was cut off: late ones are reprocessed later.
    raw = '{"time_s": 1700000000.125, "sensor_id": "north"}'.ljust(400)
    rows = tuple(RejectedRow(index, code, "", raw) for index in range(40_000))
    assert bounded(rows) == rows
    # Beside others, which have their own limit.
    faulty = [RejectedRow(index, "MALFORMED_JSON", "", raw) for index in range(40_000)]
    kept = bounded([row for both in zip(rows, faulty, strict=True) for row in both])
    assert kept[::2] == rows
    assert [row.raw for row in kept[1::2]].count(raw) == RAWS_BYTES_MAX // 400


def test_measurements_have_a_limit_too() -> None:
    rows = [RejectedRow(index, "TIME_LATE", "", f"{index:04}" * 1000) for index in range(5000)]
    whole = [row for row, before in zip(bounded(rows), rows, strict=True) if row == before]
    assert whole == rows[: MEASUREMENTS_BYTES_MAX // 4000]


def test_other_characters_count_four_octets() -> None:
    rows = [RejectedRow(index, "WRONG_TYPE", "", "ä" * 1000) for index in range(300)]
    whole = [row for row, before in zip(bounded(rows), rows, strict=True) if row == before]
    assert len(whole) == RAWS_BYTES_MAX // 4000


def test_the_hash_beyond_the_limit_is_that_of_what_was_sent() -> None:
    sent = ["x" * 10_000] * 1000
    kept = bounded(RejectedRow(index, "MALFORMED_JSON", "", raw) for index, raw in enumerate(sent))
    digest = hashlib.sha256(sent[-1].encode()).hexdigest()
    assert kept[-1].raw == f"… [10000 octets, sha256 {digest}]"


def _on_disk(folder: Path) -> int:
    # Without the shared index of the write-ahead log, which is memory.
    return sum(one.stat().st_size for one in folder.iterdir() if not one.name.endswith("-shm"))


def test_many_short_rows_take_at_most_twice_their_size_on_disk_and_are_read_back(
    tmp_path: Path,
) -> None:
    digits = np.random.default_rng(4).integers(0, 10, 20_000).tolist()
    rows = tuple(
        RejectedRow(index, "WRONG_TYPE", f"expected an object, was {digit}", str(digit))
        for index, digit in enumerate(digits)
    )
    entry = replace(journal_entry(1), rejects=rows)
    journal = SqliteJournal(tmp_path / "journal.sqlite", "f")
    empty = _on_disk(tmp_path)
    journal.append([entry])
    # Of each row, the message had a digit and the end of a line.
    assert _on_disk(tmp_path) - empty <= 2 * 2 * len(rows)
    assert [stored.entry for stored in journal.read(0)] == [entry]
    assert [one.row for one in journal.quarantined(10_000, 3)] == list(rows[10_000:10_003])
    journal.close()


def test_of_few_long_lines_a_restart_reads_their_beginnings(tmp_path: Path) -> None:
    """Each message of 16 MiB in 114 lines would otherwise cost that much at each start."""
    count = 114
    text = base64.b64encode(np.random.default_rng(5).bytes(12 << 20))
    line = len(text) // count
    body = b"\n".join(text[line * one : line * (one + 1)] for one in range(count))
    rows = tuple(
        RejectedRow(one.index, one.code, one.reason, one.raw) for one in parse_ndjson(body).rejected
    )
    assert len(rows) == count
    assert max(len(row.raw.encode()) for row in rows) <= RAW_BYTES_MAX + NOTE_MAX
    entry = replace(journal_entry(1), rejects=bounded(rows))
    journal = SqliteJournal(tmp_path / "journal.sqlite", "f")
    empty = _on_disk(tmp_path)
    journal.append([entry])
    journal.close()
    kept = count * (RAW_BYTES_MAX + NOTE_MAX + len(rows[0].reason))
    assert _on_disk(tmp_path) - empty <= kept
    tracemalloc.start()
    try:
        journal = SqliteJournal(tmp_path / "journal.sqlite", "f")
        assert [stored.entry for stored in journal.read(0)] == [entry]
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    journal.close()
    assert peak_bytes < 10 * kept < len(body) / 3


def test_a_changed_type_of_the_column_is_damage(tmp_path: Path) -> None:
    rows = tuple(RejectedRow(index, "MALFORMED_JSON", "why", "x") for index in range(1000))
    path = tmp_path / "journal.sqlite"
    journal = SqliteJournal(path, "f")
    journal.append([replace(journal_entry(1), rejects=rows[:1])])
    journal.append([replace(journal_entry(2), rejects=rows)])
    journal.close()
    short = json.dumps([[row.index, row.code, row.reason, row.raw] for row in rows[:1]])
    for sequence, value in ((1, short.encode()), (2, "text")):
        with sqlite3.connect(path) as changed:
            (kept,) = changed.execute(
                "SELECT rejects FROM entry WHERE sequence = ?", (sequence,)
            ).fetchone()
            changed.execute("UPDATE entry SET rejects = ? WHERE sequence = ?", (value, sequence))
        damaged = SqliteJournal(path, "f")
        with pytest.raises(JournalError, match=f"entry {sequence} of the journal is damaged"):
            list(damaged.read(0))
        damaged.close()
        with sqlite3.connect(path) as changed:
            changed.execute("UPDATE entry SET rejects = ? WHERE sequence = ?", (kept, sequence))


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 15, 16, 99_000])
def test_rejects_cost_at_most_twice_the_rows(count: int) -> None:
    random = np.random.default_rng(4)
    digits = random.integers(0, 10, count).tolist()
    rows = tuple(
        RejectedRow(index, "WRONG_TYPE", f"expected an object, was {digit}", str(digit))
        for index, digit in zip(
            np.cumsum(random.integers(1, 3, count)).tolist(), digits, strict=True
        )
    )
    columns = Columns.of(replace(journal_entry(1), rejects=rows))
    assert columns.entry().rejects == rows
    # Rows of two octets, and a fixed part.
    assert len(columns.rejects) <= 2 * 2 * count + 1000


def test_rejects_of_earlier_versions_are_read() -> None:
    rows = [[index, "WRONG_TYPE", "expected an object", "1"] for index in range(50)]
    written = zlib.compress(json.dumps(rows).encode())
    columns = Columns.of(journal_entry(1))._replace(rejects=written)
    assert [[row.index, row.code, row.reason, row.raw] for row in columns.entry().rejects] == rows
