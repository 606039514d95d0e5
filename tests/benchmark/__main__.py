"""Runs all benchmarks, prints their rows and writes them as JSON: `make bench`."""

import argparse
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from benchmark import (
    conversion,
    encounters,
    filters,
    joint_cost,
    offline,
    tracker,
)
from benchmark.plan import Plan
from benchmark.report import Row, show, write, write_markdown
from benchmark.service import ingest, ingest_stages, queries, snapshots, updates

#: Subject and method of each suite.
SUITES: dict[str, tuple[str, Callable[[Plan], list[Row]]]] = {
    "filters": (filters.TEXT, filters.run),
    "joint-cost": (joint_cost.TEXT, joint_cost.run),
    "offline": (offline.TEXT, offline.run),
    "tracker": (tracker.TEXT, tracker.run),
    "ingest": (ingest.TEXT, ingest.run),
    "ingest-stages": (ingest_stages.TEXT, ingest_stages.run),
    "snapshots": (snapshots.TEXT, snapshots.run),
    "queries": (queries.TEXT, queries.run),
    "encounters": (encounters.TEXT, encounters.run),
    "zenoh": (updates.TEXT, updates.run),
    "converter": (conversion.TEXT, conversion.run),
}
GIGABYTES = 0.1


def main() -> None:
    """Run the selected suites."""
    options = _options()
    load_before = os.getloadavg()[0]
    measured: dict[str, list[Row]] = {}
    for name, (_, suite) in SUITES.items():
        if options.only is not None and name not in options.only:
            continue
        begin = perf_counter()
        with tempfile.TemporaryDirectory(prefix=f"bench-{name}-", dir=options.folder) as folder:
            measured[name] = suite(Plan(Path(folder), options.quick, options.gigabytes))
        print(f"\n{name} ({perf_counter() - begin:.0f} s)")
        show(measured[name])
    write(options.out, measured)
    if options.markdown is not None:
        texts = {name: text for name, (text, _) in SUITES.items()}
        write_markdown(options.markdown, measured, texts, _command(options), load_before)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("benchmark.json"))
    parser.add_argument("--markdown", type=Path, help="write the figures as a document, too")
    parser.add_argument("--only", choices=list(SUITES), action="append", help="one suite; repeat")
    parser.add_argument("--quick", action="store_true", help="small loads, few runs")
    parser.add_argument("--gigabytes", type=float, default=GIGABYTES, help="dump of the converter")
    parser.add_argument("--folder", type=Path, help="where to work; its disk is measured")
    return parser.parse_args()


def _command(options: argparse.Namespace) -> str:
    given = [f"--only {name}" for name in options.only or ()]
    given += ["--quick"] if options.quick else []
    given += [] if options.gigabytes == GIGABYTES else [f"--gigabytes {options.gigabytes:g}"]
    given.append("--markdown ../docs/validation/benchmarks.md")
    return f"make bench BENCH_OPTIONS='{' '.join(given)}'"


if __name__ == "__main__":
    main()
