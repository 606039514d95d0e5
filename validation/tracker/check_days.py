"""Tests the comparison of days of archives on simulated days: p-values, and a drift with a step.

::

    python -m validation.tracker.check_days [RUNS]

Three radars and twelve aircraft for four minutes of each day. Without a change, p-values of all
differences and of all scatters must be uniform: given are the fractions below 5 % and 50 %, and the
p-value of a Kolmogorov-Smirnov test, for independent and for chained days. With a drift of 10 m per
day and a step of 60 m of one radar: errors in sigma, and where the step is found.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from scipy.stats import kstest

import multiradar as mr
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.toolbox.tracking.reprocessing.days import Day
from multiradar.toolbox.tracking.reprocessing.periods import (
    MERGED_FILE,
    STEPS_FILE,
    Frames,
    Period,
)
from multiradar.toolbox.tracking.reprocessing.records import DayRecord
from validation.tracker.archive_days import date_of, write_days

RUNS, DAYS = 60, 3
DRIFT_M, STEP_M = 10.0, 60.0
CHANGES_M = {"drift": [0.0, 10.0, 20.0, 30.0], "step": [0.0, 0.0, STEP_M, STEP_M]}


def compared(east_m: Sequence[float], seed: int, *, chained: bool = False) -> Frames:
    """Return the tables of days with a change of the range offset of the radar east."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sensors = write_days(folder / "days", east_m, seed=seed)
        days: list[tuple[Day, Path, DayRecord]] = []
        for date in map(date_of, range(len(east_m))):
            day, out = Day("", date, folder / "days" / date), folder / date
            before = days[-1][0].date if days and chained else ""
            start = folder / before if before else None
            run = mr.track(day.path, sensors, out=out, biases_from=start)
            assert run.span_s is not None
            days.append((day, out, DayRecord("", "", "", before, "", "", *run.span_s)))
        return Period("", days, load_sensor_table(sensors)).frames()


def without_a_change(runs: int, *, chained: bool) -> None:
    """Print whether p-values are uniform."""
    found = [compared([0.0] * DAYS, seed, chained=chained) for seed in range(1, runs + 1)]
    how = "chained" if chained else "independent"
    for what, file, column in (
        ("differences between days", STEPS_FILE, "p_value"),
        ("scatter between days", MERGED_FILE, "p_value"),
        ("linear drift", MERGED_FILE, "drift_p_value"),
    ):
        p = pl.concat([one[file] for one in found])[column].drop_nulls().to_numpy()
        print(
            f"| {how} | {what} | {len(p)} | {np.mean(p < 0.05):.1%} | {np.mean(p < 0.5):.0%} "
            f"| {kstest(p, 'uniform').pvalue:.2f} |"
        )


def with_a_change(runs: int) -> None:
    """Print how a drift and a step are recovered."""
    rows = pl.concat(
        [compared(CHANGES_M["drift"], 500 + seed)[MERGED_FILE] for seed in range(runs)]
    )
    east = rows.filter(sensor_id="east", parameter="range_offset_m")
    sigma = east["drift_sigma_per_day"].to_numpy()
    error = (east["drift_per_day"].to_numpy() - DRIFT_M) / sigma
    print(
        f"drift of {DRIFT_M:g} m per day: sigma {sigma.mean():.2f} m, mean "
        f"error {error.mean():+.2f} sigma, RMS {np.sqrt(np.mean(error**2)):.2f}, largest "
        f"{np.abs(error).max():.1f}"
    )
    steps = pl.concat([compared(CHANGES_M["step"], 700 + seed)[STEPS_FILE] for seed in range(runs)])
    stepped = (
        (pl.col("sensor_id") == "east")
        & (pl.col("parameter") == "range_offset_m")
        & (pl.col("day") == date_of(2))
    )
    own, others = steps.filter(stepped), steps.filter(~stepped)
    error = ((own["difference"] - STEP_M) / own["sigma"]).to_numpy()
    print(
        f"step of {STEP_M:g} m: above 4 sigma in {(own['chi2'] > 16.0).sum()} of {len(own)} runs, "
        f"RMS error {np.sqrt(np.mean(error**2)):.2f} sigma; other differences above 4 sigma: "
        f"{(others['chi2'] > 16.0).sum()} of {len(others)}"
    )


def main() -> None:
    """Print all figures."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    print("| days | test | number | below 5 % | below 50 % | p (Kolmogorov-Smirnov) |")
    print("|---|---|---|---|---|---|")
    for chained in (False, True):
        without_a_change(runs, chained=chained)
    with_a_change(max(runs // 3, 1))


if __name__ == "__main__":
    main()
