"""The mean distance between two geometric tracks."""

import numpy as np

from multiradar.errors import ShapeError
from multiradar.restoration.control_tracks.tracks import GeometricTrack


def mean_distance(one: GeometricTrack, other: GeometricTrack) -> float:
    """Return the mean distance of two geometric tracks on one grid.

    Parameters
    ----------
    one, other : GeometricTrack
        At the same times.

    Returns
    -------
    float
        The mean over the grid, m.

    Raises
    ------
    ShapeError
        If the grids differ.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.4.
    """
    if not np.array_equal(one.time_s, other.time_s):
        raise ShapeError("tracks to compare", "one grid of times", one.time_s.shape, "two")
    apart = one.position_m - other.position_m
    return float(np.mean(np.hypot(apart[:, 0], apart[:, 1])))
