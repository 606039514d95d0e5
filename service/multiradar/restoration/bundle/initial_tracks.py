"""Initial tracks of a bundle: the best fit to the initial window for each kind of motion."""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle._window_kernels import write_information
from multiradar.restoration.bundle.initial_arcs import arc_rows
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import misfit
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._motion_kernels import SPEED_MIN
from multiradar.restoration.control_tracks._scratch import FitScratch
from multiradar.restoration.control_tracks._thinning_kernels import trace
from multiradar.restoration.control_tracks.settings import BundleSettings

Floats = NDArray[np.float64]

#: Prior standard deviations of position, speed and heading: m, m/s, rad.
_STATE_SIGMAS = (2000.0, 2000.0, 100.0, 1.0)
#: Prior probability of straight flight.
_STRAIGHT_AT_FIRST = 0.6
#: Fraction of turns and changes of speed of any size within the limits: the standard deviations of
#: their accelerations are a third of the limits. Departing aircraft accelerate by 4 m/s².
_ANY_SIZE, _LIMIT_SHARE = 0.3, 1.0 / 3.0
#: Initial motion: kind, whether of any size, probability.
_BEGINNINGS = (
    (layout.STRAIGHT, False, _STRAIGHT_AT_FIRST),
    *(
        (kind, wide, share * (1.0 - _STRAIGHT_AT_FIRST) / (layout.KINDS - 1))
        for wide, share in ((False, 1.0 - _ANY_SIZE), (True, _ANY_SIZE))
        for kind in range(1, layout.KINDS)
    ),
)
#: Maximum iterations of the fit of an initial track, far more than needed.
_ROUNDS = 20
#: Maximum number of plots of the initial window for triples: 1140 triples.
_PLOTS_TRIED_MAX = 20
#: Iterations of the robust fit of a straight line.
_LINE_ROUNDS = 4


def first_tracks(plots: Floats, settings: BundleSettings, memory: FitScratch) -> Floats:
    """Return the initial tracks of a bundle.

    Parameters
    ----------
    plots : (n, PLOT_COUNT) ndarray
        Plots of the initial window, columns as in `_layout`.
    settings : BundleSettings
        Parameters of the bundle.
    memory : FitScratch
        Scratch arrays.

    Returns
    -------
    (k, TRACK_COUNT) ndarray
        Two for each kind of motion, one for straight flight, the best first, anchored at the time
        of the first plot; none if no triple of plots forms an arc.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.1, for the arc; using it as an initial value of the fit
    is the project's own.
    """
    kinds, rules = settings.kinds(), settings.rules()
    anchor_s = float(plots[0, layout.TIME])
    initial = _initial_values(plots, settings)
    found = []
    for kind, wide, chance in _BEGINNINGS if len(initial) else ():
        settled = initial.copy()
        for track in settled:
            _begin_as(track, kind, settings.kinds()[kind, :4], memory)
            if wide:
                _widen(track, kind, settings, memory)
            track[layout.MERGED_WEIGHT] = np.log(chance)
            fit_track(
                track, anchor_s, plots, 0, len(plots), float(plots[-1, layout.TIME]), kinds, rules,
                _ROUNDS, memory,
            )  # fmt: skip
        weights = settled[:, layout.WEIGHT]
        if np.isfinite(weights).any():
            found.append(settled[int(np.nanargmax(weights))])
    tracks = np.array(found).reshape(-1, layout.TRACK_COUNT)
    return np.asarray(tracks[np.argsort(-tracks[:, layout.WEIGHT], kind="stable")])


# Initial values of the fit: the arc of the least deviations in time, the arc of the best weight (a
# wrong plot beside the path deviates little in time), and a straight line (arcs do not weight plots
# by accuracy).
def _initial_values(plots: Floats, settings: BundleSettings) -> Floats:
    arcs = arc_rows(
        plots[:, layout.TIME], plots[:, layout.PLOT_EAST : layout.PLOT_NORTH + 1], _PLOTS_TRIED_MAX
    )
    if not len(arcs):
        return np.empty((0, layout.TRACK_COUNT))
    anchor_s, limit, state = (
        float(plots[0, layout.TIME]),
        settings.lateral_max_mps2,
        np.empty((1, 4)),
    )
    tracks = np.zeros((len(arcs) + 1, layout.TRACK_COUNT))
    tracks[:, layout.COUNT] = 1.0
    for arc, track in zip(arcs, tracks, strict=False):
        track[layout.EAST : layout.HEADING + 1] = arc[1:5]
        track[layout.SEGMENTS + layout.LATERAL] = np.clip(arc[5], -limit, limit)
        trace(track, float(arc[0]), np.array([anchor_s]), state)
        track[layout.EAST : layout.HEADING + 1] = state[0]
    tracks[-1, layout.EAST : layout.HEADING + 1] = _line(plots)
    misfits = [misfit(track, anchor_s, plots, 0, len(plots)) for track in tracks[:-1]]
    return np.asarray(tracks[[0, int(np.argmin(misfits)), -1]])


# Position, speed and heading at the first plot of the best straight line: least squares,
# iteratively reweighted by the probability that each plot is good.
def _line(plots: Floats) -> Floats:
    since_s = plots[:, layout.TIME] - plots[0, layout.TIME]
    a, b, c = plots[:, layout.EAST_EAST], plots[:, layout.EAST_NORTH], plots[:, layout.NORTH_NORTH]
    known = np.array([[a, b], [b, c]]).transpose(2, 0, 1)
    seen = plots[:, layout.PLOT_EAST : layout.PLOT_NORTH + 1]
    origin = seen[0]
    powers = np.stack([np.ones_like(since_s), since_s], axis=-1)
    good = np.ones(len(plots))
    for _ in range(_LINE_ROUNDS):
        weighted = good[:, None, None] * known
        information = np.einsum("kp,kq,kij->piqj", powers, powers, weighted).reshape(4, 4)
        vector = np.einsum("kp,kij,kj->pi", powers, weighted, seen - origin).ravel()
        line = np.linalg.lstsq(information, vector, rcond=None)[0].reshape(2, 2)
        off = powers @ line + origin - seen
        half = 0.5 * np.einsum("ki,kij,kj->k", off, known, off)
        good = 1.0 / (1.0 + np.exp(np.minimum(plots[:, layout.FLOOR] + half, 700.0)))
    speed = max(float(np.hypot(*line[1])), SPEED_MIN)
    return np.array([*(line[0] + origin), speed, np.arctan2(line[1, 0], line[1, 1])])


# Accelerations start at the means of the kind, except the lateral one of a turn, from the arc.
def _begin_as(track: Floats, kind: int, controls: Floats, memory: FitScratch) -> None:
    mean_u, sigma_u, mean_w, sigma_w = controls
    track[layout.SEGMENTS + layout.KIND] = kind
    track[layout.SEGMENTS + layout.LONGITUDINAL] = mean_w
    if kind not in (layout.RIGHT, layout.LEFT):
        track[layout.SEGMENTS + layout.LATERAL] = mean_u
    state = track[layout.EAST : layout.HEADING + 1]
    track[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 6] = (*state, mean_u, mean_w)
    covariance = np.diag(np.square([*_STATE_SIGMAS, sigma_u, sigma_w]))
    track[layout.PRIOR_COVARIANCE : layout.PRIOR_COVARIANCE + 36] = covariance.ravel()
    write_information(track, memory.H, memory.H2)


# Widens the prior of the acceleration of a kind to any size within the limits.
def _widen(track: Floats, kind: int, settings: BundleSettings, memory: FitScratch) -> None:
    turns = kind in (layout.RIGHT, layout.LEFT)
    limit = settings.lateral_max_mps2 if turns else settings.longitudinal_max_mps2
    at = layout.PRIOR_COVARIANCE + (28 if turns else 35)
    track[at] = max(track[at], (_LIMIT_SHARE * limit) ** 2)
    write_information(track, memory.H, memory.H2)
