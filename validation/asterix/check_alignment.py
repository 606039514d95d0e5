"""Prints the residuals of each half of the aircraft with the biases fitted to the other half.

::

    multiradar convert asterix RECORDING --sensors sensors.toml --out PLOTS
    python -m validation.asterix.check_alignment PLOTS sensors.toml

The halves are those with an even and with an odd last digit of the Mode 3/A code; each is tracked
and aligned alone. The residuals are of pairs of plots within 0.5 s, of all radars and of those with
a scan period in the sensors file (of known site): as recorded, with the biases of the other half,
and with those fitted to the very pairs.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import polars as pl

from multiradar.cli.alignment.registration import Registration, register
from multiradar.cli.inputs import load_sensor_table
from multiradar.diagnosis.alignment.cross_validation import distances
from multiradar.diagnosis.alignment.fit import fit
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings

APART_MAX_S = 0.5
HALVES = ("even", "odd")


def half(plots: Path, sensors: SensorTable, parity: int) -> Registration:
    """Align the aircraft of one half."""
    table = pl.read_parquet(plots / "measurements.parquet")
    own = table.filter(pl.col("mode_3a").str.slice(-1).cast(pl.Int32) % 2 == parity)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "half.parquet"
        own.write_parquet(path)
        return register(
            Recording(path), sensors, TrackingSettings(), kinds=None, folds=2, workers=1
        )


def row(own: Registration, other: Floats, *, sited: bool) -> str:
    """Return medians and RMS of the pairs of a half as text."""
    problem = own.problem
    chosen = np.abs(problem.pairs.apart_s) <= APART_MAX_S
    if sited:
        known = np.isfinite(own.sensors.rotation_period_s)
        chosen &= known[problem.pairs.first_sensor] & known[problem.pairs.second_sensor]
    best = fit(problem, chosen).estimate
    found = [distances(problem.residuals(one)[chosen]) for one in (0.0 * best, other, best)]
    texts = [f"{one.median_m:.0f}, {one.rms_m:.0f} m" for one in found]
    return " | ".join([str(int(chosen.sum())), *texts])


def main() -> None:
    """Print the figures."""
    plots, listed = map(Path, sys.argv[1:])
    sensors = load_sensor_table(listed)
    found = [half(plots, sensors, parity) for parity in (0, 1)]
    print("| aircraft, radars | pairs | before | biases of the other half | best on these pairs |")
    print("|---|---|---|---|---|")
    for number, name in enumerate(HALVES):
        for what, sited in (("known sites", True), ("all", False)):
            text = row(found[number], found[1 - number].whole.estimate, sited=sited)
            print(f"| {name}, {what} | {text} |")


if __name__ == "__main__":
    main()
