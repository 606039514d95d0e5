"""The dump converter against a plain reading of the same files."""

import csv
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median
from time import perf_counter

import polars as pl

from benchmark.converter import FILES, make_dump
from benchmark.plan import Plan
from benchmark.report import Row
from support.paths import TESTS

TEXT = (
    "`multiradar convert vid` in its own process, including start and all outputs. Input: the "
    "sample dump, repeated and shifted in time. Peer: polars, which reads the same three "
    "files as tables with all cores, and neither joins, validates nor writes. `make bench "
    "BENCH_OPTIONS='--only converter --gigabytes 2'` measures a large dump, in which the "
    "start of the process is negligible."
)
#: A dump larger than this is converted once.
REPEATED_GIGABYTES = 0.5
QUICK_GIGABYTES = 0.02
PEER = "polars scan_csv"


def run(plan: Plan) -> list[Row]:
    """Convert a dump of the size of the plan."""
    gigabytes = QUICK_GIGABYTES if plan.quick else plan.gigabytes
    runs = plan.runs if gigabytes <= REPEATED_GIGABYTES else 1
    found: dict[tuple[str, str], list[float]] = {}
    plain = []
    for _ in range(runs):
        for name, value, unit in _measure(plan.folder, gigabytes):
            found.setdefault((name, unit), []).append(value)
        plain.append(_plain(plan.folder / "dump", gigabytes * 1e9))
    return [
        Row(name, median(values), unit, runs, PEER, median(plain))
        if unit == "MB/s"
        else Row(name, median(values), unit, runs)
        for (name, unit), values in found.items()
    ]


def _measure(folder: Path, gigabytes: float) -> list[tuple[str, float, str]]:
    # By a small process: the peak size of a child reported by the system starts with the size of
    # its parent, and this one has held large tables.
    command = [sys.executable, "-m", "benchmark.converter"]
    command += ["--gigabytes", str(gigabytes), "--folder", str(folder)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=TESTS)
    _, *rows = csv.reader(done.stdout.splitlines())
    return [(name, float(value), unit) for name, value, unit in rows]


def _plain(dump: Path, size: float) -> float:
    """Return megabytes a second of reading the files, in bounded memory."""
    read = make_dump(dump, size, new_aircraft=False)
    begin = perf_counter()
    for name in FILES:
        pl.scan_csv(
            dump / name,
            separator="\t",
            quote_char=None,
            ignore_errors=True,
            truncate_ragged_lines=True,
            encoding="utf8-lossy",
        ).select(pl.all().null_count()).collect(engine="streaming")
    elapsed_s = perf_counter() - begin
    shutil.rmtree(dump)
    return read / elapsed_s / 1e6
