"""Compiled filters, ns per plot, for few and many aircraft and radars."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product
from statistics import median
from time import perf_counter

import numpy as np

from benchmark.packages import plain
from benchmark.packages.peers import (
    FILTERPY,
    STONE_SOUP,
    filterpy_nanoseconds,
    stone_soup_nanoseconds,
)
from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.load import Load, make_load
from multiradar.estimation.bias.estimator import BiasEstimator
from multiradar.estimation.filters.arrays import Work, result_arrays
from multiradar.estimation.filters.bank import FILTERS, FilterDefinition
from multiradar.tracking.model import filter_model
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings

TEXT = (
    "One call of the compiled step over all plots, with initiated tracks, without input and "
    "output. The peers step the same plots one by one, with four states and no biases. The "
    "first rows are the two-stage filter without biases on a flat plane: its estimates after "
    "every plot are compared with those of the peers, and the run fails if they differ by "
    "more than rounding. Stone Soup computes derivatives by differences; with exact ones it "
    "agrees as closely as FilterPy."
)
AIRCRAFT = (150, 4_000, 15_000)
RADARS = (3, 8)
#: Aircraft and radars of the load that two threads share.
THREADED = (4_000, 8)
#: A run takes milliseconds.
RUNS = 11


def run(plan: Plan) -> list[Row]:
    """Measure all filters against FilterPy and Stone Soup on the same plots."""
    rows = plain.run(plan)
    runs = 3 if plan.quick else RUNS
    for radars, aircraft in product(RADARS, AIRCRAFT):
        load = make_load(plan.size(aircraft), radars)
        peers = {FILTERPY: filterpy_nanoseconds(load), STONE_SOUP: stone_soup_nanoseconds(load)}
        for name, definition in FILTERS.items():
            if definition.aircraft_max is not None and aircraft > definition.aircraft_max:
                continue  # The joint filter has no room for so many.
            label = f"{name}, {plan.size(aircraft)} aircraft, {radars} radars"
            value = nanoseconds(definition, load, runs)
            rows += [Row(label, value, "ns/plot", runs, *peer) for peer in peers.items()]
            if (aircraft, radars) == THREADED:
                rows.append(_threaded(label, definition, load, runs))
    return rows


def _threaded(label: str, definition: FilterDefinition, load: Load, runs: int) -> Row:
    # Both together, so that other load of the machine affects both.
    one = nanoseconds(definition, load, runs)
    two = nanoseconds(definition, load, runs, threads=2)
    return Row(f"{label}, two threads", 1e3 / two, "plots/µs", runs, "one thread", 1e3 / one)


def nanoseconds(definition: FilterDefinition, load: Load, runs: int, *, threads: int = 1) -> float:
    """Time the step over all rows, with aircraft already initiated.

    Each thread takes whole partitions, as in the service.
    """
    columns = len(load.sensors.parameter_kind)
    model = filter_model(
        load.sensors, TrackingSettings(), load.plane, BiasEstimator(load.sensors, definition).state
    )
    pool = AircraftPool(definition, columns, len(load.sensors), len(model.modes))
    while len(pool.aircraft.time) <= load.rows.slot.max():
        pool.grow()
    count = len(load.rows.slot)
    result = result_arrays(count, PARTITIONS, columns)
    used, work = pool.work(load.rows.slot, np.arange(len(load.rows.slot)))
    shares = [Work(used[one::threads].copy(), work.bounds, work.order) for one in range(threads)]
    found = []

    def process(share: Work) -> None:
        definition.step(share, load.rows, model, pool.aircraft, result, want_readout=False)

    with ThreadPoolExecutor(threads) as executor:
        for _ in range(runs + 1):
            pool.aircraft.time[:] = np.where(np.isnan(pool.aircraft.time), np.nan, 0.0)
            begin = perf_counter()
            list(executor.map(process, shares))
            found.append(perf_counter() - begin)
    # The first call initiates aircraft, and may compile.
    return median(found[1:]) / count * 1e9
