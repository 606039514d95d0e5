"""The first tracks of a bundle: the best arc of the initial window, as each kind of motion."""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration import _layout as layout
from multiradar.restoration._memory import SettlingMemory
from multiradar.restoration._settling_kernels import settle
from multiradar.restoration._thinning_kernels import trace
from multiradar.restoration._window_kernels import inform
from multiradar.restoration.initial import arcs_through_triples
from multiradar.restoration.settings import BundleSettings

Floats = NDArray[np.float64]

#: What is known of place, speed and heading before any plot: standard deviations, m, m/s, rad.
_STATE_SIGMAS = (2000.0, 2000.0, 100.0, 1.0)
#: Probability of straight flight before anything is known.
_STRAIGHT_AT_FIRST = 0.6
#: Rounds in which a first track settles; far more than it needs.
_ROUNDS = 20


def first_tracks(plots: Floats, settings: BundleSettings, memory: SettlingMemory) -> Floats:
    """Return the first tracks of a bundle.

    Parameters
    ----------
    plots : (n, PLOT_COUNT) ndarray
        Plots of the initial window, columns as in `_layout`.
    settings : BundleSettings
        Rules of the bundle.
    memory : SettlingMemory
        To work in.

    Returns
    -------
    (k, TRACK_COUNT) ndarray
        One for each kind of motion, the best first, with the first plot's time for their anchor;
        none where no triple of plots makes an arc.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.1, for the arc; that it is only where the search begins
    is the project's own.
    """
    arcs = arcs_through_triples(plots[:, layout.TIME], plots[:, layout.TIME + 1 : layout.TIME + 3])
    if not arcs:
        return np.empty((0, layout.TRACK_COUNT))
    arc, anchor_s = arcs[0], float(plots[0, layout.TIME])
    flown = np.zeros(layout.TRACK_COUNT)
    flown[layout.COUNT] = 1.0
    flown[layout.EAST : layout.HEADING + 1] = (
        arc.east_m, arc.north_m, arc.speed_mps, arc.heading_rad,
    )  # fmt: skip
    limit = settings.lateral_max_mps2
    flown[layout.SEGMENTS + layout.LATERAL] = np.clip(arc.lateral_mps2, -limit, limit)
    state = np.empty((1, 4))
    trace(flown, arc.time_s, np.array([anchor_s]), state)
    flown[layout.EAST : layout.HEADING + 1] = state[0]
    kinds, rules = settings.kinds(), settings.rules()
    tracks = np.repeat(flown[None], layout.KINDS, axis=0)
    for kind, track in enumerate(tracks):
        _begin_as(track, kind, kinds, memory)
        share = _STRAIGHT_AT_FIRST
        if kind != layout.STRAIGHT:
            share = (1.0 - _STRAIGHT_AT_FIRST) / (layout.KINDS - 1)
        track[layout.BROUGHT] = np.log(share)
        settle(
            track, memory.spare, anchor_s, plots, 0, len(plots), float(plots[-1, layout.TIME]),
            kinds, rules, _ROUNDS, *memory[1:],
        )  # fmt: skip
    return tracks[np.argsort(-tracks[:, layout.WEIGHT], kind="stable")]


# Whatever the arc says of accelerations, a kind begins with what it knows; a turn as the arc.
def _begin_as(track: Floats, kind: int, kinds: Floats, memory: SettlingMemory) -> None:
    mean_u, sigma_u, mean_w, sigma_w = kinds[kind, :4]
    track[layout.SEGMENTS + layout.KIND] = kind
    track[layout.SEGMENTS + layout.LONGITUDINAL] = mean_w
    if kind not in (layout.RIGHT, layout.LEFT):
        track[layout.SEGMENTS + layout.LATERAL] = mean_u
    state = track[layout.EAST : layout.HEADING + 1]
    track[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 6] = (*state, mean_u, mean_w)
    covariance = np.diag(np.square([*_STATE_SIGMAS, sigma_u, sigma_w]))
    track[layout.PRIOR_COVARIANCE : layout.PRIOR_COVARIANCE + 36] = covariance.ravel()
    inform(track, memory.H, memory.H2)
