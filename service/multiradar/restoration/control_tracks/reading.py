"""Tracks of the kernels as control tracks, and their parameters."""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.tracks import ControlTrack

Floats = NDArray[np.float64]

#: Steps by which parameters are moved to see how the state depends on them: m, m/s, rad, then of a
#: segment its beginning (s) and accelerations (m/s²).
_STATE_STEPS = (0.1, 0.1, 0.01, 1e-5)
_BEGIN_STEP_S, _CONTROL_STEP_MPS2 = 1e-3, 1e-4


def segments_of(track: Floats) -> Floats:
    """Return the control segments of a track.

    Parameters
    ----------
    track : (TRACK_COUNT,) ndarray
        A track of the kernels.

    Returns
    -------
    (s, SEGMENT_COUNT) ndarray
        A view; columns as in `_layout`. The beginning of the first means nothing.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    count = int(track[layout.COUNT])
    end = layout.SEGMENTS + layout.SEGMENT_COUNT * count
    return track[layout.SEGMENTS : end].reshape(count, layout.SEGMENT_COUNT)


def kind_at(track: Floats, time_s: float) -> int:
    """Return the kind of the segment that a track is in.

    Parameters
    ----------
    track : (TRACK_COUNT,) ndarray
        A track of the kernels.
    time_s : float
        When.

    Returns
    -------
    int
        Number of `settings.KIND_NAMES`.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    segments = segments_of(track)
    place = int(np.sum(segments[1:, layout.BEGIN] <= time_s))
    return int(segments[place, layout.KIND])


def control_track_of(track: Floats, anchor_s: float) -> ControlTrack:
    """Return a track of the kernels as a control track.

    Parameters
    ----------
    track : (TRACK_COUNT,) ndarray
        A track of the kernels.
    anchor_s : float
        When its first segment begins.

    Returns
    -------
    ControlTrack
        The same motion, with values of its own.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    segments = segments_of(track)
    begins = segments[:, layout.BEGIN].copy()
    begins[0] = anchor_s
    return ControlTrack(
        track[layout.EAST : layout.HEADING + 1].copy(),
        begins,
        segments[:, layout.LATERAL].copy(),
        segments[:, layout.LONGITUDINAL].copy(),
    )


def parameters_of(count: int) -> tuple[list[int], list[float]]:
    """Return where the parameters of a track stand, and steps to take differences by.

    Parameters
    ----------
    count : int
        Segments of the track.

    Returns
    -------
    columns : list of int
        Columns of the track in the order of the derivatives of the functional.
    steps : list of float
        Small beside what plots tell of them, in their units.
    """
    columns = [layout.EAST, layout.NORTH, layout.SPEED, layout.HEADING]
    steps = list(_STATE_STEPS)
    for i in range(count):
        at = layout.SEGMENTS + layout.SEGMENT_COUNT * i
        if i:
            columns.append(at + layout.BEGIN)
            steps.append(_BEGIN_STEP_S)
        columns += [at + layout.LATERAL, at + layout.LONGITUDINAL]
        steps += [_CONTROL_STEP_MPS2] * 2
    return columns, steps
