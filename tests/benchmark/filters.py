"""The compiled filters in nanoseconds a plot, for few and many aircraft, few and many radars."""

from itertools import product
from time import perf_counter

import numpy as np

from benchmark.load import Load, make_load
from benchmark.peers import filterpy_nanoseconds
from benchmark.report import Row
from multiradar.estimation.bias.book import BiasBook
from multiradar.estimation.filters._kernels import READOUT_COUNT
from multiradar.estimation.filters._separated_kernels import LOG_COUNT
from multiradar.estimation.filters.arrays import Result
from multiradar.estimation.filters.bank import FILTERS, FilterDefinition
from multiradar.tracking.model import filter_model
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings

AIRCRAFT = (150, 15_000)
RADARS = (3, 8)
REPEATS = 5


def run() -> list[Row]:
    """Measure all filters beside FilterPy's extended Kalman filter on the same plots."""
    rows = []
    for radars, aircraft in product(RADARS, AIRCRAFT):
        load = make_load(aircraft, radars)
        peer = filterpy_nanoseconds(load)
        for name, definition in FILTERS.items():
            label = f"{name}, {aircraft} aircraft, {radars} radars"
            rows.append(
                Row(
                    label, nanoseconds(definition, load), "ns/plot", "FilterPy EKF, no biases", peer
                )
            )
    return rows


def nanoseconds(definition: FilterDefinition, load: Load) -> float:
    """Time the step over all rows in one thread, the aircraft already under way."""
    columns = len(load.sensors.parameter_kind)
    pool = AircraftPool(columns if definition.keeps_sensitivity else 0)
    while len(pool.aircraft.time) <= load.rows.slot.max():
        pool.grow()
    model = filter_model(
        load.sensors, TrackingSettings(), load.plane, BiasBook(load.sensors, definition).state
    )
    count = len(load.rows.slot)
    result = Result(
        np.zeros((PARTITIONS, columns, columns)), np.zeros((PARTITIONS, columns)),
        np.zeros((count, LOG_COUNT)), np.zeros(count, np.int64), np.zeros((count, READOUT_COUNT)),
    )  # fmt: skip
    _, work = pool.work(load.rows.slot, 0)
    best = np.inf
    for repeat in range(REPEATS + 1):
        pool.aircraft.time[:] = np.where(np.isnan(pool.aircraft.time), np.nan, 0.0)
        begin = perf_counter()
        definition.step(work, load.rows, model, pool.aircraft, result, want_readout=False)
        if repeat:
            best = min(best, perf_counter() - begin)
    return best / count * 1e9
