"""Single items of category 062, of many tracks at once."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION
from multiradar.tracking.columns import row_type
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar_converters.asterix.writing.track_reports import UNDETERMINED

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Rows = NDArray[np.void]

#: A mode of movement is determined when its probability exceeds that of all others together.
LIKELY = 0.5
#: Slower climbs and descents count as level flight, m/s: 300 ft/min.
LEVEL_MPS = 1.524
# Columns of `SOURCES`.
PRIMARY, _SECONDARY, _MODE_S, _SQUITTER, _MULTILATERATION = range(5)
NO_SOURCE = -1
# Values of the parts of item 200.
_NONE, _RIGHT_OR_UP, _LEFT_OR_DOWN = range(3)
# Kinds of plots in item 340/TYP.
_TYPE_PRIMARY, _TYPE_SECONDARY, _TYPE_ROLL_CALL = 1, 2, 5


#: Retained columns of the last measurement of a track; names as in `MeasurementBatch`.
MEASURED_DTYPE = row_type(
    MeasurementBatch, ("kind", "range_m", "azimuth_rad", "height_m", "mode_3a", "mode_s_address")
)


def sources(measured: Rows, self_reported: NDArray[np.bool_]) -> Integers:
    """Return the source of each measurement as a column of `SOURCES`, `NO_SOURCE` for bearings.

    Parameters
    ----------
    measured : (n,) rows of `MEASURED_DTYPE`
        The measurements. A plot with an address is Mode S, one with a code or a height secondary,
        any other primary.
    self_reported : (n,) bool
        Whether the sensor relays reports of aircraft (ADS-B).
    """
    reported = measured["kind"] == KIND_POSITION
    return np.select(
        [
            measured["kind"] == KIND_BEARING,
            reported & self_reported,
            reported,
            measured["mode_s_address"] >= 0,
            _is_secondary(measured),
        ],
        [NO_SOURCE, _SQUITTER, _MULTILATERATION, _MODE_S, _SECONDARY],
        PRIMARY,
    )


def plot_types(measured: Rows) -> Integers:
    """Return the plot types of item 340/TYP."""
    return np.select(
        [measured["mode_s_address"] >= 0, _is_secondary(measured)],
        [_TYPE_ROLL_CALL, _TYPE_SECONDARY],
        _TYPE_PRIMARY,
    )


def ages(time_s: float, last_s: Floats) -> Floats:
    """Return ages; NaN for never, which is minus infinity."""
    return np.where(np.isinf(last_s), np.nan, time_s - last_s)


def movement(rows: Rows) -> tuple[Integers, Integers]:
    """Return parts TRANS and LONG of item 200, by the probabilities of the modes of motion."""
    right, left = rows["turn_right_probability"], rows["turn_left_probability"]
    changing = rows["speed_change_probability"]
    turning = np.select(
        [right > LIKELY, left > LIKELY, right + left < LIKELY],
        [_RIGHT_OR_UP, _LEFT_OR_DOWN, _NONE],
        UNDETERMINED,
    )
    # The modes do not distinguish acceleration from deceleration.
    speeding = np.where(changing < LIKELY, _NONE, UNDETERMINED)
    return turning, speeding


def climbing(climb_mps: Floats) -> Integers:
    """Return part VERT of item 200, by rates of climb, NaN for none."""
    return np.select(
        [np.isnan(climb_mps), climb_mps > LEVEL_MPS, climb_mps < -LEVEL_MPS],
        [UNDETERMINED, _RIGHT_OR_UP, _LEFT_OR_DOWN],
        _NONE,
    )


def _is_secondary(measured: Rows) -> NDArray[np.bool_]:
    coded = (measured["mode_3a"] >= 0) | ~np.isnan(measured["height_m"])
    return np.asarray(coded | (measured["mode_s_address"] >= 0))
