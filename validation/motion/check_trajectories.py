"""Prints the cost of trajectory bundles in the service: howto/trajectory-service.md.

::

    multiradar convert vid examples/vid-sample converted
    sensors=examples/sensors-vid-sample.toml
    plots=converted/measurements.parquet
    python -m validation.motion.check_trajectories $plots $sensors

    python -m validation.motion.check_trajectories --workers 2 --outputs 10 $plots $sensors

Times are CPU times, the least of three runs. With `--workers`, live bundles of `COPIES` copies of
each track are updated by one and by so many threads in alternation, in the rounds of the service.
"""

import argparse
import os
import tracemalloc
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.queries.parameters import PATH_POINTS_DEFAULT, PATH_STEP_DEFAULT_S
from multiradar.runtime.trajectories.document import trajectories_of
from multiradar.runtime.trajectories.feed import ROUND_PLOTS
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.runtime.trajectories.plots import PlotLocator
from multiradar.runtime.trajectories.pool import BundlePool
from multiradar.runtime.trajectories.roster import Order, PushPlots, Roster, Sampled
from multiradar.runtime.trajectories.waiting import WaitingPlots
from multiradar.storage.recording import Recording
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch

BATCH_ROWS, RUNS, MANY = 200, 3, 100
#: Copies of each track, and the difference of their numbers.
COPIES, APART = 20, 100_000
AIRCRAFT_MAX, LATERAL_MAX_MPS2, LONGITUDINAL_MAX_MPS2 = 1000, 14.0, 4.0
TRACKING = TrackingSettings()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("measurements", type=Path)
    parser.add_argument("sensors", type=Path)
    parser.add_argument("--outputs", type=int, default=60, help=f"of {BATCH_ROWS} measurements")
    parser.add_argument("--workers", type=int, help="compare so many threads with one")
    given = parser.parse_args()
    sensors = load_sensor_table(given.sensors)
    outputs = _outputs(given.measurements, sensors, given.outputs)
    orders = _orders(outputs, sensors)
    if given.workers is not None:
        _compare(_copied(orders), sensors, given.workers)
        return
    plots = _plots(orders)
    all_plots = sum(len(output.plots) for output in outputs)
    sorting_s, pool = _least(lambda: _orders(outputs, sensors)), _pool(orders, sensors)
    taking_s = _least(lambda: _pool(orders, sensors))
    unlearnt: list[Order] = [order for order in orders if not isinstance(order, Sampled)]
    learning_s = taking_s - _least(lambda: _pool(unlearnt, sensors))
    print(f"{plots} plots of {all_plots} to {len(pool)} bundles")
    print(f"engine's thread: {1e6 * sorting_s / all_plots:.1f} µs a plot")
    print(f"bundles' thread: {1e3 * taking_s / plots:.2f} ms a plot, places included")
    print(f"of that to learn from forecasts: {1e3 * learning_s / plots:.3f} ms a plot")
    readings = [pool.read(track) for track in range(1, 200)]
    usable = [one for one in readings if one is not None and len(one.bundle) > 1][:20]
    plane = PlotLocator(sensors, TRACKING).plane

    def answer(points: int) -> Callable[[], None]:
        def answers() -> None:
            for one in usable:
                trajectories_of(1, one, plane, points, PATH_STEP_DEFAULT_S)

        return answers

    for points in (PATH_POINTS_DEFAULT, 0):
        each_s = _least(answer(points)) / len(usable)
        print(f"an answer with at most {points} points: {1e3 * each_s:.1f} ms")
    copying_s = _least(lambda: [one.bundle.copy() for one in usable])
    print(f"of that the bundle is held: {1e3 * copying_s / len(usable):.3f} ms")
    print(f"memory: {_bytes_each(orders, sensors) / 1e6:.3f} MB an aircraft")


def _outputs(path: Path, sensors: SensorTable, count: int) -> list[EngineOutput]:
    engine = Engine(sensors, TRACKING, sampling=Sampling.DRAWN)
    rows = (part for block in Recording(path).blocks() for part in block.iter_slices(BATCH_ROWS))
    return [engine.push(measurement_batch(part, sensors)[0]) for part in islice(rows, count)]


def _orders(outputs: list[EngineOutput], sensors: SensorTable) -> list[Order]:
    roster = Roster(AIRCRAFT_MAX, sensors)
    return [order for output in outputs for order in roster.push(output)]


def _plots(orders: list[Order]) -> int:
    return sum(len(order.plots) for order in orders if isinstance(order, PushPlots))


# More tracks with the same plots, side by side.
def _copied(orders: list[Order]) -> list[Order]:
    return [
        order if isinstance(order, Sampled) else order._replace(track_id=order.track_id + copy)
        for order in orders
        for copy in range(0, 1 if isinstance(order, Sampled) else COPIES * APART, APART)
    ]


def _compare(orders: list[Order], sensors: SensorTable, workers: int) -> None:
    plots = _plots(orders)
    spent: dict[int, list[tuple[float, float]]] = {1: [], workers: []}
    print(f"{plots} plots; the machine has {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    _in_rounds(orders[: COPIES * MANY], sensors, workers)
    for _ in range(RUNS):
        for threads, times in spent.items():
            began_s, began_cpu_s = perf_counter(), process_time()
            _in_rounds(orders, sensors, threads)
            times.append((perf_counter() - began_s, process_time() - began_cpu_s))
            wall, cpu = (1e3 * seconds / plots for seconds in times[-1])
            print(f"{threads} threads: {wall:.3f} ms a plot, {cpu:.3f} ms of processor")
    ratios = [one / other for (one, _), (other, _) in zip(*spent.values(), strict=True)]
    cpu = median(other / one for (_, one), (_, other) in zip(*spent.values(), strict=True))
    print(f"{workers} threads are {median(ratios):.2f} times as fast as one ({min(ratios):.2f} to "
          f"{max(ratios):.2f}), with {cpu:.2f} times the processor time")  # fmt: skip


# As `runtime.trajectories.feed`.
def _in_rounds(orders: list[Order], sensors: SensorTable, workers: int) -> None:
    pool, waiting = _empty(sensors, workers), WaitingPlots(2 * _plots(orders) + len(orders))
    for order in orders:
        waiting.put(order)
    while (following := waiting.pop(ROUND_PLOTS * workers)) is not None:
        if isinstance(following, list):
            pool.push_all(following)
        elif isinstance(following, Sampled):
            pool.sample(following)
        else:
            pool.drop(following.track_id)
    pool.close()


def _empty(sensors: SensorTable, workers: int = 1) -> BundlePool:
    options = trajectory_options(AIRCRAFT_MAX, 1, LATERAL_MAX_MPS2, LONGITUDINAL_MAX_MPS2)
    return BundlePool(PlotLocator(sensors, TRACKING), options.bundle, workers)


def _pool(orders: list[Order], sensors: SensorTable) -> BundlePool:
    pool = _empty(sensors)
    for order in orders:
        if isinstance(order, PushPlots):
            for plot in order.plots:
                pool.push(order.track_id, plot, order.published)
        elif isinstance(order, Sampled):
            pool.sample(order)
        else:
            pool.drop(order.track_id)
    return pool


def _least(work: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        begin_s = process_time()
        work()
        times.append(process_time() - begin_s)
    return min(times)


# Memory of one bundle, without the shared memory.
def _bytes_each(orders: list[Order], sensors: SensorTable) -> float:
    first = next(order for order in orders if isinstance(order, PushPlots))
    pool = _empty(sensors)
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    for track in range(MANY):
        pool.push(track, first.plots[0], first.published)
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return (after - before) / MANY


if __name__ == "__main__":
    main()
