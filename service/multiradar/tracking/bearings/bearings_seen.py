"""Bearings as they wait for others with which they tell where an aircraft is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model
from multiradar.tracking.association.association import Window

Floats = NDArray[np.float64]


class Seen(NamedTuple):
    """A bearing that waits.

    Attributes
    ----------
    time_s : float
        When.
    sensor : int
        By whom.
    azimuth_rad, elevation_rad : float
        As measured; the elevation NaN where there is none.
    height_m : float
        The height that was heard, NaN for none.
    site : (k,) float64
        Where it was seen from, as in `Model.sites`.
    moving : bool
        Whether that is a source that moves.
    """

    time_s: float
    sensor: int
    azimuth_rad: float
    elevation_rad: float
    height_m: float
    site: Floats
    moving: bool


def seen_in(window: Window, row: int, model: Model) -> Seen:
    """Return a bearing as it waits.

    Parameters
    ----------
    window : Window
        Rows.
    row : int
        Which of them.
    model : Model
        With the sites of the rows.

    Returns
    -------
    Seen
        The bearing.
    """
    batch, told = window.batch, window.batch.directions
    return Seen(
        time_s=float(batch.time_s[row]),
        sensor=int(batch.sensor[row]),
        azimuth_rad=float(batch.azimuth_rad[row]),
        elevation_rad=np.nan if told is None else float(told.elevation_rad[row]),
        height_m=float(batch.height_m[row]),
        site=model.sites[window.rows.seen[row]].copy(),
        moving=told is not None and bool(told.moves[row]),
    )
