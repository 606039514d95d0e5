"""The front of a cluster: it places partitions on shards and keeps a mirror of their states.

The states in the `AircraftPool` of the front are complete after every step. Association, forecasts
and snapshots read them, and some steps change them: those of shared plots, initiation by bearings,
drift of the biases. So with each batch a shard receives the states of its rows that differ from
what it last answered. A partition that comes to a shard, at first, by migration or after a loss, is
one of which nothing is known: its states come with its next batches, and nothing has to be moved.

The front steps the partitions of a lost shard itself, from the batch without an answer on, until
another shard is ready. A partition has one owner at any time. What a lost shard may still answer is
not received, so output cannot depend on it.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from multiradar.clock import Clock, SystemClock
from multiradar.cluster.hosts import ShardHost, ShardLink
from multiradar.cluster.packing import Integers, Packing
from multiradar.cluster.shard import Answer, Batch, ShardSpec, build, slots_of
from multiradar.errors import ConfigurationError, MultiradarError, PeerError
from multiradar.estimation.filters.arrays import Model, Result, Rows, Work, partition_of
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.runtime.engine.step_pool import require_workers
from multiradar.tracking.pool import PARTITIONS, AircraftPool

_log = logging.getLogger("multiradar.cluster")

#: Owner of the partitions that the front steps itself.
FRONT = -1
#: Time for the first start of the shards, s: each process loads the kernels, or compiles them.
START_S = 300.0
#: Pause before a shard that could not start is started again, s.
RESTART_PAUSE_S = 5.0


@dataclass(slots=True)
class ClusterCounts:
    """What became of the batches of a front.

    Attributes
    ----------
    batches, rows, rows_of_front : int
        Batches sent, rows in them, and rows that the front stepped itself.
    octets_sent, octets_received : int
        Octets of arrays in batches and answers.
    lost, restored : int
        Shards lost, and started again.
    recovery_s : float or None
        Time from the last loss until the shard had its partitions again, s.
    """

    batches: int = 0
    rows: int = 0
    rows_of_front: int = 0
    octets_sent: int = 0
    octets_received: int = 0
    lost: int = 0
    restored: int = 0
    recovery_s: float | None = None


@dataclass(slots=True)
class _Place:
    # A shard's place: its connection if it runs or starts, and its partitions when it does.
    number: int
    partitions: Integers
    link: ShardLink | None = None
    generation: int = 0
    is_ready: bool = False
    model: Model | None = None
    lost_s: float | None = None
    retry_s: float = 0.0


@dataclass(slots=True)
class _Sent:
    # A batch without an answer so far, and the rows and slots that the answer is about.
    place: _Place
    work: Work
    batch: Batch
    rows: Integers
    slots: Integers
    failure: PeerError | None = None


class ShardedSteps:
    """Steps the aircraft of a pool on shards; owned by one thread at a time.

    Parameters
    ----------
    definition : FilterDefinition
        The filter.
    aircraft : AircraftPool
        The aircraft; the front's mirror of the states of all shards.
    model : Model
        The first model.
    host : ShardHost
        Starts shards. It is closed with this object.
    shards : int
        Their number, 1 to the number of partitions.
    deadline_s : float
        A shard that does not answer a batch for so long is lost, s.
    clock : Clock, optional
        Measures the time of recoveries.

    Raises
    ------
    ConfigurationError
        If the filter updates all aircraft with every plot, or the number of shards is out of range.
    PeerError
        If the shards do not start.
    """

    def __init__(
        self,
        definition: FilterDefinition,
        aircraft: AircraftPool,
        model: Model,
        host: ShardHost,
        *,
        shards: int,
        deadline_s: float,
        clock: Clock | None = None,
    ) -> None:
        require_workers(shards)
        if definition.corrects_biases:
            raise ConfigurationError(
                f"engine: expected threads with the filter {definition.name}, which updates all "
                f"aircraft with every plot, was ray"
            )
        self._filter, self._host = definition, host
        self._deadline_s, self._clock = deadline_s, clock or SystemClock()
        self._begin(aircraft, model)
        self.owner = np.full(PARTITIONS, FRONT, np.int64)
        self._places = [_Place(n, np.arange(n, PARTITIONS, shards)) for n in range(shards)]
        self.counts = ClusterCounts()
        try:
            self._start()
        except MultiradarError:
            self.close()
            raise

    def step(self, work: Work, rows: Rows, model: Model, result: Result) -> None:
        """Step rows, each partition in its order."""
        self._adopt()
        self._resize()
        sent = [
            self._send(place, part, rows, model, result)
            for place in self._places
            if (part := self._part(work, place.number)) is not None
        ]
        self._step_here(self._part(work, FRONT), rows, model, result)
        for one in sent:
            self._receive(one, rows, model, result)

    def place(self, partitions: Sequence[int], shard: int) -> None:
        """Move partitions to a shard, between two steps.

        Parameters
        ----------
        partitions : sequence of int
            Which partitions.
        shard : int
            Number of the shard. Until it is ready, the front has them.
        """
        moved = np.asarray(partitions, np.int64)
        for place in self._places:
            place.partitions = np.setdiff1d(place.partitions, moved)
        target = self._places[shard]
        target.partitions = np.union1d(target.partitions, moved)
        self._give(moved, shard if target.is_ready else FRONT)

    def renew(self, aircraft: AircraftPool, model: Model) -> None:
        """Continue with other arrays and another number of biases: with new shards.

        Until they are ready, the front steps the aircraft.
        """
        for place in self._places:
            if place.link is not None:
                place.link.stop()
            place.link, place.is_ready, place.lost_s = None, False, None
        self.owner[:] = FRONT
        self._begin(aircraft, model)

    def document(self) -> dict[str, Any]:
        """Return state and counts for the status of the service."""
        counts = self.counts
        return {
            "shards": len(self._places),
            "shards_ready": sum(place.is_ready for place in self._places),
            "partitions_of_front": int((self.owner == FRONT).sum()),
            **{name: getattr(counts, name) for name in counts.__slots__},
        }

    def close(self) -> None:
        """End the shards and leave the host."""
        for place in self._places:
            if place.link is not None:
                place.link.stop()
        self._host.close()

    # ---------------------------------------------------------------- shards

    # Nothing is known of what shards have.
    def _begin(self, aircraft: AircraftPool, model: Model) -> None:
        self._pool, self._packing = aircraft, Packing.of(aircraft.aircraft)
        self._spec = ShardSpec(self._filter.name, self._packing, PARTITIONS, model, build())
        self._known = np.zeros(0, np.bool_)
        self._shadow = np.zeros((0, self._packing.width), np.int64)
        columns = len(model.bias)
        self._sums = np.zeros((PARTITIONS, columns, columns)), np.zeros((PARTITIONS, columns))
        self._sums_known = np.zeros(PARTITIONS, np.bool_)

    def _start(self) -> None:
        for place in self._places:
            self._start_link(place)
        for place in self._places:
            assert place.link is not None
            if not place.link.is_ready(START_S):
                raise PeerError(
                    f"cluster: expected {len(self._places)} shards within {START_S:.0f} s, but "
                    f"shard {place.number} has not started; check that enough CPUs are free"
                )
            self._take_over(place)

    def _start_link(self, place: _Place) -> None:
        place.generation += 1
        place.link = self._host.start(self._spec, f"shard-{place.number}-{place.generation}")

    def _take_over(self, place: _Place) -> None:
        place.is_ready, place.model = True, None
        self._give(place.partitions, place.number)

    def _give(self, partitions: Integers, owner: int) -> None:
        self.owner[partitions] = owner
        self._sums_known[partitions] = False
        slots = np.arange(len(self._known))
        self._known[np.isin(partition_of(slots, PARTITIONS), partitions)] = False

    # Shards that started in the meantime have their partitions from this step on.
    def _adopt(self) -> None:
        for place in self._places:
            if place.is_ready:
                continue
            now_s = self._clock.monotonic_s()
            if place.link is None and now_s < place.retry_s:
                continue
            try:
                ready = self._is_ready(place)
            except PeerError as error:
                self._give_up(place, error)
                continue
            if ready:
                self._take_over(place)
                if place.lost_s is not None:
                    self.counts.restored += 1
                    self.counts.recovery_s = now_s - place.lost_s
                    _log.info("shard %d restored after %s s", place.number, self.counts.recovery_s)

    def _is_ready(self, place: _Place) -> bool:
        if place.link is None:
            self._start_link(place)
        assert place.link is not None
        return place.link.is_ready(0.0)

    def _lose(self, place: _Place, error: PeerError) -> None:
        self.counts.lost += 1
        place.lost_s = self._clock.monotonic_s()
        place.is_ready = False
        self._give(place.partitions, FRONT)
        _log.warning("shard %d lost; the front takes over its aircraft: %s", place.number, error)
        if place.link is not None:
            place.link.stop()
        place.link, place.retry_s = None, place.lost_s

    def _give_up(self, place: _Place, error: PeerError) -> None:
        _log.warning("shard %d did not start: %s", place.number, error)
        if place.link is not None:
            place.link.stop()
        place.link, place.retry_s = None, self._clock.monotonic_s() + RESTART_PAUSE_S

    # ---------------------------------------------------------------- batches

    # The part of the work of one owner, None if it has none.
    def _part(self, work: Work, owner: int) -> Work | None:
        own = work.partitions[self.owner[work.partitions] == owner]
        return Work(own, work.bounds, work.order) if len(own) else None

    def _step_here(self, part: Work | None, rows: Rows, model: Model, result: Result) -> None:
        if part is None:
            return
        self._filter.step(part, rows, model, self._pool.aircraft, result, want_readout=True)
        self.counts.rows_of_front += int(
            (part.bounds[part.partitions + 1] - part.bounds[part.partitions]).sum()
        )

    def _send(self, place: _Place, part: Work, rows: Rows, model: Model, result: Result) -> _Sent:
        assert place.link is not None
        order = np.concatenate(
            [part.order[part.bounds[p] : part.bounds[p + 1]] for p in part.partitions]
        )
        counts = np.zeros(len(part.bounds), np.int64)
        counts[part.partitions + 1] = (
            part.bounds[part.partitions + 1] - part.bounds[part.partitions]
        )
        own = Rows._make(column[order] if len(column) else column for column in rows)
        slots = slots_of(own)
        states = self._packing.pack(self._pool.aircraft, slots)
        stale = ~self._known[slots] | (states != self._shadow[slots]).any(axis=1)
        sums = self._stale_sums(part.partitions, result)
        batch = Batch(
            self.counts.batches, len(self._known),
            Work(part.partitions, np.cumsum(counts), np.arange(len(order))), own,
            slots[stale], states[stale], sums, result.information[sums], result.vector[sums],
        )  # fmt: skip
        sent = _Sent(place, part, batch, order, slots)
        try:
            place.link.send(batch, None if place.model is model else model)
        except PeerError as error:
            sent.failure = error
        place.model = model
        self.counts.batches += 1
        self.counts.rows += len(order)
        self.counts.octets_sent += _octets(batch)
        return sent

    def _receive(self, sent: _Sent, rows: Rows, model: Model, result: Result) -> None:
        place = sent.place
        assert place.link is not None
        try:
            if sent.failure is not None:
                raise sent.failure
            answer = place.link.receive(self._deadline_s)
            if answer.number != sent.batch.number:
                raise PeerError(f"expected batch {sent.batch.number}, was {answer.number}")
        except PeerError as error:
            self._lose(place, error)
            self._step_here(sent.work, rows, model, result)
            return
        self._write(sent, answer, result)

    def _write(self, sent: _Sent, answer: Answer, result: Result) -> None:
        self.counts.octets_received += _octets(answer)
        result.outcome[sent.rows] = answer.outcome
        result.readout[sent.rows] = answer.readout
        result.innovation[sent.rows] = answer.innovation
        if len(result.log):
            result.log[sent.rows] = answer.log
        self._packing.unpack(answer.states, self._pool.aircraft, sent.slots)
        self._shadow[sent.slots] = answer.states
        self._known[sent.slots] = True
        used = sent.work.partitions
        for kept, new in zip(self._sums, (answer.information, answer.vector), strict=True):
            kept[used] = new
        result.information[used], result.vector[used] = answer.information, answer.vector
        self._sums_known[used] = True

    # ---------------------------------------------------------------- what the shards have

    def _resize(self) -> None:
        slots = len(self._pool.aircraft.time)
        if slots == len(self._known):
            return
        kept = min(slots, len(self._known))
        known, shadow = self._known, self._shadow
        self._known = np.zeros(slots, np.bool_)
        self._shadow = np.zeros((slots, self._packing.width), np.int64)
        self._known[:kept], self._shadow[:kept] = known[:kept], shadow[:kept]

    def _stale_sums(self, partitions: Integers, result: Result) -> Integers:
        stale = [
            not self._sums_known[p]
            or any(
                (now[p].view(np.int64) != kept[p].view(np.int64)).any()
                for now, kept in zip((result.information, result.vector), self._sums, strict=True)
            )
            for p in partitions
        ]
        return partitions[stale]


def _octets(message: Batch | Answer) -> int:
    found = 0
    for one in message:
        parts = one if isinstance(one, Work | Rows) else (one,)
        found += sum(part.nbytes for part in parts if isinstance(part, np.ndarray))
    return found
