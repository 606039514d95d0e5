"""The filter without biases against FilterPy and Stone Soup: speed and equality of results.

All take the very same plots on a flat plane from the same priors. The estimates must agree to
rounding after every plot, else the benchmark fails.
"""

from math import atan2, hypot
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from benchmark.packages.peers import (
    ACCELERATION_DENSITY,
    AZIMUTH_SIGMA_RAD,
    FILTERPY,
    RANGE_SIGMA_M,
    STONE_SOUP,
    STONE_SOUP_EXACT,
    PeerPlots,
    PeerRun,
    run_filterpy,
    run_stone_soup,
    run_stone_soup_default,
)
from benchmark.plan import Plan
from benchmark.report import Row
from multiradar.estimation.filters.arrays import Rows, result_arrays
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.measurement.kinds import KIND_FLAT_POLAR
from multiradar.research.sequential.arrangement import Options, arrange, initiate
from multiradar.research.sequential.filter import SequentialFilter
from multiradar.research.sequential.sensors import BiasPrior, Sensors, flat_radars

Floats = NDArray[np.float64]

#: All positions have positive coordinates: for others the numerical derivatives of Stone Soup
#: have a step of only 1e-8 m (`np.spacing` is negative there) and errors of metres.
SITES_M = np.array([[300e3, 300e3], [420e3, 260e3], [240e3, 450e3]])
SCANS = 20
#: Number of aircraft for all three filters, and for multiradar alone.
AIRCRAFT, MANY_AIRCRAFT = 12, 4000
#: Rounding of two independent computations over some sixty plots of an aircraft.
POSITION_TOLERANCE_M, SIGMA_TOLERANCE = 1e-7, 1e-9
#: Numerical derivatives have half the digits: metres, and fractions of the sigmas.
DIFFERENCES_TOLERANCE = (1e-3, 1e-5)


def run(plan: Plan) -> list[Row]:
    """Measure and compare.

    Raises
    ------
    AssertionError
        If estimates differ by more than rounding.
    """
    plots, sensors = make_plots(AIRCRAFT), plain_radars()
    ours = our_estimates(plots, sensors)
    runs = 1 if plan.quick else 3
    rows = []
    many = make_plots(plan.size(MANY_AIRCRAFT))
    value = our_nanoseconds(many, sensors, 11)
    label = f"two-stage without biases, {plan.size(MANY_AIRCRAFT)} aircraft, flat plane"
    peers = {
        FILTERPY: (run_filterpy, POSITION_TOLERANCE_M, SIGMA_TOLERANCE),
        STONE_SOUP_EXACT: (run_stone_soup, POSITION_TOLERANCE_M, SIGMA_TOLERANCE),
        STONE_SOUP: (run_stone_soup_default, *DIFFERENCES_TOLERANCE),
    }
    for name, (take, metres, sigmas) in peers.items():
        found = [take(plots) for _ in range(runs)]
        peer = median(one.nanoseconds for one in found)
        position, sigma = differences(ours, found[0])
        print(
            f"two-stage without biases and {name}, after each of {len(plots.rows.slot)} plots: "
            f"apart by {position:.1e} m at most, covariances by {sigma:.1e} of the sigmas",
            flush=True,
        )
        if not (position <= metres and sigma <= sigmas):
            raise AssertionError(
                f"expected the estimates of {name} within {metres} m and {sigmas} of the sigmas, "
                f"was {position} m and {sigma}"
            )
        rows.append(Row(label, value, "ns/plot", 11, name, peer))
        rows.append(Row(f"two-stage without biases, speed over {name}", peer / value, "×", runs))
        rows.append(Row(f"difference of the estimates from {name}", position * 1e9, "nm", 1))
    return rows


def plain_radars() -> Sensors:
    """Return the radars without any bias parameter."""
    none = BiasPrior(np.zeros(0), np.zeros((0, 0)))
    return flat_radars(SITES_M, RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD, none, ())


def flat_polar(radar: int, east: float, north: float) -> tuple[float, ...]:
    """Range, azimuth clockwise from north, and their derivatives by east and north."""
    x, y = east - SITES_M[radar, 0], north - SITES_M[radar, 1]
    r = hypot(x, y)
    return r, atan2(x, y), x / r, y / r, y / r**2, -x / r**2


def make_plots(aircraft: int, seed: int = 3) -> PeerPlots:
    """Straight flights, each detected by every radar every four seconds, at different times.

    Times are whole microseconds, which the time type of Stone Soup can represent.
    """
    rng = np.random.default_rng(seed)
    position = rng.uniform(100e3, 500e3, (aircraft, 2))
    velocity = rng.normal(0.0, 150.0, (aircraft, 2))
    shape = (SCANS, aircraft, len(SITES_M))
    scan, slot, sensor = (index.ravel() for index in np.indices(shape))
    time = np.round(4.0 * (scan + rng.uniform(0.05, 1.0, scan.size)), 6)
    order = np.argsort(time, kind="stable")
    slot, sensor, time = slot[order], sensor[order], time[order]
    line = position[slot] + velocity[slot] * time[:, None] - SITES_M[sensor]
    z = np.column_stack([np.hypot(*line.T), np.arctan2(*line.T)])
    z += rng.normal(size=z.shape) * [RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD]
    start = np.hstack([position + rng.normal(0.0, 500.0, position.shape), 0.0 * velocity])
    kind = np.full(slot.size, KIND_FLAT_POLAR, np.int64)
    rows = Rows(
        slot.astype(np.int64),
        time,
        kind,
        sensor.astype(np.int64),
        z,
        np.zeros(slot.size),
        sensor.astype(np.int64),
        np.full(slot.size, -1, np.int64),
    )
    return PeerPlots(rows, flat_polar, start, np.diag([1e6, 1e6, 1e5, 1e5]))


def our_estimates(plots: PeerPlots, sensors: Sensors) -> PeerRun:
    """Process all plots one by one with the two-stage filter, without biases."""
    options = Options(acceleration_density=ACCELERATION_DENSITY)
    one = SequentialFilter("two-stage", sensors, options=options, aircraft_max=len(plots.mean))
    for slot, mean in enumerate(plots.mean):
        one.start(slot, plots.start_s, mean, plots.covariance)
    rows, found = plots.rows, []
    for slot, time, sensor, z in zip(rows.slot, rows.time, rows.sensor, rows.z, strict=True):
        outcome = one.observe(int(slot), float(time), int(sensor), z)
        assert outcome is Outcome.UPDATED, outcome
        found.append(one.aircraft(int(slot)))
    return PeerRun(np.array([m for m, _ in found]), np.array([c for _, c in found]), float("nan"))


def our_nanoseconds(plots: PeerPlots, sensors: Sensors, runs: int) -> float:
    """Time one call of the compiled step over all plots, with aircraft initiated."""
    rows, count = plots.rows, len(plots.rows.slot)
    options = Options(acceleration_density=ACCELERATION_DENSITY)
    one = arrange("two-stage", sensors, options, slots=len(plots.mean), rows=count)
    result = result_arrays(count, 1, 0, keeps_log=False)
    one.work.bounds[1] = count
    spent = []
    for _ in range(runs + 1):
        for slot, mean in enumerate(plots.mean):
            initiate(one, slot, plots.start_s, mean, plots.covariance)
        first = perf_counter()
        one.definition.step(one.work, rows, one.model, one.aircraft, result, want_readout=False)
        spent.append(perf_counter() - first)
    assert (result.outcome == Outcome.UPDATED).all()
    # The first call may compile.
    return median(spent[1:]) / count * 1e9


def differences(one: PeerRun, other: PeerRun) -> tuple[float, float]:
    """Return the largest difference of positions, m, and of covariances, in units of the sigmas."""
    sigma = np.sqrt(np.diagonal(one.covariance, axis1=1, axis2=2))
    scale = sigma[:, :, None] * sigma[:, None, :]
    apart = np.abs(one.mean - other.mean)[:, :2].max()
    return float(apart), float((np.abs(one.covariance - other.covariance) / scale).max())
