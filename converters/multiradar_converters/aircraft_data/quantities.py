"""The quantities of aircraft-derived data, as the columns of one array.

Column k of such an array is `QUANTITIES[k]` in the unit of its name; NaN for absent.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT
from multiradar_schemas.measurements.units import FOOT_M

Numbers = NDArray[np.float64]

QUANTITIES = MEASUREMENT_AIRCRAFT
(
    MAGNETIC_HEADING,
    ROLL,
    TRACK_ANGLE,
    TRACK_ANGLE_RATE,
    GROUND_SPEED,
    TRUE_AIRSPEED,
    INDICATED_AIRSPEED,
    MACH,
    VERTICAL_RATE,
    SELECTED_ALTITUDE,
) = range(len(QUANTITIES))
COUNT = len(QUANTITIES)

REVOLUTION_DEG = 360.0
FOOT_PER_MIN_M_S = FOOT_M / 60.0


def absent(count: int) -> Numbers:
    """Return an array without any value, float64[count, 10]."""
    return np.full((count, COUNT), np.nan)


def without(count: int) -> Numbers:
    """Return an array of a source that has no aircraft-derived data, float64[count, 0]."""
    return np.empty((count, 0))


def blank(values: Numbers, where: NDArray[np.bool_], quantities: Sequence[int]) -> None:
    """Remove quantities of some reports, in place."""
    values[np.flatnonzero(where)[:, None], np.array(quantities)] = np.nan


def first_of(*columns: Numbers) -> Numbers:
    """Return the first value that is not NaN, of each row."""
    values = columns[0]
    for other in columns[1:]:
        values = np.where(np.isnan(values), other, values)
    return values


def joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Join arrays of one or two dimensions, of one at least.

    Of the latter, those of sources without data are filled where another source has data.
    """
    if parts[0].ndim == 1 or all(part.shape[1] == 0 for part in parts):
        return np.concatenate(parts)
    return np.concatenate([part if part.shape[1] else absent(len(part)) for part in parts])


def named_columns(values: Numbers) -> Iterable[tuple[str, Numbers]]:
    """Yield name and values of the columns that have any value."""
    for k, name in enumerate(QUANTITIES if values.shape[1] else ()):
        column = np.ascontiguousarray(values[:, k])
        if not np.isnan(column).all():
            yield name, column
