"""Prints the residuals of each half of the aircraft with the biases fitted to the other half.

::

    multiradar convert asterix RECORDING --sensors sensors.toml --out PLOTS
    python -m validation.asterix.check_alignment PLOTS sensors.toml

The halves are those with an even and with an odd last digit of the Mode 3/A code; each is tracked
and aligned alone. The residuals are of pairs of plots within 0.5 s, of all radars and of those with
a scan period in the sensors file (of known site): as recorded, with the biases of the other half,
and with those fitted to the very pairs.

The last columns show whether the excess of the median over the best fit is more than chance: beside
it stands the excess where offsets and random errors are all there is. For that the residuals of the
best fit replace the recorded ones in both halves, their sign drawn for each aircraft (wild
bootstrap by clusters), with the noise of the recording; the median and the 5th to 95th percentile.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.cross_validation import distances
from multiradar.diagnosis.alignment.fit import Problem, fit
from multiradar.diagnosis.alignment.linear import Noise
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.storage.recording import Recording
from multiradar.toolbox.alignment.registration import Registration, register
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.settings import TrackingSettings

APART_MAX_S = 0.5
HALVES = ("even", "odd")
SEED = 15


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
    problem, chosen = own.problem, close(own, sited=sited)
    best = fit(problem, chosen).estimate
    found = [distances(problem.residuals(one)[chosen]) for one in (0.0 * best, other, best)]
    texts = [f"{one.median_m:.0f}, {one.rms_m:.0f} m" for one in found]
    return " | ".join([str(int(chosen.sum())), *texts])


def close(own: Registration, *, sited: bool) -> NDArray[np.bool_]:
    """Return which pairs of a half are compared."""
    pairs = own.problem.pairs
    chosen = np.abs(pairs.apart_s) <= APART_MAX_S
    if sited:
        known = np.isfinite(own.sensors.rotation_period_s)
        chosen &= known[pairs.first_sensor] & known[pairs.second_sensor]
    return chosen


def mirrored(own: Registration, rng: np.random.Generator) -> Problem:
    """Return the pairs with the residuals of the whole fit, those of each aircraft of one sign."""
    pairs, left = own.problem.pairs, own.problem.residuals(own.whole.estimate)
    _, number = np.unique(pairs.aircraft, return_inverse=True)
    sign = rng.choice([-1.0, 1.0], number.max() + 1)[number]
    return Problem(replace(pairs, apart_m=sign[:, None] * left), own.sensors)


def excess(
    problem: Problem, chosen: NDArray[np.bool_], other: Floats, noise: Noise | None = None
) -> float:
    """Return by which fraction the median with other biases exceeds that of the best fit."""
    best = fit(problem, chosen, noise).estimate
    medians = [distances(problem.residuals(one)[chosen]).median_m for one in (other, best)]
    return medians[0] / medians[1] - 1.0


def chance(found: list[Registration], draws: int) -> dict[tuple[int, bool], Floats]:
    """Return the excess by chance of each half and selection of radars, for each draw."""
    rng = np.random.Generator(np.random.PCG64(SEED))
    cases = [(number, sited) for number in range(len(HALVES)) for sited in (True, False)]
    values: dict[tuple[int, bool], list[float]] = {case: [] for case in cases}
    for _ in range(draws):
        problems = [mirrored(one, rng) for one in found]
        whole = [
            fit(one, np.ones(one.pairs.size, np.bool_), own.whole.noise).estimate
            for one, own in zip(problems, found, strict=True)
        ]
        for number, sited in cases:
            own, other = found[number], whole[1 - number]
            chosen = close(own, sited=sited)
            values[number, sited].append(excess(problems[number], chosen, other, own.whole.noise))
    return {case: np.array(one) for case, one in values.items()}


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("plots", type=Path)
    parser.add_argument("sensors", type=Path)
    parser.add_argument("--draws", type=int, default=200, help="draws of signs; 0 for none")
    options = parser.parse_args()
    sensors = load_sensor_table(options.sensors)
    found = [half(options.plots, sensors, parity) for parity in (0, 1)]
    names = ["pairs", "before", "biases of the other half", "best on these pairs"]
    names += ["excess of the median", "by chance: median, 5 to 95 %"] if options.draws else []
    print(f"| aircraft, radars | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    random = chance(found, options.draws)
    for number, name in enumerate(HALVES):
        for what, sited in (("known sites", True), ("all", False)):
            own, other = found[number], found[1 - number].whole.estimate
            text = row(own, other, sited=sited)
            if options.draws:
                now = 100.0 * excess(own.problem, close(own, sited=sited), other)
                least, usual, most = 100.0 * np.quantile(random[number, sited], (0.05, 0.5, 0.95))
                text += f" | {now:+.1f} % | {usual:+.1f} %, {least:+.1f} to {most:+.1f} %"
            print(f"| {name}, {what} | {text} |")


if __name__ == "__main__":
    main()
