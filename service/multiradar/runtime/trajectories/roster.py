"""Assignment of bundles to tracks, and of plots to bundles, in the order of the engine's output.

A track gets a bundle when it is confirmed, up to a maximum. When a bundle is dropped, the queued
track of the lowest number gets one. The assignment depends on the engine's output only, not on its
batches.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.plot_rows import plot_rows
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    Published,
    prior_biases,
    updated_biases,
)
from multiradar.tracking.outputs import STATE_CONFIRMED, BiasRecords, EngineOutput


class PushPlots(NamedTuple):
    """Plots for the bundle of a track, in order, with the biases published at their time."""

    track_id: int
    plots: NDArray[np.void]
    published: Published


class DropBundle(NamedTuple):
    """A track is terminated: its bundle is dropped."""

    track_id: int


class Sampled(NamedTuple):
    """End of a sampled epoch: all its plots precede it; forecasts are made and evaluated."""

    epoch: int
    time_s: float


Order = PushPlots | DropBundle | Sampled


class Roster:
    """Assigns bundles and plots; one owner.

    Parameters
    ----------
    aircraft_max : int
        Maximum number of tracks with a bundle.
    sensors : SensorTable
        The sensors.
    """

    def __init__(self, aircraft_max: int, sensors: SensorTable) -> None:
        self._aircraft_max = aircraft_max
        self._published = prior_biases(sensors)
        self._pending = BiasRecords.concatenate([])
        self._held: set[int] = set()
        # Confirmed tracks without a bundle.
        self._waiting: set[int] = set()
        self._sequence = 0
        self._reached_s = -np.inf
        self._epoch = -1
        # How often the data time was set back, at the last output and at most.
        self._set_backs = self._set_backs_max = 0

    def restart(self) -> None:
        """Expect all output again from the start; what is known is skipped."""
        self._set_backs = 0

    def set_back(self) -> None:
        """Expect earlier times: all tracks were terminated."""
        self._set_backs += 1
        if self._set_backs > self._set_backs_max:
            self._set_backs_max = self._set_backs
            # The biases are kept.
            self._publish(np.inf)
            self._reached_s, self._epoch = -np.inf, -1

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        before, self._published = self._published, prior_biases(sensors)
        for known, now in zip(before, self._published, strict=True):
            now[: len(known)] = known

    @property
    def held(self) -> int:
        """Tracks that have a bundle."""
        return len(self._held)

    @property
    def waiting(self) -> int:
        """Confirmed tracks queued for a bundle."""
        return len(self._waiting)

    def has(self, track_id: int) -> bool:
        """Return whether a track has a bundle."""
        return track_id in self._held

    def is_queued(self, track_id: int) -> bool:
        """Return whether a confirmed track is queued for a bundle."""
        return track_id in self._waiting

    def push(self, output: EngineOutput) -> Iterator[Order]:
        """Process output of the engine, in order; repeated output is skipped.

        Yields
        ------
        PushPlots, DropBundle or Sampled
            Operations on bundles, in order for each track; samples in order for all of them.
        """
        if self._set_backs < self._set_backs_max:
            # Repeated; its times say nothing about those after the step.
            return
        updates = output.updates
        fresh = updates.sequence > self._sequence
        plots, confirmed = (
            plot_rows(output, PLOT_DTYPE)[fresh],
            updates.state[fresh] == STATE_CONFIRMED,
        )
        if len(plots):
            self._sequence = int(updates.sequence[-1])
        reached_s = np.maximum.accumulate(np.r_[self._reached_s, plots["time_s"]])
        self._note(output.biases)
        self._reached_s, reached_s = float(reached_s[-1]), reached_s[1:]
        begin = 0
        for time_s in self._cuts(output):
            end = int(np.searchsorted(reached_s, time_s))
            yield from self._plots(plots[begin:end], confirmed[begin:end])
            begin = max(begin, end)
            self._publish(time_s)
            yield from self._sampled(output, time_s)
            for track_id in output.ended.track_id[output.ended.time_s == time_s].tolist():
                yield from self._terminate(track_id)
        yield from self._plots(plots[begin:], confirmed[begin:])

    # Times of changes: plots from then on come after them.
    def _cuts(self, output: EngineOutput) -> list[float]:
        times = np.concatenate([self._pending.time_s, output.ended.time_s])
        found: list[float] = np.unique(times[times <= self._reached_s]).tolist()
        ends = np.unique(output.ended.time_s)
        samples = [one.time_s for one in output.samples]
        return sorted({*found, *ends.tolist(), *samples})

    # Samples are repeated when the engine is rebuilt.
    def _sampled(self, output: EngineOutput, time_s: float) -> Iterator[Order]:
        for sample in output.samples:
            if sample.time_s == time_s and sample.epoch > self._epoch:
                self._epoch = sample.epoch
                yield Sampled(sample.epoch, sample.time_s)

    # Biases are repeated when the engine is rebuilt.
    def _note(self, records: BiasRecords) -> None:
        if len(records):
            both = BiasRecords.concatenate([self._pending, records])
            self._pending = _chosen(both, both.time_s > self._reached_s)

    def _publish(self, time_s: float) -> None:
        due = self._pending.time_s <= time_s
        if due.any():
            self._published = updated_biases(self._published, self._pending, np.flatnonzero(due))
            self._pending = _chosen(self._pending, ~due)

    def _terminate(self, track_id: int) -> Iterator[Order]:
        self._waiting.discard(track_id)
        if track_id not in self._held:
            return
        self._held.discard(track_id)
        yield DropBundle(track_id)
        if self._waiting:
            first = min(self._waiting)
            self._waiting.discard(first)
            self._held.add(first)

    def _plots(self, plots: NDArray[np.void], confirmed: NDArray[np.bool_]) -> Iterator[Order]:
        if not len(plots):
            return
        # Rows by track, each in order: a search for each track would cost tracks times plots.
        order = np.argsort(plots["track_id"], kind="stable")
        ordered = plots[order]
        names, begins = np.unique(ordered["track_id"], return_index=True)
        ends = np.append(begins[1:], len(order))
        parts = dict(
            zip(names.tolist(), zip(begins.tolist(), ends.tolist(), strict=True), strict=True)
        )
        since = {track_id: 0 for track_id in parts if track_id in self._held}
        some = np.flatnonzero(confirmed)
        tracks, first_rows = np.unique(plots["track_id"][some], return_index=True)
        for at in np.argsort(first_rows).tolist():
            track_id = int(tracks[at])
            if track_id not in self._held and track_id not in self._waiting:
                if len(self._held) < self._aircraft_max:
                    self._held.add(track_id)
                    since[track_id] = int(some[first_rows[at]])
                else:
                    self._waiting.add(track_id)
        for track_id, first in since.items():
            begin, end = parts[track_id]
            if first:
                begin += int(np.searchsorted(order[begin:end], first))
            # Copied, so that plots that wait do not keep the others in memory.
            yield PushPlots(track_id, ordered[begin:end].copy(), self._published)


def _chosen(records: BiasRecords, rows: NDArray[np.bool_]) -> BiasRecords:
    names = BiasRecords.__dataclass_fields__
    return BiasRecords(**{name: getattr(records, name)[rows] for name in names})
