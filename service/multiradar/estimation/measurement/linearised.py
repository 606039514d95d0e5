"""The linearised Cartesian form of a radar plot, as in the report.

The plot is converted to coordinates first; biases and noise of range and azimuth are then
transformed by the matrix C^ς at the estimated position of the aircraft. It serves the studies that
compare with the report: errors of range biases are four times those of the polar form, and 2.5
times their sigma, because the transformation is not linear in the azimuth.

Coordinates are ordered (east, north), as the Ω of the report requires, on a flat plane with the
azimuth clockwise from north.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def cartesian_plot(
    site_m: ArrayLike, range_m: ArrayLike, azimuth_rad: ArrayLike
) -> NDArray[np.float64]:
    """Return the position of a plot on the flat plane.

    Parameters
    ----------
    site_m : (..., 2) array_like
        East and north of the radar, m.
    range_m, azimuth_rad : (...) array_like
        Range on the plane, and azimuth clockwise from north.

    Returns
    -------
    (..., 2) ndarray
        East and north, m: the measurement z of equation (1.10).

    References
    ----------
    IMM UrO RAN report (2016), equation (1.10): z, on the axes of the Ω of (1.11).
    """
    direction = np.stack([np.sin(azimuth_rad), np.cos(azimuth_rad)], axis=-1)
    return np.asarray(site_m + np.asarray(range_m, np.float64)[..., None] * direction)
