"""How the tracks of a bundle end: the motion at the last plot, from which a forecast goes on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle.path import Window, sound_weights
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
    """The tracks of a bundle at its last plot, the best first.

    A segment that would begin after the last plot is left out: no plot tells of it.

    Attributes
    ----------
    time_s : float
        Of the last plot.
    begin_s : float
        When the tracks begin.
    weight : (m,) float64
        Probabilities of the tracks, of sum one.
    motion : (m, 6) float64
        East and north, m; speed, m/s; heading, rad; lateral and longitudinal acceleration, m/s².
    covariance : (m, 6, 6) float64
        Of the errors of `motion`, linearised.
    segment_kind : (m, s) int64
        Numbers of `settings.KIND_NAMES`, the first segment first; −1 where a track has no more.
    segment_begin_s : (m, s) float64
        When each begins; infinite where there is none.
    ending_rate : (5,) float64
        Rates at which the bundle took segments of each kind to end, 1/s.
    shared_m2 : (2, 2) float64
        The part of the covariance of each place that plots share.
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
        """Return the kind of the segment that each track is in at a time.

        Parameters
        ----------
        time_s : float
            Before the beginning of the tracks it is that of their first segments.

        Returns
        -------
        (m,) ndarray
            Numbers of `settings.KIND_NAMES`.
        """
        begun = np.sum(self.segment_begin_s[:, 1:] <= time_s, axis=1)
        return np.asarray(self.segment_kind[np.arange(len(self)), begun])


def final_states_of(
    tracks: Floats, weights: Floats, window: Window, memory: FitScratch
) -> FinalStates:
    """Return how weighted tracks end.

    Parameters
    ----------
    tracks : (m, TRACK_COUNT) ndarray
        At least as many as weights; they stay as they are.
    weights : (w,) ndarray
        Of the first tracks, of sum one.
    window : Window
        What they are judged by.
    memory : FitScratch
        To work in.

    Returns
    -------
    FinalStates
        At the last plot. A track whose covariance cannot be told weighs nothing.

    Raises
    ------
    TrajectoryError
        If it can be told of none: `NO_COVARIANCE`.

    References
    ----------
    The project's own: the covariance is J H⁻¹ Jᵀ with the derivatives J of the motion by the
    parameters of the track, and H that of the functional; errors that plots share are added.
    """
    anchor_s, plots, kinds, rules = window
    count, now_s = len(weights), float(plots[-1, layout.TIME])
    motion, covariance = np.empty((count, 6)), np.zeros((count, 6, 6))
    sound = np.ones(count, np.bool_)
    kind = np.full((count, layout.SEGMENTS_MAX), -1)
    begin_s = np.full((count, layout.SEGMENTS_MAX), np.inf)
    for i in range(count):
        segments = segments_of(tracks[i])
        begun = 1 + int(np.sum(segments[1:, layout.BEGIN] <= now_s))
        kind[i, :begun] = segments[:begun, layout.KIND]
        begin_s[i, :begun] = segments[:begun, layout.BEGIN]
        begin_s[i, 0] = anchor_s
        moved = tracks[i].copy()
        fit_track(
            moved, memory.spare, anchor_s, plots, 0, len(plots), now_s, kinds, rules, 0,
            *memory[1:],
        )  # fmt: skip
        motion[i] = _motion(moved, anchor_s, now_s, begun - 1)
        sound[i] = moved[layout.WEIGHT] > -np.inf
        if not sound[i]:
            continue
        columns, steps = parameters_of(len(segments))
        slopes = np.empty((len(columns), 6))
        for j, (column, step) in enumerate(zip(columns, steps, strict=True)):
            moved[column] = tracks[i, column] + step
            ahead = _motion(moved, anchor_s, now_s, begun - 1)
            moved[column] = tracks[i, column] - step
            slopes[j] = (ahead - _motion(moved, anchor_s, now_s, begun - 1)) / (2.0 * step)
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


def _motion(track: Floats, anchor_s: float, time_s: float, place: int) -> Floats:
    state = np.empty(4)
    state_at(track, anchor_s, time_s, state)
    return np.append(state, segments_of(track)[place][_CONTROLS])
