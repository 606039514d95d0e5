"""The output of the engine cut at moments of data time, and what users are told at each.

Moments are whole periods; the engine releases measurements in steps that periods are made of. So
what is told at a moment is all that was measured before it, however the output came in pieces.
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
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.plots import TrackPlots
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.writing.status_reports import SERVICE_ENDED

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Columns = TypeVar("Columns", bound="DataclassInstance")


class Told(NamedTuple):
    """Blocks for one user: its number among the channels, the data time, and the octets."""

    channel: int
    time_s: float
    blocks: list[bytes]


class Cycles:
    """Follows the engine's output and tells users of it; one owner.

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
                        f"period of ASTERIX output: expected a multiple of {RELEASE_STEP_S:g} s, "
                        f"was {period_s:g}"
                    )
        self._channels = channels
        self._sensors = SensorPicture(sensors, tracking.drop_after_s)
        #: The tracks as they are told of.
        self.tracks = TrackPicture(sensors, self._sensors, tracking)
        #: Users who have not been told yet that something was lost.
        self.overloaded: set[int] = set()
        self._next_tracks_s = [math.inf] * len(channels)
        self._next_status_s = [math.inf] * len(channels)
        # When each user was last told of the tracks.
        self._told_s = [-math.inf] * len(channels)
        #: Greatest data time so far.
        self.reached_s = -math.inf

    def take(self, output: EngineOutput) -> Iterator[Told]:
        """Take the next output; yield what users are told in the order of data time.

        Parameters
        ----------
        output : EngineOutput
            With the plots behind its updates, and their spread.

        Raises
        ------
        ValueError
            The plots or the spread are missing.
        """
        pieces = _Pieces(output)
        if math.isinf(self.reached_s) and pieces.next_s < math.inf:
            self._begin(pieces.next_s)
        while (moment_s := self._next_moment()) <= pieces.last_s:
            self._learn(pieces, moment_s)
            yield from self._tell(moment_s, pieces.next_s)
        self._learn(pieces, math.inf)
        self.reached_s = max(self.reached_s, pieces.last_s)

    def learn(self, output: EngineOutput) -> None:
        """Take the next output and tell nobody."""
        pieces = _Pieces(output)
        self._learn(pieces, math.inf)
        self.reached_s = max(self.reached_s, pieces.last_s)
        if math.isfinite(self.reached_s):
            self.tracks.tidy(self.reached_s)
            self._begin(self.reached_s)

    def finish(self) -> Iterator[Told]:
        """Tell of the last moment, and that the service ends."""
        if math.isinf(self.reached_s):
            return
        tracks = self.tracks.reports(self.reached_s)
        for number, channel in enumerate(self._channels):
            yield Told(number, self.reached_s, channel.tracks(tracks))
        yield from self._status(range(len(self._channels)), self.reached_s)
        for number, channel in enumerate(self._channels):
            ended = channel.service(self.reached_s, SERVICE_ENDED)
            yield Told(number, self.reached_s, ended)

    # ---------------------------------------------------------------- inside

    def _begin(self, time_s: float) -> None:
        for number, channel in enumerate(self._channels):
            self._next_tracks_s[number] = _after(time_s, channel.options.period_s)
            self._next_status_s[number] = _after(time_s, channel.options.status_period_s)

    def _next_moment(self) -> float:
        return min([*self._next_tracks_s, *self._next_status_s])

    def _learn(self, pieces: "_Pieces", until_s: float) -> None:
        part = pieces.until(until_s)
        self._sensors.learn_biases(part.biases)
        self._sensors.learn_health(part.health)
        self.tracks.take(part.updates, part.plots.measured, part.spread)
        self.tracks.end(part.ended.track_id)

    def _tell(self, moment_s: float, next_s: float) -> Iterator[Told]:
        due = [k for k, one in enumerate(self._next_tracks_s) if one <= moment_s]
        if due:
            for number in due:
                self._told_s[number] = moment_s
            # Who has a longer period hears later of the tracks that ended.
            tracks = self.tracks.reports(moment_s, min(self._told_s))
            for number in due:
                channel = self._channels[number]
                self._next_tracks_s[number] = moment_s + channel.options.period_s
                yield Told(number, moment_s, channel.tracks(tracks))
        due = [k for k, one in enumerate(self._next_status_s) if one <= moment_s]
        for number in due:
            period_s = self._channels[number].options.status_period_s
            self._next_status_s[number] = moment_s + period_s
        yield from self._status(due, moment_s)
        if not len(self.tracks) and next_s < math.inf:
            self._pass_over(next_s)

    def _status(self, due: Sequence[int], time_s: float) -> Iterator[Told]:
        if due:
            sensors = self._sensors.reports(time_s)
            for number in due:
                channel = self._channels[number]
                lost = number in self.overloaded
                self.overloaded.discard(number)
                yield Told(number, time_s, channel.status(sensors, overload=lost))

    def _pass_over(self, next_s: float) -> None:
        # Nothing was measured until then: no moments before it.
        for number, channel in enumerate(self._channels):
            options = channel.options
            for times, period_s in (
                (self._next_tracks_s, options.period_s),
                (self._next_status_s, options.status_period_s),
            ):
                times[number] = max(times[number], _after(next_s, period_s))


class _Pieces:
    # Output that is taken piece by piece, each up to a data time.
    def __init__(self, output: EngineOutput) -> None:
        if not len(output.updates) == len(output.plots) == len(output.spread):
            raise ValueError(
                f"expected a plot and a spread of each of {len(output.updates)} updates, was "
                f"{len(output.plots)} and {len(output.spread)}"
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
        """Time of the next update that was not taken, infinite for none."""
        times = self._reached["updates"][self._done["updates"] :]
        return float(times[0]) if len(times) else math.inf

    def until(self, time_s: float) -> EngineOutput:
        """Take what lies before a time."""
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
