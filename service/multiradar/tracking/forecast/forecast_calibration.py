"""Forecasts that learn from how far earlier ones were off: from the measurements alone."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bank import find_filter
from multiradar.tracking.forecast.forecast_family import ForecastFamily
from multiradar.tracking.forecast.forecast_scores import (
    HORIZONS_S,
    ForecastScores,
    Plan,
    standardised,
)
from multiradar.tracking.forecast.state_samples import SAMPLE_EVERY_S, SAMPLE_TRACKS_MAX, drawn
from multiradar.tracking.outputs import EngineOutput, StateSample, TrackStates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: A place between updates so far apart is not known well enough to judge a forecast, s.
GAP_MAX_S = 15.0
#: From the first so many samples all is learnt, then from every `LATER_EVERY`-th.
EAGER_SAMPLES = 75
LATER_EVERY = 2
#: Most forecasts that wait for their time: those of the longest horizon and all shorter ones.
WAITING_MAX = int(
    SAMPLE_TRACKS_MAX * np.sum(np.ceil((HORIZONS_S + GAP_MAX_S) / SAMPLE_EVERY_S + 1.0))
)


class _Waiting(NamedTuple):
    # Forecasts that wait for their time: one row for each, j motions.
    track_id: NDArray[np.int64]
    due_s: Floats
    horizon: NDArray[np.int64]
    mean: Floats
    covariance: Floats
    before: Floats

    def at(self, rows: NDArray[np.bool_] | slice) -> "_Waiting":
        return _Waiting(
            self.track_id[rows], self.due_s[rows], self.horizon[rows], self.mean[rows],
            self.covariance[rows], self.before[rows],
        )  # fmt: skip


class _Places(NamedTuple):
    # Updates of tracks: where they are and how sure that is.
    track_id: NDArray[np.int64]
    time_s: Floats
    place: Floats


class Part(NamedTuple):
    """A part of an output of the engine.

    Attributes
    ----------
    updates : int
        Number of the updates in it.
    sample : StateSample or None
        States after them.
    """

    updates: int
    sample: StateSample | None


class ForecastCalibration:
    """Makes forecasts of a few tracks, waits for their times, and learns from the errors.

    Parameters
    ----------
    settings : TrackingSettings
        How the filter takes aircraft to move.
    keeps_modes : bool
        Whether the filter has modes of motion.

    Attributes
    ----------
    family : ForecastFamily
        The motions.
    """

    def __init__(self, settings: TrackingSettings, *, keeps_modes: bool) -> None:
        self.family = ForecastFamily(settings, keeps_modes=keeps_modes)
        motions = len(self.family.names)
        self._scores = ForecastScores(motions, self.family.first)
        self._waiting = _nothing(motions)
        self._seen: list[_Places] = []
        self._samples = 0

    @property
    def waiting(self) -> int:
        """Number of forecasts that wait for their time."""
        return len(self._waiting.due_s)

    @property
    def scores(self) -> ForecastScores:
        """What was learnt so far."""
        return self._scores

    def take(self, output: EngineOutput) -> None:
        """Learn from an output of the engine, and make forecasts of its samples.

        Parameters
        ----------
        output : EngineOutput
            The next one; what is learnt does not depend on how outputs are cut.
        """
        for _ in self.parts(output):
            continue

    def parts(self, output: EngineOutput) -> Iterator[Part]:
        """Do as `take`, sample by sample.

        Parameters
        ----------
        output : EngineOutput
            The next one.

        Yields
        ------
        Part
            Each sample, when what came before it has been learnt, and the rest of the updates.
        """
        first = 0
        for sample in output.samples:
            last = int(np.searchsorted(output.updates.time_s, sample.time_s))
            self._gather(output, first, last)
            self._samples += 1
            used = self._samples <= EAGER_SAMPLES or self._samples % LATER_EVERY == 0
            if used:
                self._learn(sample.time_s)
            yield Part(last - first, sample)
            if used:
                self._begin(sample)
            first = last
        self._gather(output, first, len(output.updates))
        yield Part(len(output.updates) - first, None)

    def _gather(self, output: EngineOutput, first: int, last: int) -> None:
        # Until the next sample only the tracks of forecasts that wait matter.
        track_id = output.updates.track_id[first:last]
        rows = first + np.flatnonzero(np.isin(track_id, self._waiting.track_id))
        if len(rows):
            updates = output.updates
            self._seen.append(
                _Places(updates.track_id[rows], updates.time_s[rows], output.spread[rows])
            )

    def _learn(self, until_s: float) -> None:
        waiting, seen = self._waiting, self._seen
        self._seen = []
        if not seen:
            self._waiting = waiting.at(waiting.due_s + GAP_MAX_S >= until_s)
            return
        places = _by_track(seen)
        begin, after, end = _first_from(places, waiting.track_id, waiting.due_s)
        moved = after > begin
        waiting.before[moved, 0] = places.time_s[after[moved] - 1]
        waiting.before[moved, 1:] = places.place[after[moved] - 1, :2]
        known = after < end
        self._judge(waiting.at(known), places.time_s[after[known]], places.place[after[known]])
        late = waiting.due_s + GAP_MAX_S < until_s
        self._waiting = waiting.at(~known & ~late)

    def _begin(self, sample: StateSample) -> None:
        places = drawn(sample.states.track_id, sample.epoch)
        if not len(places):
            return
        states = sample.states.at(places)
        means, covariances = self.family.forecast_all(states, HORIZONS_S)
        tracks, horizons = len(states), len(HORIZONS_S)
        now = np.column_stack([states.time_s, states.mean[:, :2]])
        made = _Waiting(
            np.repeat(states.track_id, horizons),
            (states.time_s[:, None] + HORIZONS_S).ravel(),
            np.tile(np.arange(horizons), tracks),
            _by_row(means),
            _by_row(covariances),
            np.repeat(now, horizons, axis=0),
        )
        joined = (np.concatenate(pair) for pair in zip(self._waiting, made, strict=True))
        self._waiting = _Waiting(*joined).at(slice(-WAITING_MAX, None))

    def forecast_by(
        self, plan: Plan, states: TrackStates, place: int, ahead_s: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return where a track is expected to be, with its region.

        Parameters
        ----------
        plan : Plan
            What `scores` said of these times ahead.
        states : TrackStates
            States of the filter.
        place : int
            Which of them.
        ahead_s : (k,) ndarray
            Times after the state, s, not negative, ascending.

        Returns
        -------
        means : (k, 2) ndarray
            East and north, m.
        covariances : (k, 2, 2) ndarray
            m².
        factors : (k,) ndarray
            The region is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
        """
        one = states.at(np.array([place]))
        means, covariances = self.family.forecast(plan.motion, one, ahead_s)
        careful = self.family.careful_covariances(means, one, ahead_s)
        known = plan.calibrated[:, None, None]
        covariance = np.where(known, covariances[0], careful[0])
        # No surer than of the place now: what all tracks share, such as biases, no later update
        # of theirs tells.
        now = one.covariance[0, :2, :2]
        least = 0.5 * plan.single * np.trace(np.linalg.solve(covariance, now), axis1=1, axis2=2)
        return means[0], covariance, np.maximum(plan.factor, least)

    def _judge(self, made: _Waiting, after_s: Floats, after: Floats) -> None:
        apart_s = after_s - made.before[:, 0]
        near = apart_s <= GAP_MAX_S
        part = np.ones(len(apart_s))
        np.divide(made.due_s - made.before[:, 0], apart_s, out=part, where=apart_s > 0.0)
        truth = made.before[:, 1:] + part[:, None] * (after[:, :2] - made.before[:, 1:])
        spread = np.stack([after[:, [2, 3]], after[:, [3, 4]]], axis=1)
        scores, sizes = standardised(truth[:, None] - made.mean, made.covariance, spread)
        for horizon in np.unique(made.horizon[near]).tolist():
            mine = near & (made.horizon == horizon)
            self._scores.take(horizon, scores[mine], sizes[mine])
        self._scores.settle()


def calibration_for(settings: TrackingSettings) -> ForecastCalibration:
    """Return what has learnt nothing yet, for the filter of the settings.

    Parameters
    ----------
    settings : TrackingSettings
        How aircraft are tracked.

    Returns
    -------
    ForecastCalibration
        A new one.
    """
    return ForecastCalibration(settings, keeps_modes=find_filter(settings.filter_name).keeps_modes)


# Of each wanted track: its first update, the first not before a time, the end of its updates.
def _first_from(
    places: _Places, wanted: NDArray[np.int64], due_s: Floats
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    begin = np.searchsorted(places.track_id, wanted)
    end = np.searchsorted(places.track_id, wanted, "right")
    # Times one after the other, track by track.
    tracks, rank = np.unique(places.track_id, return_inverse=True)
    origin_s = float(places.time_s.min())
    span_s = float(places.time_s.max()) - origin_s + 1.0
    key = rank * span_s + (places.time_s - origin_s)
    asked = np.searchsorted(tracks, wanted) * span_s + np.clip(due_s - origin_s, 0.0, span_s)
    return begin, np.clip(np.searchsorted(key, asked), begin, end), end


def _by_row(values: Floats) -> Floats:
    # From motions, tracks, times to rows of tracks and times with their motions.
    rows = np.moveaxis(values, 0, 2)
    return np.ascontiguousarray(rows.reshape(-1, *rows.shape[2:]))


def _nothing(motions: int) -> _Waiting:
    whole, real = np.empty(0, np.int64), np.empty(0)
    means, covariances = np.empty((0, motions, 2)), np.empty((0, motions, 2, 2))
    return _Waiting(whole, real, whole, means, covariances, np.empty((0, 3)))


def _by_track(seen: list[_Places]) -> _Places:
    track_id = np.concatenate([one.track_id for one in seen])
    order = np.argsort(track_id, kind="stable")
    return _Places(
        track_id[order],
        np.concatenate([one.time_s for one in seen])[order],
        np.concatenate([one.place for one in seen])[order],
    )
