"""Conversion of tracks of the kernels to control tracks, and their parameters."""

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.tracks import ControlTrack

Floats = NDArray[np.float64]

#: Steps of the parameters for numerical derivatives: m, m/s, rad, then of a segment its start (s)
#: and accelerations (m/s²).
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
        A view; columns as in `_layout`. The start of the first segment is undefined.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    count = int(track[layout.COUNT])
    end = layout.SEGMENTS + layout.SEGMENT_COUNT * count
    return track[layout.SEGMENTS : end].reshape(count, layout.SEGMENT_COUNT)


def kinds_at(tracks: Floats, time_s: float) -> NDArray[np.int64]:
    """Return the kinds of the segments of tracks at a time.

    Parameters
    ----------
    tracks : (m, TRACK_COUNT) ndarray
        Tracks of the kernels.
    time_s : float
        The time.

    Returns
    -------
    (m,) int64
        Indices of `settings.KIND_NAMES`.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    shape = len(tracks), layout.SEGMENTS_MAX, layout.SEGMENT_COUNT
    segments = tracks[:, layout.SEGMENTS : layout.PRIOR_MEAN].reshape(shape)
    started = segments[:, 1:, layout.BEGIN] <= time_s
    # Rows after the last segment are undefined.
    started &= np.arange(1, layout.SEGMENTS_MAX) < tracks[:, layout.COUNT, None]
    kinds = segments[np.arange(len(tracks)), started.sum(axis=1), layout.KIND]
    return np.asarray(kinds, np.int64)


def control_track_of(track: Floats, anchor_s: float) -> ControlTrack:
    """Return a track of the kernels as a control track.

    Parameters
    ----------
    track : (TRACK_COUNT,) ndarray
        A track of the kernels.
    anchor_s : float
        Start time of its first segment.

    Returns
    -------
    ControlTrack
        The same motion, as a copy.

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
    """Return the columns of the parameters of a track, and steps for numerical derivatives.

    Parameters
    ----------
    count : int
        Segments of the track.

    Returns
    -------
    columns : list of int
        Columns of the track in the order of the derivatives of the functional.
    steps : list of float
        Small relative to the uncertainty of the parameters, in their units.
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
