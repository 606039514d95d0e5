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

An item precedes the register. Of two items, the first one counts that is neither too old by its own
age nor beyond its range. Editions before 1.0 of category 021 have no bit for exceeded ranges;
their rate of turn, and that of 062/380, has a direction (TI), which must not contradict its sign.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

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

# Values of an item, NaN for absent, and the name of its age in item 295.
_Item = tuple[Numbers, str]
# Items of each quantity, the preferred one first.
_Items = Mapping[int, Sequence[_Item]]


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
    accepted = _Acceptance(columns, TRACK_AGE_MAX_S, columns.numbers("295/MB"))
    items = {
        q.MAGNETIC_HEADING: [(columns.numbers("380/MHG"), "MHG")],
        q.ROLL: [(columns.numbers("380/RAN"), "RAN")],
        q.TRACK_ANGLE: [(columns.numbers("380/TAN"), "TAN")],
        q.TRACK_ANGLE_RATE: [(_turn(columns, "380/TAR", "380/TAR"), "TAR")],
        q.GROUND_SPEED: [(columns.numbers("380/GS") * _MILES, "GSP")],
        q.TRUE_AIRSPEED: [(columns.numbers("380/TAS") * KNOT_MPS, "TAS")],
        q.INDICATED_AIRSPEED: [
            (columns.numbers("380/IAR") * KNOT_MPS, "IAR"),
            (np.where(mach, np.nan, airspeed * _AIRSPEED_STEP_M_S), "IAS"),
        ],
        q.MACH: [
            (columns.numbers("380/MAC"), "MAC"),
            (np.where(mach, airspeed * _MACH_STEP, np.nan), "IAS"),
        ],
        q.VERTICAL_RATE: [
            (columns.numbers("380/GVR") * q.FOOT_PER_MIN_M_S, "GVR"),
            (columns.numbers("380/BVR") * q.FOOT_PER_MIN_M_S, "BVR"),
        ],
        q.SELECTED_ALTITUDE: [
            (columns.numbers("380/SAL", "ALT") * FOOT_M, "SAL"),
            (columns.numbers("380/FSS", "ALT") * FOOT_M, "FSS"),
        ],
    }
    return _checked(values, height_m, findings + accepted.put(values, items))


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
    items = {
        q.MAGNETIC_HEADING: [(columns.numbers("152"), "MH")],
        q.ROLL: [(columns.numbers("230"), "ROA")],
        q.TRACK_ANGLE: [(track, "GV")],
        q.TRACK_ANGLE_RATE: [
            (_turn(columns, "165", "165+1", "ROT") if old else columns.numbers("165", "TAR"), "TAR")
        ],
        q.GROUND_SPEED: [(speed * _MILES, "GV")],
        q.TRUE_AIRSPEED: [(columns.numbers("151", "VALUE" if old else "TAS") * KNOT_MPS, "TAS")],
        q.INDICATED_AIRSPEED: [(np.where(mach, np.nan, airspeed * _AIRSPEED_STEP_M_S), "AS")],
        q.MACH: [(np.where(mach, airspeed * _MACH_STEP, np.nan), "AS")],
        q.VERTICAL_RATE: [
            (columns.numbers("157", "VALUE" if old else "GVR") * q.FOOT_PER_MIN_M_S, "GVR"),
            (columns.numbers("155", "VALUE" if old else "BVR") * q.FOOT_PER_MIN_M_S, "BVR"),
        ],
        q.SELECTED_ALTITUDE: [
            (columns.numbers("146", "ALT") * FOOT_M, "SAL"),
            (columns.numbers("148", "ALT") * FOOT_M, "FSA"),
        ],
    }
    exceeded = {
        name: columns.flags(node, "RE")
        for name, node in (("TAS", "151"), ("BVR", "155"), ("GVR", "157"), ("GV", "160"))
    }
    accepted = _Acceptance(columns, AGE_MAX_S, np.full(len(columns), np.nan), exceeded)
    findings += accepted.put(values, items)
    position = q.first_of(columns.numbers("073"), columns.numbers("071"))
    velocity = q.first_of(columns.numbers("075"), columns.numbers("072"))
    late = np.abs((velocity - position + _DAY_S / 2.0) % _DAY_S - _DAY_S / 2.0) > AGE_MAX_S
    late &= np.isfinite(values[:, MOTION]).any(axis=1)
    return values, [*findings, Finding("age", MOTION, late)] if late.any() else findings


class _Acceptance(NamedTuple):
    """Which items are accepted: by their own ages and ranges.

    Attributes
    ----------
    columns : Columns
        The records.
    age_max_s : float
        Maximum age, s, other than of a selected altitude.
    register_age_s : float64[n]
        Age of the registers, s; NaN for that of the items they are read in place of.
    exceeded : mapping of bool[n]
        Where the range of an item is exceeded, by the name of its age.
    """

    columns: Columns
    age_max_s: float
    register_age_s: Numbers
    exceeded: Mapping[str, Flags] = MappingProxyType({})

    def put(self, values: Numbers, items: _Items) -> list[Finding]:
        """Put the first accepted item of each quantity before its register, in place."""
        return [one for quantity, own in items.items() for one in self._put(values, quantity, own)]

    def _put(self, values: Numbers, quantity: int, items: Sequence[_Item]) -> list[Finding]:
        limit_s = SELECTED_AGE_MAX_S if quantity == q.SELECTED_ALTITUDE else self.age_max_s
        ages_s = [self.columns.numbers(f"295/{name}") for _, name in items]
        within = [
            np.where(self.exceeded[name], np.nan, item) if name in self.exceeded else item
            for item, name in items
        ]
        fresh = q.first_of(
            *(
                np.where(age_s > limit_s, np.nan, item)
                for item, age_s in zip(within, ages_s, strict=True)
            )
        )
        known = ~np.isnan(q.first_of(*(item for item, _ in items)))
        in_range = ~np.isnan(q.first_of(*within))
        register_age_s = q.first_of(self.register_age_s, np.fmax.reduce(ages_s))
        register = values[:, quantity]
        stale = ~np.isnan(register) & (register_age_s > limit_s)
        # An item that is not accepted is not replaced by a register of unknown age.
        old = np.where(known, in_range & np.isnan(fresh), stale)
        values[:, quantity] = np.where(known, fresh, register)
        found = (("age", old), ("range_exceeded", known & ~in_range))
        return [Finding(reason, (quantity,), where) for reason, where in found if where.any()]


def _turn(columns: Columns, direction: str, node: str, field: str = "ROT") -> Numbers:
    """Return a rate of turn whose direction (TI) does not contradict its sign, degree/s."""
    rate, turn = columns.numbers(node, field), columns.integers(direction, "TI")
    contradicts = ((turn == _LEFT) & (rate > 0.0)) | ((turn == _RIGHT) & (rate < 0.0))
    return np.where(contradicts, np.nan, rate)
