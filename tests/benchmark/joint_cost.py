"""Cost per plot of the joint and the two-stage filter for increasing numbers of aircraft."""

from statistics import median
from time import perf_counter

import numpy as np

from benchmark.packages.peers import (
    ACCELERATION_DENSITY,
    AZIMUTH_SIGMA_RAD,
    RANGE_SIGMA_M,
    PeerPlots,
)
from benchmark.packages.plain import SITES_M, make_plots
from benchmark.plan import Plan
from benchmark.report import Row
from multiradar.estimation.filters.bank import Outcome
from multiradar.research.sequential.arrangement import Options, arrange, initiate
from multiradar.research.sequential.sensors import BiasPrior, Sensors, flat_radars

TEXT = (
    "The joint filter updates one covariance of all aircraft and biases at every plot. The "
    "two-stage filter gives the same estimates and updates one aircraft. Both process the "
    "same plots of three radars on a flat plane, in one thread, with initiated tracks.\n\n"
    "![Cost of a plot against the number of aircraft](images/joint-cost.svg)\n\n"
    "`python -m validation.documents.make_joint_cost benchmark.json "
    "docs/images/joint-cost.svg` draws it from the rows below."
)
AIRCRAFT = (15, 25, 50, 100, 200, 400)
#: A plot of the joint filter costs milliseconds with many aircraft: this number is timed, or, where
#: plots are cheap, enough for a run of some milliseconds.
PLOTS_LEAST, PLOTS_TIMES_AIRCRAFT = 400, 60_000
RUNS = 7
#: Standard deviations before any plot.
RANGE_BIAS_M, AZIMUTH_BIAS_RAD = 500.0, 0.005


def run(plan: Plan) -> list[Row]:
    """Measure both filters on the same plots."""
    rows, runs = [], 1 if plan.quick else RUNS
    prior = np.tile([RANGE_BIAS_M, AZIMUTH_BIAS_RAD], len(SITES_M))
    sensors = flat_radars(
        SITES_M,
        RANGE_SIGMA_M,
        AZIMUTH_SIGMA_RAD,
        BiasPrior(np.zeros(len(prior)), np.diag(prior**2)),
    )
    for aircraft in AIRCRAFT:
        plots = make_plots(aircraft)
        joint = nanoseconds("joint", plots, sensors, runs)
        other = nanoseconds("two-stage", plots, sensors, 3 * runs)
        peer = f"two-stage, {aircraft} aircraft"
        rows.append(Row(f"joint, {aircraft} aircraft", joint, "ns/plot", runs, peer, other))
    return rows


def nanoseconds(name: str, plots: PeerPlots, sensors: Sensors, runs: int) -> float:
    """Time one call of the compiled step over the first plots, with every aircraft initiated."""
    wanted = max(PLOTS_LEAST, PLOTS_TIMES_AIRCRAFT // len(plots.mean))
    count = min(wanted, len(plots.rows.slot))
    options = Options(acceleration_density=ACCELERATION_DENSITY)
    spent = []
    for _ in range(runs + 1):
        one = arrange(name, sensors, options, slots=len(plots.mean), rows=len(plots.rows.slot))
        one.work.bounds[1] = count
        for slot, mean in enumerate(plots.mean):
            initiate(one, slot, plots.start_s, mean, plots.covariance)
        first = perf_counter()
        one.definition.step(
            one.work, plots.rows, one.model, one.aircraft, one.result, want_readout=False
        )
        spent.append(perf_counter() - first)
        assert (one.result.outcome[:count] == Outcome.UPDATED).all()
    # The first call may compile.
    return median(spent[1:]) / count * 1e9
