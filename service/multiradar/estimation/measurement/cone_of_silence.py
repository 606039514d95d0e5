"""The cone of silence above a radar, where its azimuths are unreliable.

There are three reasons:

- The antenna beam ends at 40° to 50° of elevation. Plots above come through side lobes, with
  arbitrary azimuths.
- Near the axis an uncertainty δ of the position across the line of sight is not small relative to
  the ground range g. The azimuth is nonlinear by δ²/g² rad, an error for the linear filter: with
  δ = 100 m at g = 3 km it is 0.06°, as much as the noise.
- An error of the height h changes the ground range of a plot by tan(elevation) times that error.

The criterion is the ratio of ground range to height above the radar; 1 is an elevation of 45°.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError

#: Ratio of ground range to height above the radar at the edge of the cone: 45° of elevation.
CONE_RATIO = 1.0


def outside_cone(
    ground_range_m: ArrayLike,
    height_m: ArrayLike,
    site_height_m: ArrayLike,
    cone_ratio: float = CONE_RATIO,
) -> NDArray[np.bool_]:
    """Return whether the aircraft is outside the radar's cone of silence.

    Parameters
    ----------
    ground_range_m : (...) array_like
        Length of the line of sight on the radar's horizon, m.
    height_m, site_height_m : (...) array_like
        Heights of the aircraft and of the radar, m.
    cone_ratio : float
        Least ratio of ground range to height above the radar; 1 / tan(largest elevation).

    Returns
    -------
    (...) ndarray of bool
        False inside the cone, and for NaN. An aircraft below the radar is outside.

    Raises
    ------
    ConfigurationError
        If the ratio is negative or not a number.

    References
    ----------
    The project's own criterion; see the module.
    """
    if not cone_ratio >= 0.0:
        raise ConfigurationError(f"cone ratio: expected 0 or more, was {cone_ratio}")
    above = np.asarray(height_m, np.float64) - np.asarray(site_height_m, np.float64)
    return np.asarray(np.asarray(ground_range_m, np.float64) >= cone_ratio * above)
