"""States of the tracks of a bundle at the last plot, from which a forecast starts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.path import FitWindow, sound_weights
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import state_at
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._scratch import FitScratch
from multiradar.restoration.control_tracks.reading import parameters_of, segments_of
from multiradar.restoration.control_tracks.shared_errors import shared_at

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Columns of `FinalStates.motion`.
EAST, NORTH, SPEED, HEADING, LATERAL, LONGITUDINAL = range(6)
_CONTROLS = [layout.LATERAL, layout.LONGITUDINAL]


@dataclass(frozen=True, slots=True, eq=False)
class FinalStates:
    """States of the tracks of a bundle at its last plot, the best first.

    Segments that start after the last plot are omitted.

    Attributes
    ----------
    time_s : float
        Time of the last plot.
    begin_s : float
        Start time of the tracks.
    weight : (m,) float64
        Probabilities of the tracks, with sum one.
    motion : (m, 6) float64
        East and north, m; speed, m/s; heading, rad; lateral and longitudinal acceleration, m/s².
    covariance : (m, 6, 6) float64
        Covariance of the errors of `motion`, linearised.
    segment_kind : (m, s) int64
        Numbers of `settings.KIND_NAMES`, the first segment first; −1 where a track has no more.
    segment_begin_s : (m, s) float64
        Start time of each; infinite where there is none.
    ending_rate : (5,) float64
        Rates at which segments of each kind end in the bundle, 1/s.
    shared_m2 : (2, 2) float64
        Covariance of the position errors that are common to plots.
    """

    time_s: float
    begin_s: float
    weight: Floats
    motion: Floats
    covariance: Floats
    segment_kind: Integers
    segment_begin_s: Floats
    ending_rate: Floats
    shared_m2: Floats

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self.weight)

    def kind_at(self, time_s: float) -> Integers:
        """Return the kind of the segment of each track at a time.

        Parameters
        ----------
        time_s : float
            Time; before the start of the tracks their first segments apply.

        Returns
        -------
        (m,) ndarray
            Numbers of `settings.KIND_NAMES`.
        """
        segment = np.sum(self.segment_begin_s[:, 1:] <= time_s, axis=1)
        return np.asarray(self.segment_kind[np.arange(len(self)), segment])


def final_states_of(
    tracks: Floats, weights: Floats, window: FitWindow, memory: FitScratch
) -> FinalStates:
    """Return the states of weighted tracks at the last plot.

    Parameters
    ----------
    tracks : (m, TRACK_COUNT) ndarray
        At least as many as weights; not changed.
    weights : (w,) ndarray
        Weights of the first tracks, with sum one.
    window : FitWindow
        Plots and parameters of the functional.
    memory : FitScratch
        Scratch arrays.

    Returns
    -------
    FinalStates
        At the last plot. A track without a covariance has weight 0.

    Raises
    ------
    TrajectoryError
        If no track has a covariance: `NO_COVARIANCE`.

    References
    ----------
    The project's own: the covariance is J H⁻¹ Jᵀ with the derivatives J of the motion by the
    parameters of the track, and H that of the functional; common errors of plots are added.
    """
    anchor_s, plots, kinds, rules = window
    count, now_s = len(weights), float(plots[-1, layout.TIME])
    motion, covariance = np.empty((count, 6)), np.zeros((count, 6, 6))
    sound = np.ones(count, np.bool_)
    kind = np.full((count, layout.SEGMENTS_MAX), -1)
    begin_s = np.full((count, layout.SEGMENTS_MAX), np.inf)
    for i in range(count):
        segments = segments_of(tracks[i])
        started = 1 + int(np.sum(segments[1:, layout.BEGIN] <= now_s))
        kind[i, :started] = segments[:started, layout.KIND]
        begin_s[i, :started] = segments[:started, layout.BEGIN]
        begin_s[i, 0] = anchor_s
        moved = tracks[i].copy()
        fit_track(moved, anchor_s, plots, 0, len(plots), now_s, kinds, rules, 0, memory)
        motion[i] = _motion(moved, anchor_s, now_s, started - 1)
        sound[i] = moved[layout.WEIGHT] > -np.inf
        if not sound[i]:
            continue
        columns, steps = parameters_of(len(segments))
        slopes = np.empty((len(columns), 6))
        for j, (column, step) in enumerate(zip(columns, steps, strict=True)):
            moved[column] = tracks[i, column] + step
            ahead = _motion(moved, anchor_s, now_s, started - 1)
            moved[column] = tracks[i, column] - step
            slopes[j] = (ahead - _motion(moved, anchor_s, now_s, started - 1)) / (2.0 * step)
            moved[column] = tracks[i, column]
        factor = np.tril(memory.H[: len(columns), : len(columns)])
        root = np.linalg.solve(factor, slopes)
        covariance[i] = root.T @ root
    shared = shared_at(plots, np.array([now_s]))
    covariance[:, :2, :2] += shared
    return FinalStates(
        now_s, anchor_s, sound_weights(weights, sound), motion, covariance, kind, begin_s,
        kinds[:, layout.ENDING].copy(), shared[0],
    )  # fmt: skip


def _motion(track: Floats, anchor_s: float, time_s: float, segment: int) -> Floats:
    state = np.empty(4)
    state_at(track, anchor_s, time_s, state)
    return np.append(state, segments_of(track)[segment][_CONTROLS])
