"""Longitudes as directions: 180° W and 180° E are the same."""

import numpy as np
from numpy.typing import ArrayLike


def median_longitude(longitude_rad: ArrayLike) -> float:
    """Return the median of longitudes, also across the antimeridian.

    Parameters
    ----------
    longitude_rad : array_like
        Longitudes, rad; NaN is left out.

    Returns
    -------
    float
        Median, rad. Where they extend over more than half a turn, they are ordered from the
        meridian opposite to the direction of their sum. NaN for none.
    """
    known = np.asarray(longitude_rad, np.float64)
    known = known[~np.isnan(known)]
    if not len(known):
        return float("nan")
    middle = float(np.median(known))
    if np.ptp(known) > np.pi:
        towards = float(np.angle(np.exp(1j * known).sum()))
        away = np.median(np.mod(known - towards + np.pi, 2.0 * np.pi) - np.pi)
        middle = float(np.mod(towards + away + np.pi, 2.0 * np.pi) - np.pi)
    return middle
