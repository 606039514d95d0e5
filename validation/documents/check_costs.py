"""Measures the cost of each option of `multiradar track` on the sample recording.

::

    python -m validation.documents.check_costs

Prints CPU time per plot against a run without the option, and the size of the output. Runs are
paired: each run with an option is compared with the plain run right before it. The first round
compiles kernels and is excluded.
"""

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import polars as pl

from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Name of the file for `--asterix`.
ASTERIX_FILE = "tracks.ast"
OPTIONS: dict[str, tuple[str, ...]] = {
    "--manoeuvre-planes 60": ("--manoeuvre-planes", "60"),
    "--observability 60": ("--observability", "60"),
    "--encounters 120": ("--encounters", "120"),
    "--forecasts 60": ("--forecasts", "60"),
    "--asterix FILE": ("--asterix", ASTERIX_FILE),
    "--trajectories": ("--trajectories",),
    "--trajectories --forecasts 60": ("--trajectories", "--forecasts", "60"),
    "--filter imm": ("--filter", "imm"),
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=3, help="rounds that count")
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        converted = folder / "converted"
        call("convert", "vid", EXAMPLES / "vid-sample", converted, "--date", "2018-08-01")
        kinds = pl.read_parquet(converted / "measurements.parquet")["kind"]
        plots = int((kinds == "radar").sum())
        track(converted, folder / "first", ())
        plain_s: list[float] = []
        rows = []
        for name, options in OPTIONS.items():
            track(converted, folder / "warm", options)
            more_s, size = [], 0
            for number in range(rounds):
                before_s, least = track(converted, folder / f"plain-{number}", ())
                option_s, size = track(converted, folder / f"option-{number}", options)
                more_s.append(option_s - before_s)
                plain_s.append(before_s)
                size -= least
            cost_ms = 1000.0 * statistics.median(more_s) / plots
            rows.append((f"`{name}`", f"{cost_ms:.2f}", f"{size / 1e6:.1f}"))
    header = ("option", "CPU, ms per plot", "output, MB")
    caption = f"Without options {statistics.median(plain_s):.1f} s CPU for {plots} plots."
    print(markdown_table(Table("Costs", header, tuple(rows), caption)))


def track(converted: Path, out: Path, options: tuple[str, ...]) -> tuple[float, int]:
    """Track the sample; return the processor time, s, and the size of the output, bytes."""
    asterix = out.with_suffix(".ast")
    given = [str(asterix) if one == ASTERIX_FILE else one for one in options]
    sensors = EXAMPLES / "sensors-vid-sample.toml"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    call("track", converted, "--sensors", sensors, "--kinds", "radar", "--out", out, *given)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    files = [*out.iterdir(), *([asterix] if asterix.exists() else [])]
    size = sum(one.stat().st_size for one in files)
    for one in files:
        one.unlink()
    out.rmdir()
    return (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime), size


def call(*arguments: object) -> None:
    """Run a command of the program, or stop."""
    line = [sys.executable, "-m", "multiradar", *map(str, arguments)]
    subprocess.run(line, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
