"""The motion of a bundle at many times, with covariances."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.restoration.bundle._path_kernels import (
    PathScratch,
    TrackPaths,
    trace_with_spreads,
)
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._scratch import FitScratch
from multiradar.restoration.control_tracks.reading import parameters_of
from multiradar.restoration.control_tracks.settings import KIND_NAMES
from multiradar.restoration.control_tracks.shared_errors import shared_at

Floats = NDArray[np.float64]

# Tracks of fewer segments use the first of them.
_COLUMNS, _STEPS = map(np.array, parameters_of(layout.SEGMENTS_MAX))


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """The motion at times on a grid.

    Attributes
    ----------
    time_s : (k,) float64
        Ascending times.
    state : (k, 4) float64
        East and north, m, and their rates, m/s.
    covariance : (k, 4, 4) float64
        Covariance of the errors of `state`: of each track, of the differences between tracks, and
        of the common errors of plots.
    lateral_mps2, longitudinal_mps2 : (k,) float64
        Accelerations to the right and forwards.
    kind_probability : (k, 5) float64
        Probabilities of the kinds of `settings.KIND_NAMES`.
    """

    time_s: Floats
    state: Floats
    covariance: Floats
    lateral_mps2: Floats
    longitudinal_mps2: Floats
    kind_probability: Floats


class FitWindow(NamedTuple):
    """Plots and parameters of the functional of tracks.

    Attributes
    ----------
    anchor_s : float
        Time of the anchor of the tracks.
    plots : (n, PLOT_COUNT) float64
        The plots of the window.
    kinds, rules : ndarray
        Tables of `BundleSettings`.
    """

    anchor_s: float
    plots: Floats
    kinds: Floats
    rules: Floats


def path_of(
    tracks: Floats, weights: Floats, window: FitWindow, time_s: Floats, memory: FitScratch
) -> Path:
    """Return the mean motion of weighted tracks.

    Parameters
    ----------
    tracks : (m, TRACK_COUNT) ndarray
        At least as many as weights; not changed.
    weights : (w,) ndarray
        Weights of the first tracks, with sum one.
    window : FitWindow
        Plots and parameters of the functional.
    time_s : (k,) ndarray
        Ascending times.
    memory : FitScratch
        Scratch arrays.

    Returns
    -------
    Path
        At these times.

    Raises
    ------
    TrajectoryError
        If no track has a covariance: `NO_COVARIANCE`.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.5, for the mean. The covariance is the project's own: of
    each track by its parameters, the moments of the mixture, and common errors.
    """
    many, count = len(weights), len(time_s)
    time_s = np.ascontiguousarray(time_s)
    scratch = PathScratch(
        np.empty(layout.TRACK_COUNT),
        np.empty((count, 4)),
        np.empty((count, 4, layout.PARAMETERS_MAX)),
    )
    paths = TrackPaths(
        np.empty((many, count, 4)),
        np.empty((many, count, 4, 4)),
        np.empty((many, count), np.int64),
        np.empty(many, np.bool_),
    )
    trace_with_spreads(
        tracks, many, window.anchor_s, time_s, window.plots, window.kinds, window.rules, _COLUMNS,
        _STEPS, memory, scratch, paths,
    )  # fmt: skip
    weights = sound_weights(weights, paths.sound)
    at = layout.SEGMENTS + layout.SEGMENT_COUNT * paths.segments
    rows = np.arange(many)[:, None]
    lateral, longitudinal, kind = (
        tracks[rows, at + column] for column in (layout.LATERAL, layout.LONGITUDINAL, layout.KIND)
    )
    chances = [weights @ (kind == number) for number in range(len(KIND_NAMES))]
    mean = np.einsum("i,ikc->kc", weights, paths.states)
    off = paths.states - mean
    covariance = np.einsum("i,ikcd->kcd", weights, paths.spreads)
    covariance += np.einsum("i,ikc,ikd->kcd", weights, off, off)
    covariance[:, :2, :2] += shared_at(window.plots, time_s)
    return Path(
        time_s,
        mean,
        covariance,
        weights @ lateral,
        weights @ longitudinal,
        np.column_stack(chances),
    )


def sound_weights(weights: Floats, sound: NDArray[np.bool_]) -> Floats:
    """Return weights with 0 for tracks without a covariance.

    Parameters
    ----------
    weights : (m,) ndarray
        Of sum one.
    sound : (m,) bool ndarray
        Which tracks have a covariance: the second derivatives of their functional are positive
        definite.

    Returns
    -------
    (m,) ndarray
        Weights with sum one; unchanged if all are sound.

    Raises
    ------
    TrajectoryError
        If no track with a weight has a covariance: `NO_COVARIANCE`.
    """
    if sound.all():
        return weights
    left = np.where(sound, weights, 0.0)
    total = float(left.sum())
    if not total > 0.0:
        reason = f"none of {len(weights)} trajectories has a covariance"
        raise TrajectoryError("NO_COVARIANCE", reason)
    return np.asarray(left / total)
