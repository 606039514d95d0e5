"""Runs all benchmarks, prints their rows and writes them as JSON: `make bench`."""

import argparse
from collections.abc import Callable
from pathlib import Path

from benchmark import filters
from benchmark.report import Row, show, write

SUITES: dict[str, Callable[[], list[Row]]] = {
    "filters": filters.run,
}


def main() -> None:
    """Run the suites asked for."""
    parser = argparse.ArgumentParser(prog="make bench", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("benchmark.json"))
    parser.add_argument("--only", choices=list(SUITES), action="append")
    options = parser.parse_args()
    rows: list[Row] = []
    for name, suite in SUITES.items():
        if options.only is None or name in options.only:
            measured = suite()
            show(measured)
            rows += measured
    write(options.out, rows)


if __name__ == "__main__":
    main()
