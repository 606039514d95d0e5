"""The filter step for rows of many tracks, on one thread or several."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Result, Rows, Work
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.runtime.engine.shared_biases import SharedBiases
from multiradar.tracking.pool import PARTITIONS, AircraftPool

#: Fewer rows than this are processed by one thread.
PARALLEL_ROWS_MIN = 512
WORKERS_MAX = PARTITIONS


class Stepper:
    """Updates the tracks of a pool; the output does not depend on the number of workers.

    Parameters
    ----------
    chosen : FilterDefinition
        The filter.
    pool : AircraftPool
        The tracks, by partition.
    biases : SharedBiases
        The biases to which the tracks contribute.
    workers : int
        Threads, 1 to `WORKERS_MAX`.
    """

    def __init__(
        self, chosen: FilterDefinition, pool: AircraftPool, biases: SharedBiases, workers: int
    ) -> None:
        self._filter, self._pool, self._biases = chosen, pool, biases
        self._workers = workers
        self._executor = ThreadPoolExecutor(workers, "step") if workers > 1 else None

    def step(self, rows: Rows, result: Result, cut: tuple[int, int], model: Model) -> None:
        """Filter rows; excluded tracks do not contribute to the bias estimate."""
        first, last = cut
        every = np.arange(first, last)
        excluded = self._pool.bias_excluded(rows.slot[first:last])
        if not excluded.any() or self._filter.corrects_biases:
            self._step_rows(rows, result, every, model)
            self._biases.log(result.log[first:last], rows.sensor[first:last])
            return
        self.step_some(rows, result, every, excluded, model)

    def step_some(
        self,
        rows: Rows,
        result: Result,
        which: NDArray[np.int64],
        excluded: NDArray[np.bool_],
        model: Model,
    ) -> None:
        """Filter some rows; those marked as excluded do not contribute to the bias estimate."""
        contributing = which[~excluded]
        self._step_rows(rows, result, contributing, model)
        if len(result.log):
            self._biases.log(result.log[contributing], rows.sensor[contributing])
        self._step_rows(rows, self._biases.without_bias_sums(result), which[excluded], model)

    def close(self) -> None:
        """Stop the threads."""
        if self._executor is not None:
            self._executor.shutdown()

    def _step_rows(
        self, rows: Rows, result: Result, which: NDArray[np.int64], model: Model
    ) -> None:
        used, work = self._pool.work(rows.slot[which], which)
        step, aircraft = self._filter.step, self._pool.aircraft
        if self._executor is None or len(which) < PARALLEL_ROWS_MIN or len(used) == 1:
            step(work, rows, model, aircraft, result, want_readout=True)
            return
        parts = [
            Work(used[worker :: self._workers].copy(), work.bounds, work.order)
            for worker in range(self._workers)
        ]
        tasks = [
            self._executor.submit(step, part, rows, model, aircraft, result, want_readout=True)
            for part in parts
        ]
        for task in tasks:
            task.result()
