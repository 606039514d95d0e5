"""Forecasts from bundles that learn from how far earlier ones were off.

Where an epoch ends at which states are sampled, the fans of a few bundles are kept. When a bundle
has gone on long enough, it says where its aircraft was at those times, and the errors are counted
as those of the filter's forecasts are. All of it happens in the thread that owns the bundles, at
the ends of epochs, so that what is learnt is a function of the measurements.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.bundle import Bundle
from multiradar.restoration.forecast.forecast import forecast
from multiradar.restoration.forecast.settings import ForecastSettings
from multiradar.tracking.forecast.forecast_calibration import GAP_MAX_S
from multiradar.tracking.forecast.forecast_scores import (
    HORIZONS_S,
    ForecastScores,
    Learnt,
    standardised,
)
from multiradar.tracking.forecast.pending import PendingForecasts
from multiradar.tracking.forecast.state_samples import SAMPLE_TRACKS_MAX, drawn

Floats = NDArray[np.float64]

SETTINGS = ForecastSettings()
#: A bundle is asked where its aircraft was when it has gone on for so long, s; or when its track
#: ends.
SETTLED_S = 15.0
#: It is asked of all times at once when the first of them was so long ago, s: well within its
#: window.
ASKED_AFTER_S = 45.0
#: Plots for which one forecast is made: the time that learning takes is a share of that of bundles.
PLOTS_EACH = 50.0
#: At the first so many samples so many tracks at least are forecast, for something is to be known
#: soon; at later ones one.
EAGER_SAMPLES, EAGER_TRACKS = 40, 3
#: Most forecasts, each of one horizon, that wait for their time: a bound of memory. Those of the
#: longest horizon and all shorter ones are half as many.
WAITING_MAX = 2000
#: Errors are taken to be as large as regions of this probability say.
PROBABILITY = 0.95
#: What is known at first.
NOTHING_LEARNT = ForecastScores(1, 0).learnt


class _Judged(NamedTuple):
    # One whose error is known.
    track_id: int
    due_s: float
    horizon: int
    score: float
    size: float


class FanScores:
    """What past forecasts from bundles tell of future ones; one owner."""

    def __init__(self) -> None:
        self._scores = ForecastScores(1, 0)
        self._pending = PendingForecasts.none(1)
        self._judged: list[_Judged] = []
        self._allowed, self._samples = 0.0, 0
        # How much larger than claimed the covariances of forecasts are, by horizon.
        self._excess = np.ones(len(HORIZONS_S))

    @property
    def learnt(self) -> Learnt:
        """What was learnt until the last sample."""
        return self._scores.learnt

    @property
    def heard(self) -> Floats:
        """Forecasts that count, by horizon; old ones count less."""
        return self._scores.heard

    @property
    def waiting(self) -> int:
        """Number of pending forecasts, each of one horizon."""
        return self._pending.rows

    def chosen(self, tracks: Sequence[int], epoch: int, plots: int) -> list[int]:
        """Return the tracks that are forecast at a sample, others each time.

        Parameters
        ----------
        tracks : sequence of int
            Those that may be, ascending.
        epoch : int
            Number of the epoch.
        plots : int
            Plots that bundles took since the sample before.

        Returns
        -------
        list of int
            One at least where there are any, `EAGER_TRACKS` at first, one for `PLOTS_EACH` plots,
            and never more than `SAMPLE_TRACKS_MAX`.
        """
        self._samples += 1
        least = EAGER_TRACKS if self._samples <= EAGER_SAMPLES else 1
        self._allowed = min(self._allowed + plots / PLOTS_EACH, float(SAMPLE_TRACKS_MAX))
        count = min(max(int(self._allowed), least), len(tracks))
        self._allowed = max(self._allowed - count, 0.0)
        places = drawn(np.array(tracks, np.int64), epoch, count)
        return [tracks[place] for place in places.tolist()]

    def make(self, track_id: int, bundle: Bundle) -> None:
        """Forecast by a bundle with tracks, at all horizons, and wait for their times."""
        horizons = len(HORIZONS_S)
        if self.waiting + horizons > WAITING_MAX:
            return
        fan = forecast(bundle.final_states(), HORIZONS_S, SETTINGS, bundle.manoeuvre_history)
        made = PendingForecasts(
            np.full(horizons, track_id), fan.time_s + HORIZONS_S, np.arange(horizons),
            fan.mean()[:, None, :2], fan.spread()[:, None, :2, :2], np.zeros((horizons, 3)),
        )  # fmt: skip
        self._pending = self._pending.followed_by(made)

    def judge(self, track_id: int, bundle: Bundle, time_s: float | None) -> None:
        """Compare forecasts whose time has come with where the bundle says that its aircraft was.

        Parameters
        ----------
        track_id : int
            A track.
        bundle : Bundle
            Its bundle.
        time_s : float or None
            Data time of now, s; None when this is the last that is heard of the track.
        """
        pending, due_s = self._pending, self._pending.due_s
        own = pending.track_id == track_id
        if not own.any() or not len(bundle):
            return
        begin_s, now_s = bundle.window_s
        until_s, waiting = now_s, own
        if time_s is not None:
            # No plot comes any more that would be near enough.
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

    def forget(self, track_id: int) -> None:
        """Wait for nothing more of a track."""
        self._pending = self._pending.at(self._pending.track_id != track_id)

    def settle(self) -> None:
        """Learn from all that was judged since the last time, in an order of its own."""
        if not self._judged:
            return
        judged, self._judged = sorted(self._judged), []
        for horizon in range(len(HORIZONS_S)):
            own = [(one.score, one.size) for one in judged if one.horizon == horizon]
            if own:
                scores, sizes = np.array(own).T
                self._scores.record(horizon, scores[:, None], sizes[:, None])
        self._scores.settle()
        plan = self._scores.plan(HORIZONS_S, PROBABILITY)
        self._excess = plan.factor / plan.single

    def _compare(self, track_id: int, made: PendingForecasts, bundle: Bundle) -> None:
        path = bundle.path(made.due_s)
        error = path.state[:, None, :2] - made.mean
        # A forecast ensemble claims more than errors are where no aircraft manoeuvres: the part of
        # them that the bundle still has is one of the errors as they are.
        excess = self._excess[made.horizon][:, None]
        covariance = excess[..., None, None] * made.covariance
        scores, sizes = standardised(error, covariance, path.covariance[:, :2, :2])
        scores *= excess
        columns = (made.due_s, made.horizon, scores[:, 0], sizes[:, 0])
        rows = zip(*(column.tolist() for column in columns), strict=True)
        self._judged += [_Judged(track_id, *row) for row in rows]


# Whether a bundle is sure of times: those between plots that are not too far apart.
def _is_between(plots_s: Floats, time_s: Floats) -> NDArray[np.bool_]:
    after = np.searchsorted(plots_s, time_s)
    inside = (after > 0) & (after < len(plots_s))
    gap_s = plots_s[np.where(inside, after, 1)] - plots_s[np.where(inside, after, 1) - 1]
    return np.asarray(inside & (gap_s <= GAP_MAX_S))
