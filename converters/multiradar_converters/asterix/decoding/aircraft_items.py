"""Aircraft-derived data in items of target reports and system tracks.

==================  ==============  ============================  ==========================
quantity            010, 020, 048   021                           062/380
==================  ==============  ============================  ==========================
registers           250             250                           BDSDATA
magnetic heading    6,0             152                           MHG
roll                5,0             230                           RAN
track angle         5,0             160                           TAN
track angle rate    5,0             165                           TAR
ground speed        5,0             160                           GS
true airspeed       5,0             151                           TAS
indicated airspeed  6,0             150 (IM 0)                    IAR, IAS (IM 0)
Mach number         6,0             150 (IM 1)                    MAC, IAS (IM 1)
vertical rate       6,0             157, 155                      GVR, BVR
selected altitude   4,0             146, 148                      SAL, FSS
age                                 295; 072, 075 beside the      295
                                    time of the position
==================  ==============  ============================  ==========================

An item precedes the register. Editions before 1.0 of category 021 have no bit for exceeded ranges;
their rate of turn, and that of 062/380, has a direction (TI), which must not contradict its sign.
"""

import numpy as np

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.checking import checked
from multiradar_converters.aircraft_data.plausibility import MOTION, Finding
from multiradar_converters.aircraft_data.quantities import Numbers
from multiradar_converters.aircraft_data.registers import read_registers, register_values
from multiradar_converters.asterix.layout.columns import Columns, Flags, Integers
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS, NAUTICAL_MILE_M

#: Maximum age of a value in a target report, s, and of a selected altitude.
AGE_MAX_S = 3.0
SELECTED_AGE_MAX_S = 30.0
#: The same for system tracks: a scan of a radar for the area control.
TRACK_AGE_MAX_S = 12.0

_MACH_STEP = 0.001
_AIRSPEED_STEP_M_S = NAUTICAL_MILE_M / 16384.0
_MILES = NAUTICAL_MILE_M
_LEFT, _RIGHT = 1, 2
_DAY_S = 86_400.0


def aircraft_data(category: int, columns: Columns, height_m: Numbers) -> tuple[Numbers, Integers]:
    """Read the aircraft-derived data of target reports.

    Parameters
    ----------
    category : int
        Their category.
    columns : Columns
        The records.
    height_m : float64[n]
        Their heights, m; NaN for none.

    Returns
    -------
    values : float64[n, 10] or float64[n, 0]
        Plausible values; without columns if no record has any, or none are wanted.
    bits : int64[n]
        Reasons for which values were dropped, see `REASONS`.
    """
    if not columns.with_aircraft_data:
        return q.without(len(columns)), np.zeros(len(columns), np.int64)
    if category == _ADSB:
        values, findings = _of_adsb(columns)
    else:
        values, findings = _of_registers(columns, "250")
    return _checked(values, height_m, findings)


def track_data(columns: Columns, height_m: Numbers) -> tuple[Numbers, Integers]:
    """Read the aircraft-derived data of system tracks (item 062/380); as `aircraft_data`."""
    values, findings = _of_registers(columns, "380/BDSDATA")
    values = values if values.shape[1] else q.absent(len(columns))
    mach = columns.integers("380/IAS", "IM") == 1
    airspeed = columns.numbers("380/IAS", "IAS")
    given = {
        q.MAGNETIC_HEADING: columns.numbers("380/MHG"),
        q.ROLL: columns.numbers("380/RAN"),
        q.TRACK_ANGLE: columns.numbers("380/TAN"),
        q.TRACK_ANGLE_RATE: _turn(columns, "380/TAR", "380/TAR"),
        q.GROUND_SPEED: columns.numbers("380/GS") * _MILES,
        q.TRUE_AIRSPEED: columns.numbers("380/TAS") * KNOT_MPS,
        q.INDICATED_AIRSPEED: q.first_of(
            columns.numbers("380/IAR") * KNOT_MPS,
            np.where(mach, np.nan, airspeed * _AIRSPEED_STEP_M_S),
        ),
        q.MACH: q.first_of(
            columns.numbers("380/MAC"), np.where(mach, airspeed * _MACH_STEP, np.nan)
        ),
        q.VERTICAL_RATE: q.FOOT_PER_MIN_M_S
        * q.first_of(columns.numbers("380/GVR"), columns.numbers("380/BVR")),
        q.SELECTED_ALTITUDE: FOOT_M
        * q.first_of(columns.numbers("380/SAL", "ALT"), columns.numbers("380/FSS", "ALT")),
    }
    _put(values, given)
    ages = {
        q.MAGNETIC_HEADING: "MHG",
        q.ROLL: "RAN",
        q.TRACK_ANGLE: "TAN",
        q.TRACK_ANGLE_RATE: "TAR",
        q.GROUND_SPEED: "GSP",
        q.TRUE_AIRSPEED: "TAS",
        q.INDICATED_AIRSPEED: "IAR",
        q.MACH: "MAC",
        q.VERTICAL_RATE: "BVR",
        q.SELECTED_ALTITUDE: "SAL",
    }
    for quantity, name in ages.items():
        limit = SELECTED_AGE_MAX_S if quantity == q.SELECTED_ALTITUDE else TRACK_AGE_MAX_S
        findings += _too_old(values, quantity, columns.numbers(f"295/{name}"), limit)
    return _checked(values, height_m, findings)


_ADSB = 21


def _checked(
    values: Numbers, height_m: Numbers, findings: list[Finding]
) -> tuple[Numbers, Integers]:
    if not values.shape[1] or not (findings or np.isfinite(values).any()):
        return q.without(len(height_m)), np.zeros(len(height_m), np.int64)
    for one in findings:
        q.blank(values, one.where, one.quantities)
    return checked(values, height_m, findings)


def _of_registers(columns: Columns, node: str) -> tuple[Numbers, list[Finding]]:
    if not columns.present(node).any():
        return q.without(len(columns)), []
    begins = columns.walked.starts[:, columns.walked.program.places[node]].astype(np.int64)
    return register_values(read_registers(columns.data, begins))


def _of_adsb(columns: Columns) -> tuple[Numbers, list[Finding]]:
    values, findings = _of_registers(columns, "250")
    values = values if values.shape[1] else q.absent(len(columns))
    old = columns.has("030")
    raw = columns.integers("150", "AS")
    airspeed = np.where(raw < 0, np.nan, raw.astype(np.float64))
    mach = columns.integers("150", "IM") == 1
    speed, track = columns.numbers("160", "GS"), columns.numbers("160", "TA")
    given = {
        q.MAGNETIC_HEADING: columns.numbers("152"),
        q.ROLL: columns.numbers("230"),
        q.TRACK_ANGLE: track,
        q.TRACK_ANGLE_RATE: (
            _turn(columns, "165", "165+1", "ROT") if old else columns.numbers("165", "TAR")
        ),
        q.GROUND_SPEED: speed * _MILES,
        q.TRUE_AIRSPEED: columns.numbers("151", "VALUE" if old else "TAS") * KNOT_MPS,
        q.INDICATED_AIRSPEED: np.where(mach, np.nan, airspeed * _AIRSPEED_STEP_M_S),
        q.MACH: np.where(mach, airspeed * _MACH_STEP, np.nan),
        q.VERTICAL_RATE: q.FOOT_PER_MIN_M_S
        * q.first_of(
            columns.numbers("157", "VALUE" if old else "GVR"),
            columns.numbers("155", "VALUE" if old else "BVR"),
        ),
        q.SELECTED_ALTITUDE: FOOT_M
        * q.first_of(columns.numbers("146", "ALT"), columns.numbers("148", "ALT")),
    }
    _put(values, given)
    for node, quantities in (
        ("151", (q.TRUE_AIRSPEED,)),
        ("155", (q.VERTICAL_RATE,)),
        ("157", (q.VERTICAL_RATE,)),
        ("160", (q.GROUND_SPEED, q.TRACK_ANGLE)),
    ):
        exceeded = columns.flags(node, "RE")
        if exceeded.any():
            findings.append(Finding("range_exceeded", quantities, exceeded))
    return values, findings + _old_adsb(columns, values)


def _old_adsb(columns: Columns, values: Numbers) -> list[Finding]:
    """Return the values that are older than the position."""
    ages = {
        q.MAGNETIC_HEADING: "MH",
        q.ROLL: "ROA",
        q.TRACK_ANGLE: "GV",
        q.TRACK_ANGLE_RATE: "TAR",
        q.GROUND_SPEED: "GV",
        q.TRUE_AIRSPEED: "TAS",
        q.INDICATED_AIRSPEED: "AS",
        q.MACH: "AS",
        q.VERTICAL_RATE: "BVR",
        q.SELECTED_ALTITUDE: "SAL",
    }
    found = []
    for quantity, name in ages.items():
        limit = SELECTED_AGE_MAX_S if quantity == q.SELECTED_ALTITUDE else AGE_MAX_S
        found += _too_old(values, quantity, columns.numbers(f"295/{name}"), limit)
    position = q.first_of(columns.numbers("073"), columns.numbers("071"))
    velocity = q.first_of(columns.numbers("075"), columns.numbers("072"))
    late = np.abs((velocity - position + _DAY_S / 2.0) % _DAY_S - _DAY_S / 2.0) > AGE_MAX_S
    late &= np.isfinite(values[:, MOTION]).any(axis=1)
    return [*found, Finding("age", MOTION, late)] if late.any() else found


def _too_old(values: Numbers, quantity: int, age_s: Numbers, limit_s: float) -> list[Finding]:
    old: Flags = (age_s > limit_s) & ~np.isnan(values[:, quantity])
    return [Finding("age", (quantity,), old)] if old.any() else []


def _put(values: Numbers, given: dict[int, Numbers]) -> None:
    for quantity, column in given.items():
        values[:, quantity] = q.first_of(column, values[:, quantity])


def _turn(columns: Columns, direction: str, node: str, field: str = "ROT") -> Numbers:
    """Return a rate of turn whose direction (TI) does not contradict its sign, degree/s."""
    rate, turn = columns.numbers(node, field), columns.integers(direction, "TI")
    contradicts = ((turn == _LEFT) & (rate > 0.0)) | ((turn == _RIGHT) & (rate < 0.0))
    return np.where(contradicts, np.nan, rate)
