"""Single items of category 062, of many tracks at once."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION
from multiradar.tracking.columns import row_type
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.roster import MISSING
from multiradar_converters.asterix.writing.track_reports import SOURCES, UNDETERMINED
from multiradar_schemas.measurements.measurement import DETECTIONS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Rows = NDArray[np.void]
Flags = NDArray[np.bool_]

#: A mode of movement is determined when its probability exceeds that of all others together.
LIKELY = 0.5
#: Slower climbs and descents count as level flight, m/s: 300 ft/min.
LEVEL_MPS = 1.524
# Columns of `SOURCES`.
PRIMARY, _SECONDARY, _MODE_S, _SQUITTER, _MULTILATERATION = range(5)
#: Those of secondary plots.
SECONDARY_SOURCES = [_SECONDARY, _MODE_S]
# Values of the parts of item 200.
_NONE, _RIGHT_OR_UP, _LEFT_OR_DOWN = range(3)
# Kinds of plots in item 340/TYP.
_TYPE_PRIMARY, _TYPE_SECONDARY, _TYPE_COMBINED = 1, 2, 3
_TYPE_ROLL_CALL, _TYPE_PRIMARY_ROLL_CALL = 5, 7
_DETECTION = "detection"
_PRIMARY_DETECTIONS, _MODE_S_DETECTIONS, _SECONDARY_DETECTIONS = (
    [DETECTIONS.index(one) for one in names]
    for names in (
        ("psr", "psr_ssr", "psr_mode_s"), ("mode_s", "psr_mode_s"), ("ssr", "psr_ssr"),
    )
)  # fmt: skip

_MEASURED = row_type(
    MeasurementBatch, ("kind", "range_m", "azimuth_rad", "height_m", "mode_3a", "mode_s_address")
)
#: Retained columns of the last measurement of a track; names as in `MeasurementBatch`.
MEASURED_DTYPE = np.dtype([*_MEASURED.descr, (_DETECTION, np.int8)])


def measured_rows(measured: MeasurementBatch) -> Rows:
    """Return measurements as rows of `MEASURED_DTYPE`."""
    rows = np.zeros(len(measured), MEASURED_DTYPE)
    for name in _MEASURED.names or ():
        rows[name] = getattr(measured, name)
    rows[_DETECTION] = measured.detections()
    return rows


def sources(measured: Rows, self_reported: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which of `SOURCES` each measurement is from, (n, 5); none for bearings.

    Parameters
    ----------
    measured : (n,) rows of `MEASURED_DTYPE`
        The measurements. A plot is of the types that its radar reports. Without a report one with
        an address is Mode S, one with a code or a height secondary, any other primary.
    self_reported : (n,) bool
        Whether the sensor relays reports of aircraft (ADS-B).
    """
    reported = measured["kind"] == KIND_POSITION
    plot = ~reported & (measured["kind"] != KIND_BEARING)
    primary, mode_s, secondary = _types(measured)
    found = np.zeros((len(measured), len(SOURCES)), np.bool_)
    found[:, PRIMARY] = plot & primary
    found[:, _SECONDARY] = plot & secondary
    found[:, _MODE_S] = plot & mode_s
    found[:, _SQUITTER] = reported & self_reported
    found[:, _MULTILATERATION] = reported & ~self_reported
    return found


def plot_types(measured: Rows) -> Integers:
    """Return the plot types of item 340/TYP: combined ones where the radar reports them."""
    primary, mode_s, secondary = _types(measured)
    return np.select(
        [primary & mode_s, primary & secondary, mode_s, secondary],
        [_TYPE_PRIMARY_ROLL_CALL, _TYPE_COMBINED, _TYPE_ROLL_CALL, _TYPE_SECONDARY],
        _TYPE_PRIMARY,
    )


def _types(measured: Rows) -> tuple[Flags, Flags, Flags]:
    """Return whether plots are primary, Mode S, and secondary without Mode S."""
    detection = measured[_DETECTION]
    reported = detection != MISSING
    primary = np.isin(detection, _PRIMARY_DETECTIONS)
    mode_s = np.isin(detection, _MODE_S_DETECTIONS)
    secondary = np.isin(detection, _SECONDARY_DETECTIONS)
    addressed, coded = measured["mode_s_address"] >= 0, _is_secondary(measured)
    return (
        np.where(reported, primary, ~coded),
        np.where(reported, mode_s, addressed),
        np.where(reported, secondary, coded & ~addressed),
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
