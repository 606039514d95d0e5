"""Rows of `tracks.parquet` as the rows that the service retains."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.tracking.outputs import STATE_NAMES
from multiradar.tracking.roster import MISSING
from multiradar_schemas.measurements.callsigns import packed_callsigns

# Columns of a picture.
_NUMBERS = (
    "time_s", "track_id", "height_m", "height_sigma_m", "speed_mps", "velocity_sigma_mps",
    "position_sigma_m", "vertical_rate_mps", "turn_right_probability", "turn_left_probability",
)  # fmt: skip
_ANGLES = {
    "latitude_deg": "latitude_rad", "longitude_deg": "longitude_rad", "heading_deg": "heading_rad",
}  # fmt: skip
_OCTAL, _HEXADECIMAL = 8, 16


def update_rows(frame: pl.DataFrame, sensors: SensorTable) -> NDArray[np.void]:
    """Return rows with what a picture uses; the other fields are 0.

    Parameters
    ----------
    frame : DataFrame
        Rows of `tracks.parquet`.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    (n,) ndarray of `UPDATE_DTYPE`
        In the order of the frame; missing values are NaN or -1.
    """
    rows = np.zeros(len(frame), UPDATE_DTYPE)
    for name in _NUMBERS:
        rows[name] = frame[name].fill_null(np.nan).to_numpy()
    for name, field in _ANGLES.items():
        rows[field] = np.radians(frame[name].fill_null(np.nan).to_numpy())
    for name, base in (("mode_3a", _OCTAL), ("mode_s_address", _HEXADECIMAL)):
        # A few hundred rows: an expression of polars costs more than all of them.
        rows[name] = [_integer(text, base) for text in frame[name].to_list()]
    rows["callsign"] = packed_callsigns(frame["callsign"])
    rows["state"] = positions_in(frame["state"], STATE_NAMES, default=0)
    rows["on_ground"] = frame["on_ground"].cast(pl.Int8).fill_null(MISSING).to_numpy()
    rows["sensor"] = sensor_numbers(frame["sensor_id"], sensors)
    return rows


def _integer(text: str | None, base: int) -> int:
    try:
        return MISSING if text is None else int(text, base)
    except ValueError:
        return MISSING


def sensor_numbers(names: pl.Series, sensors: SensorTable) -> NDArray[np.int32]:
    """Return the numbers of sensors, -1 for unknown ones."""
    return positions_in(names, sensors.ids, default=MISSING)


def positions_in(texts: pl.Series, known: tuple[str, ...], *, default: int) -> NDArray[np.int32]:
    """Return the positions of texts in a tuple, or the default."""
    numbers = {name: number for number, name in enumerate(known)}
    found = texts.replace_strict(numbers, default=default, return_dtype=pl.Int32)
    positions: NDArray[np.int32] = found.fill_null(default).to_numpy()
    return positions
