"""Buffered bearings for track initiation by triangulation."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model
from multiradar.tracking.association.window_association import AssociationWindow

Floats = NDArray[np.float64]


class WaitingBearing(NamedTuple):
    """A buffered bearing.

    Attributes
    ----------
    time_s : float
        Time of the measurement.
    sensor : int
        Number of the sensor.
    azimuth_rad, elevation_rad : float
        As measured; elevation NaN for none.
    height_m : float
        Received height, NaN for none.
    site : (k,) float64
        Site of the source, as in `Model.sites`.
    moving : bool
        Whether the source moves.
    """

    time_s: float
    sensor: int
    azimuth_rad: float
    elevation_rad: float
    height_m: float
    site: Floats
    moving: bool


def bearing_of_row(window: AssociationWindow, row: int, model: Model) -> WaitingBearing:
    """Return a row as a buffered bearing.

    Parameters
    ----------
    window : AssociationWindow
        The rows.
    row : int
        Index of the row.
    model : Model
        Model with the sites of the rows.

    Returns
    -------
    WaitingBearing
        The bearing.
    """
    batch, directions = window.batch, window.batch.directions
    return WaitingBearing(
        time_s=float(batch.time_s[row]),
        sensor=int(batch.sensor[row]),
        azimuth_rad=float(batch.azimuth_rad[row]),
        elevation_rad=np.nan if directions is None else float(directions.elevation_rad[row]),
        height_m=float(batch.height_m[row]),
        site=model.sites[window.rows.seen[row]].copy(),
        moving=directions is not None and bool(directions.moves[row]),
    )
