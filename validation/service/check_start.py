"""Time of a start by the size of the journal.

    python -m validation.service.check_start [--millions 100] [--starts 3] [--folder FOLDER]

A service processes simulated traffic and is stopped, which writes a snapshot. Its journal is then
made longer at its beginning, by repeated entries of the same traffic, and the snapshot refers to
the last entry of the long journal: a start from a snapshot does not read earlier entries. Services
with an empty, the short and the long journal are started in turn, each with its files on the disk
only, and the time until they accept measurements is measured. 100 million measurements take 14 GB
of disk space.
"""

import argparse
import json
import os
import shutil
import signal
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import httpx
import numpy as np

from multiradar.clock import SystemClock
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from multiradar.storage.entries import Entry
from multiradar.storage.snapshots import Position, SnapshotFolder
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.storage.verification import verify_journal
from validation.service.traffic import Traffic, sensors_text, started

CLOCK = SystemClock()
_AIRCRAFT, _DATA_S = 1000, 240.0
#: Entries that are written in one transaction.
_ENTRIES = 64
_READY_S = 600.0
_LIMIT_S, _RATIO = 5.0, 1.2


def main() -> int:
    """Run and print the times; the exit status is 1 if a start takes longer than the limit."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.check_start")
    parser.add_argument("--millions", type=float, default=100.0, help="of measurements")
    parser.add_argument("--starts", type=int, default=3, help="of each service")
    parser.add_argument("--folder", type=Path, help="for the journals")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        short, long, empty = folder / "short", folder / "long", folder / "empty"
        short.mkdir()
        with Traffic(short, _AIRCRAFT, _DATA_S) as traffic:
            traffic.flush()
        few, many = _lengthened(short, long, 1e6 * options.millions)
        counts = {"empty": 0, "short": few, "long": many}
        taken: dict[str, list[float]] = {kind: [] for kind in counts}
        for _ in range(options.starts):
            for kind in counts:
                if kind == "empty":
                    shutil.rmtree(empty, ignore_errors=True)
                    empty.mkdir()
                _uncache(folder / kind)
                taken[kind].append(_start(folder / kind))
        sizes = {kind: _journal(folder / kind).stat().st_size for kind in counts}
    medians = {kind: float(np.median(times)) for kind, times in taken.items()}
    rows = tuple(
        (kind, f"{counts[kind]:,}", f"{sizes[kind] / 1e9:.1f}", f"{medians[kind]:.2f}",
         f"{max(taken[kind]):.2f}", f"{medians[kind] / medians['empty']:.2f}")
        for kind in counts
    )  # fmt: skip
    titles = ("journal", "measurements", "GB", "median, s", "longest, s", "of the empty one")
    print(markdown_table(Table("Starts", titles, rows)))
    return int(medians["long"] > min(_LIMIT_S, _RATIO * medians["empty"]))


def _journal(folder: Path) -> Path:
    return folder / "state" / "journal.sqlite"


def _lengthened(short: Path, long: Path, measurements: float) -> tuple[int, int]:
    """Write a journal with many earlier entries, and its snapshot; return both measurements."""
    fingerprint = verify_journal(_journal(short)).fingerprint
    source = SqliteJournal(_journal(short), fingerprint)
    own = [stored.entry for stored in source.read(0)]
    source.close()
    target = SqliteJournal(_journal(long), fingerprint)
    filler = [replace(entry, idempotency_key=None) for entry in own]
    rows = sum(entry.accepted for entry in own)
    written, piece = 0, list[Entry]()
    while written + rows < measurements:
        for entry in filler:
            piece.append(entry)
            written += entry.accepted
            if len(piece) == _ENTRIES:
                target.append(piece)
                piece.clear()
    target.append([*piece, *own])
    counts = target.counts()
    position = Position(counts.entries, target.digest(counts.entries))
    target.close()
    before, after = (SnapshotFolder(_journal(folder)) for folder in (short, long))
    snapshot = before.read(before.files()[0])
    shutil.copytree(before.path, after.path)
    for file in after.files():
        file.unlink()
    after.write(snapshot._replace(position=position))
    return rows, counts.accepted


def _uncache(folder: Path) -> None:
    """Have the system read the files from the disk again."""
    for path in folder.rglob("*"):
        if path.is_file():
            with path.open("rb") as stream:
                os.fsync(stream.fileno())
                os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def _start(folder: Path) -> float:
    """Return the time from the start of a process until it accepts measurements, s."""
    begin_s = CLOCK.monotonic_s()
    process = started(folder, sensors_text())
    assert process.stdout is not None, "it is a pipe"
    url = json.loads(process.stdout.readline())["http"]
    with httpx.Client(base_url=url, trust_env=False) as client:
        while (state := client.get("/v1/status").json()["state"]) != "running":
            if CLOCK.monotonic_s() - begin_s > _READY_S:
                raise SystemExit(f"{folder}: {state} after {_READY_S:.0f} s")
            time.sleep(0.01)
    taken_s = CLOCK.monotonic_s() - begin_s
    process.send_signal(signal.SIGTERM)
    process.wait()
    return taken_s


if __name__ == "__main__":
    raise SystemExit(main())
