"""The pool that steps aircraft, behind one protocol; its form on threads of this process."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

from multiradar.errors import ConfigurationError
from multiradar.estimation.filters.arrays import Model, Result, Rows, Work
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.tracking.pool import PARTITIONS, AircraftPool

#: Fewer rows than this are processed by one thread.
PARALLEL_ROWS_MIN = 512
#: A partition is not divided.
WORKERS_MAX = PARTITIONS


class StepPool(Protocol):
    """Steps the aircraft of a pool; owned by one thread at a time.

    The output depends neither on the number of workers nor on who steps which partition.
    """

    def step(self, work: Work, rows: Rows, model: Model, result: Result) -> None:
        """Step rows, each partition in its order.

        Parameters
        ----------
        work : Work
            Which rows; its partitions are all that have any.
        rows : Rows
            The measurements.
        model : Model
            Common to all aircraft; another object as soon as any of it has changed.
        result : Result
            Filled for these rows; the sums about the biases are accumulated.
        """
        ...

    def renew(self, aircraft: AircraftPool, model: Model) -> None:
        """Continue with other arrays and another number of biases."""
        ...

    def close(self) -> None:
        """Release threads and processes."""
        ...


#: Opens a pool of steps for a filter, its aircraft and the first model.
OpenStepPool = Callable[[FilterDefinition, AircraftPool, Model], StepPool]


class ThreadStepPool:
    """Steps aircraft on threads of this process.

    Parameters
    ----------
    definition : FilterDefinition
        The filter.
    aircraft : AircraftPool
        The aircraft, by partition.
    workers : int
        Threads, 1 to `WORKERS_MAX`.

    Raises
    ------
    ConfigurationError
        If the number of threads is out of range.
    """

    def __init__(self, definition: FilterDefinition, aircraft: AircraftPool, workers: int) -> None:
        require_workers(workers)
        self._filter, self._pool, self._workers = definition, aircraft, workers
        self._executor = ThreadPoolExecutor(workers, "step") if workers > 1 else None

    def step(self, work: Work, rows: Rows, model: Model, result: Result) -> None:
        """Step rows, each partition in its order."""
        step, aircraft = self._filter.step, self._pool.aircraft
        used = work.partitions
        if self._executor is None or len(work.order) < PARALLEL_ROWS_MIN or len(used) == 1:
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

    def renew(self, aircraft: AircraftPool, model: Model) -> None:
        """Continue with other arrays."""
        self._pool = aircraft

    def close(self) -> None:
        """Stop the threads."""
        if self._executor is not None:
            self._executor.shutdown()


def require_workers(workers: int) -> None:
    """Require a number of workers among which the partitions can be divided.

    Raises
    ------
    ConfigurationError
        If it is out of range.
    """
    if not 1 <= workers <= WORKERS_MAX:
        raise ConfigurationError(f"workers: expected 1 to {WORKERS_MAX}, was {workers}")
