"""The filter step for rows of many tracks; which of them contribute to the biases."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Result, Rows
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.runtime.engine.shared_biases import SharedBiases
from multiradar.runtime.engine.step_pool import OpenStepPool, StepPool, ThreadStepPool
from multiradar.tracking.pool import AircraftPool


class Stepper:
    """Updates the tracks of a pool; the output does not depend on who steps them.

    Parameters
    ----------
    chosen : FilterDefinition
        The filter.
    pool : AircraftPool
        The tracks, by partition.
    biases : SharedBiases
        The biases to which the tracks contribute.
    workers : int
        Threads that step them, 1 to `WORKERS_MAX`.
    open_steps : callable, optional
        Opens another pool in place of threads.
    """

    def __init__(
        self,
        chosen: FilterDefinition,
        pool: AircraftPool,
        biases: SharedBiases,
        workers: int,
        open_steps: OpenStepPool | None = None,
    ) -> None:
        self._filter, self._pool, self._biases = chosen, pool, biases
        self._steps: StepPool = (
            ThreadStepPool(chosen, pool, workers)
            if open_steps is None
            else open_steps(chosen, pool, biases.model)
        )

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

    def renew(self, pool: AircraftPool, biases: SharedBiases) -> None:
        """Continue with other tracks and biases, of the same filter."""
        self._pool, self._biases = pool, biases
        self._steps.renew(pool, biases.model)

    def close(self) -> None:
        """Release threads and processes."""
        self._steps.close()

    def _step_rows(
        self, rows: Rows, result: Result, which: NDArray[np.int64], model: Model
    ) -> None:
        if len(which) == 0:
            return
        _, work = self._pool.work(rows.slot[which], which)
        self._steps.step(work, rows, model, result)
