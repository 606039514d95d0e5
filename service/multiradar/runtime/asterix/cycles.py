"""Cyclic ASTERIX output: the output of the engine cut at multiples of the periods of users.

The periods are multiples of the step in which the engine releases measurements. So the report of a
cycle contains everything measured before it, independently of the batches of output.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.asterix.channel import Channel
from multiradar.runtime.asterix.sensor_picture import SensorPicture
from multiradar.runtime.asterix.track_picture import TrackPicture
from multiradar.tracking.input.order import RELEASE_STEP_S
from multiradar.tracking.outputs import EngineOutput, TrackPlots
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.writing.status_reports import SERVICE_ENDED

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Columns = TypeVar("Columns", bound="DataclassInstance")


class ChannelBlocks(NamedTuple):
    """Blocks for one user: index of its channel, data time and octets."""

    channel: int
    time_s: float
    blocks: list[bytes]


class Cycles:
    """Turns the engine's output into cyclic reports to users; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    channels : sequence of Channel
        The users.

    Raises
    ------
    ConfigurationError
        If a period is not a multiple of half a second.
    """

    def __init__(
        self, sensors: SensorTable, tracking: TrackingSettings, channels: Sequence[Channel]
    ) -> None:
        for channel in channels:
            for period_s in (channel.options.period_s, channel.options.status_period_s):
                if not period_s > 0.0 or period_s % RELEASE_STEP_S:
                    raise ConfigurationError(
                        f"ASTERIX output period: expected a multiple of {RELEASE_STEP_S:g} s, "
                        f"was {period_s:g}"
                    )
        self._channels = channels
        self._sensors = SensorPicture(sensors, tracking.drop_after_s)
        #: The tracks as they are reported.
        self.tracks = TrackPicture(sensors, self._sensors, tracking)
        #: Channels with losses that have not been reported yet.
        self.overloaded: set[int] = set()
        self._next_tracks_s = [math.inf] * len(channels)
        self._next_status_s = [math.inf] * len(channels)
        # Data time of the last track reports of each channel.
        self._reported_s = [-math.inf] * len(channels)
        #: Greatest data time so far.
        self.reached_s = -math.inf

    def push(self, output: EngineOutput) -> Iterator[ChannelBlocks]:
        """Process the next output; yield the reports due, in the order of data time.

        Parameters
        ----------
        output : EngineOutput
            With the plots of its updates, and their covariance.

        Raises
        ------
        ValueError
            The plots or the covariances are missing.
        """
        pieces = _Pieces(output)
        if math.isinf(self.reached_s) and pieces.next_s < math.inf:
            self._begin(pieces.next_s)
        while (moment_s := self._next_moment()) <= pieces.last_s:
            self._update_pictures(pieces, moment_s)
            yield from self._emit(moment_s, pieces.next_s)
        self._update_pictures(pieces, math.inf)
        self.reached_s = max(self.reached_s, pieces.last_s)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        self._sensors.use(sensors)
        self.tracks.use(sensors)

    def absorb(self, output: EngineOutput) -> None:
        """Update the tracks and sensors without reports."""
        pieces = _Pieces(output)
        self._update_pictures(pieces, math.inf)
        self.reached_s = max(self.reached_s, pieces.last_s)
        if math.isfinite(self.reached_s):
            self.tracks.discard_terminated(self.reached_s)
            self._begin(self.reached_s)

    def finish(self) -> Iterator[ChannelBlocks]:
        """Yield the last reports, and the end of the service."""
        if math.isinf(self.reached_s):
            return
        tracks = self.tracks.reports(self.reached_s)
        for number, channel in enumerate(self._channels):
            yield ChannelBlocks(number, self.reached_s, channel.tracks(tracks))
        yield from self._status(range(len(self._channels)), self.reached_s)
        for number, channel in enumerate(self._channels):
            ended = channel.service(self.reached_s, SERVICE_ENDED)
            yield ChannelBlocks(number, self.reached_s, ended)

    # ---------------------------------------------------------------- inside

    def _begin(self, time_s: float) -> None:
        for number, channel in enumerate(self._channels):
            self._next_tracks_s[number] = _after(time_s, channel.options.period_s)
            self._next_status_s[number] = _after(time_s, channel.options.status_period_s)

    def _next_moment(self) -> float:
        return min([*self._next_tracks_s, *self._next_status_s])

    def _update_pictures(self, pieces: "_Pieces", until_s: float) -> None:
        part = pieces.up_to(until_s)
        self._sensors.update_biases(part.biases)
        self._sensors.update_health(part.health)
        self.tracks.update(part.updates, part.plots.measured, part.spread)
        self.tracks.terminate(part.ended.track_id)

    def _emit(self, moment_s: float, next_s: float) -> Iterator[ChannelBlocks]:
        due = [k for k, one in enumerate(self._next_tracks_s) if one <= moment_s]
        if due:
            for number in due:
                self._reported_s[number] = moment_s
            # Channels of a longer period report dropped tracks later.
            tracks = self.tracks.reports(moment_s, min(self._reported_s))
            for number in due:
                channel = self._channels[number]
                self._next_tracks_s[number] = moment_s + channel.options.period_s
                yield ChannelBlocks(number, moment_s, channel.tracks(tracks))
        due = [k for k, one in enumerate(self._next_status_s) if one <= moment_s]
        for number in due:
            period_s = self._channels[number].options.status_period_s
            self._next_status_s[number] = moment_s + period_s
        yield from self._status(due, moment_s)
        if not len(self.tracks) and next_s < math.inf:
            self._skip_to(next_s)

    def _status(self, due: Sequence[int], time_s: float) -> Iterator[ChannelBlocks]:
        if due:
            sensors = self._sensors.reports(time_s)
            for number in due:
                channel = self._channels[number]
                lost = number in self.overloaded
                self.overloaded.discard(number)
                yield ChannelBlocks(number, time_s, channel.status(sensors, overload=lost))

    def _skip_to(self, next_s: float) -> None:
        # No measurements until then: no cycles before it.
        for number, channel in enumerate(self._channels):
            options = channel.options
            for times, period_s in (
                (self._next_tracks_s, options.period_s),
                (self._next_status_s, options.status_period_s),
            ):
                times[number] = max(times[number], _after(next_s, period_s))


class _Pieces:
    # Output consumed in pieces, each up to a data time.
    def __init__(self, output: EngineOutput) -> None:
        if not len(output.updates) == len(output.plots) == len(output.spread):
            raise ValueError(
                f"expected one plot and one covariance per update ({len(output.updates)} updates), "
                f"found {len(output.plots)} plots and {len(output.spread)} covariances"
            )
        self._output = output
        times = {
            "biases": output.biases.time_s,
            "health": output.health.time_s,
            "ended": output.ended.time_s,
            "updates": output.updates.time_s,
        }
        self._reached = {name: np.maximum.accumulate(of) for name, of in times.items()}
        self._done = dict.fromkeys(times, 0)
        updated = self._reached["updates"]
        self.last_s = float(updated[-1]) if len(updated) else -math.inf

    @property
    def next_s(self) -> float:
        """Time of the next update that is left, infinite for none."""
        times = self._reached["updates"][self._done["updates"] :]
        return float(times[0]) if len(times) else math.inf

    def up_to(self, time_s: float) -> EngineOutput:
        """Return what is left before a time."""
        rows = {}
        for name, reached in self._reached.items():
            last = int(np.searchsorted(reached, time_s, side="left"))
            rows[name] = slice(self._done[name], last)
            self._done[name] = last
        output, updated = self._output, rows["updates"]
        return EngineOutput(
            updates=_sliced(output.updates, updated),
            biases=_sliced(output.biases, rows["biases"]),
            ended=_sliced(output.ended, rows["ended"]),
            health=_sliced(output.health, rows["health"]),
            plots=TrackPlots(output.plots.track_id[updated], output.plots.measured.select(updated)),
            spread=output.spread[updated],
        )


def _sliced(columns: Columns, rows: slice) -> Columns:
    values = {one.name: getattr(columns, one.name)[rows] for one in fields(columns)}
    return type(columns)(**values)


def _after(time_s: float, period_s: float) -> float:
    return (math.floor(time_s / period_s) + 1) * period_s
