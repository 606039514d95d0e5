"""Wrapping of angles."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def wrapped(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the same directions as angles in [−π, π).

    Parameters
    ----------
    angle_rad : array_like
        Angles, rad, such as differences of azimuths.

    Returns
    -------
    ndarray
        Angles, rad. Those within [−π, π) are returned unchanged.

    References
    ----------
    D. E. Knuth, "The Art of Computer Programming", volume 1, section 1.2.4: the remainder modulo
    2π, shifted to start at −π.
    """
    angle = np.asarray(angle_rad, np.float64)
    turn = 2.0 * np.pi
    inside = (angle >= -np.pi) & (angle < np.pi)
    moved = angle - turn * np.floor((angle + np.pi) / turn)
    # Rounding may reach π itself; π and −π are the same direction.
    return np.where(inside, angle, np.where(moved >= np.pi, -np.pi, moved))
