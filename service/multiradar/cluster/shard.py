"""A shard: it owns the states of the aircraft of some partitions, and steps them.

A shard speaks to the front alone. It receives rows of its partitions with the states that the front
has changed since, and answers with their results, their new states and the sums of its partitions.
"""

from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from typing import NamedTuple, TypeVar

import numba
import numpy as np

from multiradar.cluster.packing import Integers, Packing, Words, copied
from multiradar.errors import ConfigurationError
from multiradar.estimation.filters.arrays import (
    Floats,
    Model,
    Result,
    Rows,
    Work,
    result_arrays,
)
from multiradar.estimation.filters.bank import find_filter
from multiradar_compiled.sources import package_folders, sources_digest

Arrays = TypeVar("Arrays", Model, Rows, Work)


@cache
def build() -> str:
    """Return what all processes must have in common: version, sources of kernels, numba."""
    sources = sources_digest(package_folders())
    return f"multiradar {version('multiradar')} {sources} numba {numba.__version__}"


@dataclass(frozen=True, slots=True)
class ShardSpec:
    """What a shard needs to start.

    Attributes
    ----------
    filter_name : str
        The filter.
    packing : Packing
        Of the states of its aircraft.
    partitions : int
        Number of all partitions.
    model : Model
        With which kernels are loaded.
    build : str
        As `build` returns.
    """

    filter_name: str
    packing: Packing
    partitions: int
    model: Model
    build: str


class Batch(NamedTuple):
    """Rows for one shard.

    Attributes
    ----------
    number : int
        Number of the batch, ascending.
    slots : int
        Slots of the pool.
    work : Work
        The rows, in order of the partitions of the shard.
    rows : Rows
        These rows.
    changed : (k,) int64
        Slots whose states the shard does not have.
    states : (k, w) int64
        Their states.
    partitions : (q,) int64
        Partitions whose sums the shard does not have.
    information : (q, c, c) float64
        Their sums.
    vector : (q, c) float64
        Likewise.
    """

    number: int
    slots: int
    work: Work
    rows: Rows
    changed: Integers
    states: Words
    partitions: Integers
    information: Floats
    vector: Floats


class Answer(NamedTuple):
    """What a shard answers to a batch.

    Attributes
    ----------
    number : int
        Number of the batch.
    log, outcome, readout, innovation : ndarray
        As in `Result`, of each row.
    states : (m, w) int64
        States of the aircraft of the rows, by ascending slot.
    information : (w, c, c) float64
        Sums of the partitions of the batch.
    vector : (w, c) float64
        Likewise.
    """

    number: int
    log: Floats
    outcome: Integers
    readout: Floats
    innovation: Floats
    states: Words
    information: Floats
    vector: Floats


class Shard:
    """Steps the aircraft of some partitions.

    Parameters
    ----------
    spec : ShardSpec
        The filter and the form of the states.

    Raises
    ------
    ConfigurationError
        If the front was built from other sources: the output would differ.
    """

    def __init__(self, spec: ShardSpec) -> None:
        own = build()
        if own != spec.build:
            raise ConfigurationError(
                f"cluster: expected {spec.build} on every node, found {own} on one node; install "
                "the same build on all nodes"
            )
        self._filter, self._packing = find_filter(spec.filter_name), spec.packing
        self._aircraft = spec.packing.empty(0)
        columns = len(spec.model.bias)
        self._information = np.zeros((spec.partitions, columns, columns))
        self._vector = np.zeros((spec.partitions, columns))
        self._model = _writable(spec.model)
        none = np.empty(0, np.int64)
        # A step of nothing loads the kernels, or compiles them, before the first batch.
        self._step(Work(none, np.zeros(spec.partitions + 1, np.int64), none), no_rows())

    def step(self, batch: Batch, model: Model | None) -> Answer:
        """Step the rows of a batch.

        Parameters
        ----------
        batch : Batch
            The rows.
        model : Model or None
            Common to all aircraft; None for that of the batch before.

        Returns
        -------
        Answer
            Results and states.
        """
        if model is not None:
            self._model = _writable(model)
        if batch.slots != len(self._aircraft.time):
            self._aircraft = copied(self._aircraft, self._packing.empty(batch.slots))
        self._packing.unpack(batch.states, self._aircraft, batch.changed)
        self._information[batch.partitions] = batch.information
        self._vector[batch.partitions] = batch.vector
        rows, work = _writable(batch.rows), _writable(batch.work)
        result = self._step(work, rows)
        used = work.partitions
        return Answer(
            batch.number, result.log, result.outcome, result.readout, result.innovation,
            self._packing.pack(self._aircraft, slots_of(rows)),
            self._information[used], self._vector[used],
        )  # fmt: skip

    def _step(self, work: Work, rows: Rows) -> Result:
        result = result_arrays(
            len(rows.time), 0, 0, keeps_log=not self._filter.keeps_sensitivity
        )._replace(information=self._information, vector=self._vector)
        self._filter.step(work, rows, self._model, self._aircraft, result, want_readout=True)
        return result


def no_rows() -> Rows:
    """Return no measurements."""
    whole, real = np.empty(0, np.int64), np.empty(0)
    return Rows(whole, real, whole, whole, np.empty((0, 2)), real, whole, whole)


def slots_of(rows: Rows) -> Integers:
    """Return the slots of rows that have one, ascending."""
    return np.unique(rows.slot[rows.slot >= 0])


# What was received without a copy cannot be written; kernels are compiled for arrays that can.
def _writable(received: Arrays) -> Arrays:
    return type(received)._make(np.array(one) for one in received)
