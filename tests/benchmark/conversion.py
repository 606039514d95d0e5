"""The dump converter beside a plain reading of the same files."""

import shutil
from pathlib import Path
from statistics import median
from time import perf_counter

import polars as pl

from benchmark.converter import FILES, measure
from benchmark.plan import Plan
from benchmark.report import Row

TEXT = (
    "`multiradar convert vid` in a process of its own, its start and all outputs included: the "
    "sample dump repeated and shifted in time. The peer is polars, which reads the same three "
    "files as tables with all cores, joins nothing, checks nothing and writes nothing. "
    "`make bench BENCH_OPTIONS='--only converter --gigabytes 2'` measures a large dump."
)
#: A dump larger than this is converted once.
REPEATED_GIGABYTES = 0.5
QUICK_GIGABYTES = 0.02
PEER = "polars scan_csv"


def run(plan: Plan) -> list[Row]:
    """Convert a dump of the size of the plan."""
    size = (QUICK_GIGABYTES if plan.quick else plan.gigabytes) * 1e9
    runs = plan.runs if plan.gigabytes <= REPEATED_GIGABYTES else 1
    found: dict[tuple[str, str], list[float]] = {}
    plain = []
    for number in range(runs):
        folder = plan.folder / str(number)
        folder.mkdir()
        for name, value, unit in measure(folder, size, new_aircraft=False):
            found.setdefault((name, unit), []).append(value)
        plain.append(_plain(folder / "dump"))
        shutil.rmtree(folder)
    return [
        Row(name, median(values), unit, runs, PEER, median(plain))
        if unit == "MB/s"
        else Row(name, median(values), unit, runs)
        for (name, unit), values in found.items()
    ]


def _plain(dump: Path) -> float:
    """Return megabytes a second of reading the files, in bounded memory."""
    read = sum((dump / name).stat().st_size for name in FILES)
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
    return read / (perf_counter() - begin) / 1e6
