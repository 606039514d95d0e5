"""Calibration of ensemble forecasts from bundles by the errors of earlier ones.

At the end of each sampled epoch the ensemble forecasts of a few bundles are stored. When a bundle
covers the forecast times, its positions are the reference, and the errors are counted as those of
the filter's forecasts. This is done in the thread that owns the bundles, at the ends of epochs, so
that the calibration depends only on the measurements.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.forecast.bundle_forecast import forecast
from multiradar.restoration.forecast.settings import ForecastSettings
from multiradar.tracking.forecast.forecast_calibration import GAP_MAX_S
from multiradar.tracking.forecast.pending import PendingForecasts
from multiradar.tracking.forecast.region_sizes import (
    HORIZONS_S,
    ForecastScores,
    RegionSizes,
    standardised,
)
from multiradar.tracking.forecast.state_samples import SAMPLE_TRACKS_MAX, drawn

Floats = NDArray[np.float64]

SETTINGS = ForecastSettings()
#: A forecast is evaluated when the bundle extends this much beyond its time, s, or when its track
#: ends.
SETTLED_S = 15.0
#: All due forecasts are evaluated when the first of them is this old, s: well within the window.
ASKED_AFTER_S = 45.0
#: Plots per forecast: the calibration takes a fixed fraction of the time of bundles.
PLOTS_EACH = 50.0
#: Minimum tracks forecast at the first samples, for a fast calibration; one at later samples.
EAGER_SAMPLES, EAGER_TRACKS = 40, 3
#: Maximum pending forecasts, each of one horizon: a bound of memory.
WAITING_MAX = 2000
#: Probability of the regions from which the scale of covariances is taken.
PROBABILITY = 0.95
#: Calibration before any forecast is evaluated.
UNCALIBRATED = ForecastScores(1, 0).sizes


class _Evaluated(NamedTuple):
    # A forecast with known error.
    track_id: int
    due_s: float
    horizon: int
    score: float
    size: float


class EnsembleScores:
    """Scores of past ensemble forecasts from bundles; one owner."""

    def __init__(self) -> None:
        self._scores = ForecastScores(1, 0)
        self._pending = PendingForecasts.none(1)
        self._evaluated: list[_Evaluated] = []
        self._allowed, self._samples = 0.0, 0
        # Ratio of actual to predicted covariance, by horizon.
        self._excess = np.ones(len(HORIZONS_S))

    @property
    def sizes(self) -> RegionSizes:
        """The calibration up to the last sample."""
        return self._scores.sizes

    @property
    def heard(self) -> Floats:
        """Effective number of evaluated forecasts by horizon; old ones have less weight."""
        return self._scores.heard

    @property
    def waiting(self) -> int:
        """Number of pending forecasts, each of one horizon."""
        return self._pending.rows

    @property
    def tracks(self) -> set[int]:
        """The tracks with pending forecasts."""
        return set(self._pending.track_id.tolist())

    def chosen(self, tracks: Sequence[int], epoch: int, plots: int) -> list[int]:
        """Return the tracks to forecast at a sample, different ones each time.

        Parameters
        ----------
        tracks : sequence of int
            Candidates, ascending.
        epoch : int
            Number of the epoch.
        plots : int
            Plots accepted by bundles since the previous sample.

        Returns
        -------
        list of int
            One for each `PLOTS_EACH` plots, at least one (`EAGER_TRACKS` at first), at most
            `SAMPLE_TRACKS_MAX`.
        """
        self._samples += 1
        least = EAGER_TRACKS if self._samples <= EAGER_SAMPLES else 1
        self._allowed = min(self._allowed + plots / PLOTS_EACH, float(SAMPLE_TRACKS_MAX))
        count = min(max(int(self._allowed), least), len(tracks))
        self._allowed = max(self._allowed - count, 0.0)
        indices = drawn(np.array(tracks, np.int64), epoch, count)
        return [tracks[index] for index in indices.tolist()]

    def make(self, track_id: int, bundle: Bundle) -> None:
        """Forecast with a bundle at all horizons, and store the forecasts until they are due."""
        horizons = len(HORIZONS_S)
        if self.waiting + horizons > WAITING_MAX:
            return
        ensemble = forecast(bundle.final_states(), HORIZONS_S, SETTINGS, bundle.manoeuvre_history)
        made = PendingForecasts(
            np.full(horizons, track_id), ensemble.time_s + HORIZONS_S, np.arange(horizons),
            ensemble.mean()[:, None, :2], ensemble.spread()[:, None, :2, :2],
            np.zeros((horizons, 3)),
        )  # fmt: skip
        self._pending = self._pending.followed_by(made)

    def evaluate(self, track_id: int, bundle: Bundle, time_s: float | None) -> None:
        """Compare due forecasts with the positions of the bundle at their times.

        Parameters
        ----------
        track_id : int
            A track.
        bundle : Bundle
            Its bundle.
        time_s : float or None
            Present data time, s; None at the end of the track.
        """
        pending, due_s = self._pending, self._pending.due_s
        own = pending.track_id == track_id
        if not own.any() or not len(bundle):
            return
        begin_s, now_s = bundle.window_s
        until_s, waiting = now_s, own
        if time_s is not None:
            # Times in a gap between plots that is too long cannot be evaluated.
            silent_s = max(now_s, time_s - GAP_MAX_S)
            waiting = own & ~((now_s < due_s) & (due_s < silent_s))
            until_s = now_s - SETTLED_S
            if np.min(due_s[waiting], initial=np.inf) > now_s - ASKED_AFTER_S:
                until_s = -np.inf
        self._pending = pending.at(~own | (waiting & (due_s > until_s)))
        made = pending.at(waiting & (begin_s <= due_s) & (due_s <= until_s))
        made = made.at(_is_between(bundle.plots_s, made.due_s))
        if made.rows:
            self._compare(track_id, made.at(np.lexsort((made.horizon, made.due_s))), bundle)

    def discard(self, track_id: int) -> None:
        """Discard the pending forecasts of a track."""
        self._pending = self._pending.at(self._pending.track_id != track_id)

    def settle(self) -> None:
        """Update the calibration with the evaluated forecasts, in canonical order."""
        if not self._evaluated:
            return
        evaluated, self._evaluated = sorted(self._evaluated), []
        for horizon in range(len(HORIZONS_S)):
            own = [(one.score, one.size) for one in evaluated if one.horizon == horizon]
            if own:
                scores, sizes = np.array(own).T
                self._scores.record(horizon, scores[:, None], sizes[:, None])
        self._scores.settle()
        plan = self._scores.plan(HORIZONS_S, PROBABILITY)
        self._excess = plan.factor / plan.single

    def _compare(self, track_id: int, made: PendingForecasts, bundle: Bundle) -> None:
        path = bundle.path(made.due_s)
        error = path.state[:, None, :2] - made.mean
        # Predicted covariances exceed the errors of aircraft that do not manoeuvre. The error of
        # the reference is part of the actual errors, so it is not scaled.
        excess = self._excess[made.horizon][:, None]
        covariance = excess[..., None, None] * made.covariance
        scores, sizes = standardised(error, covariance, path.covariance[:, :2, :2])
        scores *= excess
        columns = (made.due_s, made.horizon, scores[:, 0], sizes[:, 0])
        rows = zip(*(column.tolist() for column in columns), strict=True)
        self._evaluated += [_Evaluated(track_id, *row) for row in rows]


# Whether times lie between two plots that are not too far apart.
def _is_between(plots_s: Floats, time_s: Floats) -> NDArray[np.bool_]:
    after = np.searchsorted(plots_s, time_s)
    inside = (after > 0) & (after < len(plots_s))
    gap_s = plots_s[np.where(inside, after, 1)] - plots_s[np.where(inside, after, 1) - 1]
    return np.asarray(inside & (gap_s <= GAP_MAX_S))
