"""Calibration of forecasts by the errors of earlier ones, from the measurements alone."""

from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bank import find_filter
from multiradar.state import Fields
from multiradar.tracking.forecast.forecast_family import ForecastFamily
from multiradar.tracking.forecast.pending import PendingForecasts
from multiradar.tracking.forecast.region_sizes import (
    HORIZONS_S,
    ForecastScores,
    Plan,
    standardised,
)
from multiradar.tracking.forecast.state_samples import SAMPLE_EVERY_S, SAMPLE_TRACKS_MAX, drawn
from multiradar.tracking.outputs import EngineOutput, StateSample, TrackStates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: Maximum interval between updates for an interpolated reference position, s.
GAP_MAX_S = 15.0
#: Number of initial samples that are all used; then every `LATER_EVERY`-th is.
EAGER_SAMPLES = 75
LATER_EVERY = 2
#: Probability of the regions that are counted.
COUNTED = 0.95
#: Maximum number of pending forecasts: those of all horizons.
WAITING_MAX = int(
    SAMPLE_TRACKS_MAX * np.sum(np.ceil((HORIZONS_S + GAP_MAX_S) / SAMPLE_EVERY_S + 1.0))
)


class _Positions(NamedTuple):
    # Track updates: positions and covariances.
    track_id: NDArray[np.int64]
    time_s: Floats
    position: Floats


class Part(NamedTuple):
    """Part of an output of the engine.

    Attributes
    ----------
    updates : int
        Number of its updates.
    sample : StateSample or None
        States after them.
    """

    updates: int
    sample: StateSample | None


class ForecastCalibration:
    """Makes forecasts of a few tracks, and evaluates their errors when the time has come.

    Parameters
    ----------
    settings : TrackingSettings
        Motion model of the filter.
    keeps_modes : bool
        Whether the filter has motion modes.

    Attributes
    ----------
    family : ForecastFamily
        The motion models.
    """

    STATE: ClassVar[Fields] = {
        "_scores": ForecastScores,
        "_pending": PendingForecasts,
        "_seen": list[_Positions],
        "_samples": int,
        "_held": int,
        "_counted": int,
    }

    def __init__(self, settings: TrackingSettings, *, keeps_modes: bool) -> None:
        self.family = ForecastFamily(settings, keeps_modes=keeps_modes)
        motions = len(self.family.names)
        self._scores = ForecastScores(motions, self.family.first)
        self._pending = PendingForecasts.none(motions)
        self._seen: list[_Positions] = []
        self._samples = 0
        self._held = self._counted = 0

    @property
    def waiting(self) -> int:
        """Number of pending forecasts."""
        return self._pending.rows

    @property
    def scores(self) -> ForecastScores:
        """Errors of past forecasts."""
        return self._scores

    @property
    def held(self) -> tuple[int, int]:
        """Calibrated regions of probability `COUNTED` that contained the later position, and all.

        Each is that of the calibration before the error was known.
        """
        return self._held, self._counted

    def observe(self, output: EngineOutput) -> None:
        """Learn from an output of the engine, and make forecasts of its samples.

        Parameters
        ----------
        output : EngineOutput
            The next one; the result does not depend on how outputs are divided.
        """
        for _ in self.parts(output):
            continue

    def parts(self, output: EngineOutput) -> Iterator[Part]:
        """As `observe`, sample by sample.

        Parameters
        ----------
        output : EngineOutput
            The next one.

        Yields
        ------
        Part
            Each sample, after the updates before it were used, and then the remaining updates.
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
        if first == last or not self._pending.rows:
            return
        # Only tracks with pending forecasts are needed.
        track_id = output.updates.track_id[first:last]
        rows = first + np.flatnonzero(np.isin(track_id, self._pending.track_id))
        if len(rows):
            updates = output.updates
            self._seen.append(
                _Positions(updates.track_id[rows], updates.time_s[rows], output.spread[rows])
            )

    def _learn(self, until_s: float) -> None:
        waiting, seen = self._pending, self._seen
        self._seen = []
        if not seen:
            self._pending = waiting.at(waiting.due_s + GAP_MAX_S >= until_s)
            return
        updates = _by_track(seen)
        begin, after, end = _first_from(updates, waiting.track_id, waiting.due_s)
        moved = after > begin
        waiting.before[moved, 0] = updates.time_s[after[moved] - 1]
        waiting.before[moved, 1:] = updates.position[after[moved] - 1, :2]
        known = after < end
        self._score(waiting.at(known), updates.time_s[after[known]], updates.position[after[known]])
        late = waiting.due_s + GAP_MAX_S < until_s
        self._pending = waiting.at(~known & ~late)

    def _begin(self, sample: StateSample) -> None:
        chosen = drawn(sample.states.track_id, sample.epoch)
        if not len(chosen):
            return
        states = sample.states.at(chosen)
        means, covariances = self.family.forecast_all(states, HORIZONS_S)
        tracks, horizons = len(states), len(HORIZONS_S)
        now = np.column_stack([states.time_s, states.mean[:, :2]])
        made = PendingForecasts(
            np.repeat(states.track_id, horizons),
            (states.time_s[:, None] + HORIZONS_S).ravel(),
            np.tile(np.arange(horizons), tracks),
            _by_row(means),
            _by_row(covariances),
            np.repeat(now, horizons, axis=0),
        )
        self._pending = self._pending.followed_by(made).at(slice(-WAITING_MAX, None))

    def forecast_by(
        self, plan: Plan, states: TrackStates, index: int, ahead_s: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return the predicted position of a track, with its region.

        Parameters
        ----------
        plan : Plan
            Plan of `scores` for these times.
        states : TrackStates
            States of tracks.
        index : int
            Index of the track.
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
        one = states.at(np.array([index]))
        means, covariances = self.family.forecast(plan.motion, one, ahead_s)
        careful = self.family.worst_case_covariances(means, one, ahead_s)
        known = plan.calibrated[:, None, None]
        covariance = np.where(known, covariances[0], careful[0])
        # The region is not smaller than that of the current position: later updates do not show
        # errors common to all tracks, such as biases.
        now = one.covariance[0, :2, :2]
        least = 0.5 * plan.single * np.trace(np.linalg.solve(covariance, now), axis1=1, axis2=2)
        return means[0], covariance, np.maximum(plan.factor, least)

    def _score(self, made: PendingForecasts, after_s: Floats, after: Floats) -> None:
        apart_s = after_s - made.before[:, 0]
        near = apart_s <= GAP_MAX_S
        part = np.ones(len(apart_s))
        np.divide(made.due_s - made.before[:, 0], apart_s, out=part, where=apart_s > 0.0)
        truth = made.before[:, 1:] + part[:, None] * (after[:, :2] - made.before[:, 1:])
        spread = np.stack([after[:, [2, 3]], after[:, [3, 4]]], axis=1)
        scores, sizes = standardised(truth[:, None] - made.mean, made.covariance, spread)
        for horizon in np.unique(made.horizon[near]).tolist():
            mine = near & (made.horizon == horizon)
            self._count(horizon, scores[mine])
            self._scores.record(horizon, scores[mine], sizes[mine])
        self._scores.settle()

    def _count(self, horizon: int, scores: Floats) -> None:
        plan = self._scores.plan(HORIZONS_S[horizon : horizon + 1], COUNTED)
        if plan.calibrated[0]:
            self._held += int(np.count_nonzero(scores[:, plan.motion] <= plan.factor[0]))
            self._counted += len(scores)


def calibration_for(settings: TrackingSettings) -> ForecastCalibration:
    """Return a new calibration for the filter of the settings.

    Parameters
    ----------
    settings : TrackingSettings
        Settings of the tracker.

    Returns
    -------
    ForecastCalibration
        The calibration, without any errors.
    """
    return ForecastCalibration(settings, keeps_modes=find_filter(settings.filter_name).keeps_modes)


# For each requested track: its first update, the first not before a time, the end of its updates.
def _first_from(
    updates: _Positions, wanted: NDArray[np.int64], due_s: Floats
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    begin = np.searchsorted(updates.track_id, wanted)
    end = np.searchsorted(updates.track_id, wanted, "right")
    # Keys that order times track by track.
    tracks, rank = np.unique(updates.track_id, return_inverse=True)
    origin_s = float(updates.time_s.min())
    span_s = float(updates.time_s.max()) - origin_s + 1.0
    key = rank * span_s + (updates.time_s - origin_s)
    asked = np.searchsorted(tracks, wanted) * span_s + np.clip(due_s - origin_s, 0.0, span_s)
    return begin, np.clip(np.searchsorted(key, asked), begin, end), end


def _by_row(values: Floats) -> Floats:
    # From (motions, tracks, times) to rows (tracks × times) with their motions.
    rows = np.moveaxis(values, 0, 2)
    return np.ascontiguousarray(rows.reshape(-1, *rows.shape[2:]))


def _by_track(seen: list[_Positions]) -> _Positions:
    track_id = np.concatenate([one.track_id for one in seen])
    order = np.argsort(track_id, kind="stable")
    return _Positions(
        track_id[order],
        np.concatenate([one.time_s for one in seen])[order],
        np.concatenate([one.position for one in seen])[order],
    )
