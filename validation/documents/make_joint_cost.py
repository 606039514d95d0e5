"""Draws the cost of the joint filter from the rows of a benchmark.

::

    make bench BENCH_OPTIONS='--only joint-cost'
    python -m validation.documents.make_joint_cost benchmark.json docs/images/joint-cost.svg
"""

import argparse
import json
import re
import sys
from pathlib import Path

import numpy as np

from multiradar.report.content import Plot, Series
from multiradar.report.plot_files import plot_svg


def main() -> None:
    """Read the rows and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("rows", type=Path, help="JSON file that `make bench` wrote")
    parser.add_argument("out", type=Path, help="picture to write, SVG")
    options = parser.parse_args()
    source, target = options.rows, options.out
    rows = [row for row in json.loads(source.read_text()) if row["suite"] == "joint-cost"]
    if not rows:
        sys.exit(f"{source}: expected rows of the suite joint-cost, was none")
    aircraft = np.array([int(re.findall(r"\d+", row["name"])[0]) for row in rows], np.float64)
    series = []
    for name, field in (("joint", "value"), ("two-stage", "peer_value")):
        microseconds = np.array([row[field] for row in rows]) / 1000.0
        series += [
            Series(name, aircraft, microseconds, key=name),
            Series(name, aircraft, microseconds, "points", key=name),
        ]
    plot = Plot(
        title="Cost of a plot against the number of aircraft",
        x_label="aircraft",
        y_label="µs a plot, one core",
        series=tuple(series),
        x_scale="log",
        y_scale="log",
        name="joint-cost",
    )
    target.write_text(plot_svg([plot], plot), encoding="utf-8")


if __name__ == "__main__":
    main()
