"""Forecast of an aircraft from its bundle: an ensemble of weighted trajectories.

Every track is continued: its last segment for one of several remaining durations, then straight
flight, then possibly a manoeuvre that has not started yet. See docs/howto/trajectory-forecasts.md.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, TimeOrderError
from multiradar.estimation.array_checks import finite_array
from multiradar.restoration.bundle.final_states import FinalStates
from multiradar.restoration.bundle.manoeuvre_history import ManoeuvreHistory
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.forecast import _forecast_kernels as kernels
from multiradar.restoration.forecast.ensemble import ForecastEnsemble
from multiradar.restoration.forecast.later_manoeuvres import (
    STEP_S,
    later_turn_moments,
    rounded_duration_s,
)
from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Continuations(NamedTuple):
    """Continuations of final states: track, weight, duration and its variance of each."""

    track: Integers
    share: Floats
    lasts_s: Floats
    variance_s2: Floats


def forecast(
    ends: FinalStates, ahead_s: ArrayLike, settings: ForecastSettings, history: ManoeuvreHistory
) -> ForecastEnsemble:
    """Return a forecast ensemble.

    Parameters
    ----------
    ends : FinalStates
        Final states of the bundle.
    ahead_s : (k,) array_like
        Ascending times after the last plot, s, 0 to `AHEAD_MAX_S`.
    settings : ForecastSettings
        Parameters of forecasts.
    history : ManoeuvreHistory
        Times of straight flight and manoeuvres of the aircraft.

    Returns
    -------
    ForecastEnsemble
        The forecast of a time does not depend on the other times.

    Raises
    ------
    ConfigurationError
        If a time is out of range.
    TimeOrderError
        If the times do not ascend.
    ShapeError
        If they are not finite.
    """
    ahead = require_ahead(ahead_s)
    straight_s = rounded_duration_s(
        history.mean_straight_s(settings.straight_s, settings.turn_s, settings.habit_s)
    )
    continued = _continuations(ends, _weights(ends, straight_s, settings), settings)
    later = later_turn_moments(straight_s, settings)
    rules = np.empty(5)
    rules[kernels.STEP_S], rules[kernels.ENDING_RATE] = STEP_S, 1.0 / straight_s
    rules[kernels.TURN_SHARE] = settings.later_turns
    rules[kernels.SPEED_CHANGE] = settings.speed_change_mps
    rules[kernels.DENSITY] = settings.velocity_density
    count, times, new = len(continued.track), len(ahead), kernels.LATER
    weight = np.empty((count, times, new))
    state, covariance = np.empty((*weight.shape, 4)), np.empty((*weight.shape, 4, 4))
    scratch = np.empty((4, 6)), np.empty((4, 4)), np.empty((4, 4))
    for i, (track, share, lasts_s, variance) in enumerate(zip(*continued, strict=True)):
        kernels.continue_track(
            ends.motion[track], ends.covariance[track], lasts_s, variance, share, ahead, later,
            rules, *scratch, weight[i], state[i], covariance[i],
        )  # fmt: skip
    return ForecastEnsemble(
        ends.time_s, ahead, np.repeat(continued.track, new),
        np.repeat(np.where(continued.variance_s2 > 0.0, continued.lasts_s, np.inf), new),
        np.tile(np.arange(new), count), _by_time(weight), _by_time(state), _by_time(covariance),
    )  # fmt: skip


def require_ahead(ahead_s: ArrayLike) -> Floats:
    """Return times ahead if they are valid.

    Parameters
    ----------
    ahead_s : (k,) array_like
        Times after the last plot, s.

    Returns
    -------
    (k,) ndarray
        The same times.

    Raises
    ------
    ConfigurationError
        If a time is out of range.
    TimeOrderError
        If the times do not ascend.
    ShapeError
        If they are not finite.
    """
    ahead = finite_array(ahead_s, "times ahead", (None,))
    wrong = ahead[(ahead < 0.0) | (ahead > AHEAD_MAX_S)]
    if len(wrong):
        raise ConfigurationError(f"time ahead: expected 0 to {AHEAD_MAX_S:g} s, was {wrong[0]:g} s")
    back = np.flatnonzero(np.diff(ahead) < 0.0)
    if len(back):
        raise TimeOrderError("times ahead", float(ahead[back[0] + 1]), float(ahead[back[0]]))
    return ahead


def remaining_durations(mean_s: float, count: int) -> tuple[Floats, Floats]:
    """Return equally likely remaining durations of a segment that ends at a constant rate.

    Parameters
    ----------
    mean_s : float
        Mean duration.
    count : int
        Number of durations.

    Returns
    -------
    durations, variances : (count,) ndarray
        Means and variances within cells of equal probability; the mixture has the mean and the
        variance of the whole.

    References
    ----------
    The project's own: integrals of t e^(−t) and t² e^(−t) over each cell.
    """
    edges = -np.log1p(-np.arange(count) / count)
    left = np.exp(-edges)
    # Negative antiderivatives of t e^(−t) and t² e^(−t); they vanish at infinity.
    first = np.append((edges + 1.0) * left, 0.0)
    second = np.append((edges * edges + 2.0 * edges + 2.0) * left, 0.0)
    means, squares = -np.diff(first) * count, -np.diff(second) * count
    return mean_s * means, mean_s**2 * (squares - means**2)


# Probabilities of the tracks with the rates of the forecast instead of those of the bundle.
def _weights(ends: FinalStates, straight_s: float, settings: ForecastSettings) -> Floats:
    expected = np.array([settings.turn_s] * layout.KINDS)
    expected[layout.STRAIGHT] = straight_s
    expected[[layout.FASTER, layout.SLOWER]] = settings.speeding_s
    kind = ends.segment_kind
    there = kind >= 0
    stop = np.append(ends.segment_begin_s[:, 1:], np.full((len(ends), 1), np.inf), axis=1)
    begin = np.where(there, ends.segment_begin_s, 0.0)
    lasted = np.where(there, np.minimum(stop, ends.time_s) - begin, 0.0)
    ended = there & np.isfinite(stop)
    slower = np.where(there, ends.ending_rate[kind] - 1.0 / expected[kind], 0.0)
    ratio = np.where(ended, -np.log(expected[kind] * ends.ending_rate[kind]), 0.0)
    logarithm = np.log(np.maximum(ends.weight, 1e-300)) + np.sum(slower * lasted + ratio, axis=1)
    weight = np.exp(logarithm - logarithm.max())
    weight /= weight.sum()
    weight[weight < settings.weight_min] = 0.0
    return np.asarray(weight / weight.sum())


def _continuations(
    ends: FinalStates, weights: Floats, settings: ForecastSettings
) -> _Continuations:
    turn = remaining_durations(settings.turn_s, settings.durations)
    speeding = remaining_durations(settings.speeding_s, settings.durations)
    kinds = ends.kind_at(ends.time_s)
    parts = []
    for track in np.flatnonzero(weights > 0.0).tolist():
        kind = int(kinds[track])
        lasts, variance = np.zeros(1), np.zeros(1)
        if kind != layout.STRAIGHT:
            lasts, variance = speeding if kind in (layout.FASTER, layout.SLOWER) else turn
        share = np.full(len(lasts), weights[track] / len(lasts))
        parts.append((np.full(len(lasts), track), share, lasts, variance))
    return _Continuations(*(np.concatenate(part) for part in zip(*parts, strict=True)))


# From (continuations, times, later, …) to (times, members, …).
def _by_time(values: Floats) -> Floats:
    ordered = np.moveaxis(values, 1, 0)
    return np.ascontiguousarray(ordered.reshape(len(ordered), -1, *values.shape[3:]))
