"""Mode S registers 4,0, 5,0 and 6,0 (ICAO Doc 9871, second edition, tables A-2-64, 80 and 96).

Bits are numbered from 1 at the most significant of the 56. A field counts if its status bit is 1;
signed fields are two's complement, the sign first.

========  ====================================  ======  =====  ================================
register  field                                 status  bits   LSB
========  ====================================  ======  =====  ================================
4,0       selected altitude (MCP/FCU)           1       2-13   16 ft
4,0       selected altitude (FMS)               14      15-26  16 ft
4,0       reserved, zero                                40-47, 52-53
5,0       roll, right wing down positive        1       2-11   45/256 degree, signed
5,0       true track angle                      12      13-23  90/512 degree, signed
5,0       ground speed                          24      25-34  2 kt
5,0       track angle rate, right positive      35      36-45  8/256 degree/s, signed
5,0       true airspeed                         46      47-56  2 kt
6,0       magnetic heading                      1       2-12   90/512 degree, signed
6,0       indicated airspeed                    13      14-23  1 kt
6,0       Mach number                           24      25-34  2.048/512
6,0       barometric altitude rate              35      36-45  32 ft/min, signed
6,0       inertial vertical velocity            46      47-56  32 ft/min, signed
========  ====================================  ======  =====  ================================
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.plausibility import AIR, ALTITUDE, MOTION, Finding
from multiradar_converters.aircraft_data.quantities import (
    FOOT_PER_MIN_M_S,
    Numbers,
)
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS

Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Octets = NDArray[np.uint8]

#: Numbers of the decoded registers, and columns of `read_registers`.
REGISTERS = (0x40, 0x50, 0x60)
NAMES = ("4,0", "5,0", "6,0")
BDS_4_0, BDS_5_0, BDS_6_0 = range(len(REGISTERS))

#: A record without a register, and one with contradicting copies of it.
ABSENT, CONTRADICTING = -1, -2

BITS = 56
_OCTETS = 8


class Coded(NamedTuple):
    """A field of a register.

    Attributes
    ----------
    status, first, last : int
        Status bit, first and last bit of the value.
    step : float
        Value of the last bit.
    signed : bool
        Two's complement.
    saturates : bool
        Whether the largest codes mean a value beyond the range.
    """

    status: int
    first: int
    last: int
    step: float
    signed: bool = False
    saturates: bool = False


#: Fields by register, in units of `QUANTITIES`; heights in m.
FIELDS: dict[int, dict[str, Coded]] = {
    BDS_4_0: {
        "panel_altitude": Coded(1, 2, 13, 16.0 * FOOT_M),
        "managed_altitude": Coded(14, 15, 26, 16.0 * FOOT_M),
    },
    BDS_5_0: {
        "roll": Coded(1, 2, 11, 45.0 / 256.0, signed=True),
        "track_angle": Coded(12, 13, 23, 90.0 / 512.0, signed=True),
        "ground_speed": Coded(24, 25, 34, 2.0 * KNOT_MPS),
        "track_angle_rate": Coded(35, 36, 45, 8.0 / 256.0, signed=True, saturates=True),
        "true_airspeed": Coded(46, 47, 56, 2.0 * KNOT_MPS),
    },
    BDS_6_0: {
        "magnetic_heading": Coded(1, 2, 12, 90.0 / 512.0, signed=True),
        "indicated_airspeed": Coded(13, 14, 23, KNOT_MPS),
        "mach": Coded(24, 25, 34, 2.048 / 512.0),
        "barometric_rate": Coded(35, 36, 45, 32.0 * FOOT_PER_MIN_M_S, signed=True),
        "inertial_rate": Coded(46, 47, 56, 32.0 * FOOT_PER_MIN_M_S, signed=True),
    },
}
#: Maximum difference of the two vertical rates of register 6,0, m/s; 10 m/s were seen in climbs.
RATES_APART_MAX_M_S = 20.0
#: Bits of register 4,0 that are zero.
RESERVED_4_0 = ((40, 47), (52, 53))


def read_registers(data: Octets, begins: Integers) -> Integers:
    """Read the registers of records, each a count and so many times 56 bits and a number.

    Parameters
    ----------
    data : uint8[b]
        Octets.
    begins : int64[n]
        The count of each record; negative for none.

    Returns
    -------
    int64[n, 3]
        Content of each of `REGISTERS`, `ABSENT` or `CONTRADICTING`.
    """
    found = np.full((len(begins), len(REGISTERS)), ABSENT, np.int64)
    rows = np.flatnonzero(begins >= 0)
    counts = data[begins[rows]]
    for k in range(int(counts.max(initial=0))):
        own = rows[counts > k]
        first = begins[own] + 1 + _OCTETS * k
        octets = data[first[:, None] + np.arange(_OCTETS)]
        words = octets.copy().view(">u8").astype(np.uint64).ravel()
        number, content = (words & np.uint64(0xFF)).astype(np.int64), (words >> np.uint64(8))
        for place, register in enumerate(REGISTERS):
            same = number == register
            column, new = own[same], content[same].astype(np.int64)
            before = found[column, place]
            found[column, place] = np.where(
                (before == ABSENT) | (before == new), new, CONTRADICTING
            )
    return found


def bits_of(content: Integers, first: int, last: int) -> Integers:
    """Return bits of registers as unsigned integers, the first bit being 1."""
    return (content >> (BITS - last)) & ((1 << (last - first + 1)) - 1)


def field_values(content: Integers, field: Coded) -> Numbers:
    """Return a field in its unit; NaN without register or status, or beyond its range."""
    raw = bits_of(content, field.first, field.last)
    width = field.last - field.first + 1
    if field.signed:
        raw = np.where(raw >> (width - 1) == 1, raw - (1 << width), raw)
    given = (content >= 0) & (bits_of(content, field.status, field.status) == 1)
    if field.saturates:
        given &= np.abs(raw) < (1 << (width - field.signed)) - 1
    return np.where(given, raw * field.step, np.nan)


def decoded(content: Integers, register: int) -> dict[str, Numbers]:
    """Return the fields of a register by name, see `FIELDS`."""
    return {name: field_values(content, field) for name, field in FIELDS[register].items()}


def encoded(values: dict[str, Numbers], register: int) -> Integers:
    """Return registers with these fields, the inverse of `decoded`; NaN has the status 0.

    Parameters
    ----------
    values : dict of float64[n]
        Fields by name; values beyond the range of their field are clipped.
    register : int
        Which register, see `FIELDS`.

    Returns
    -------
    int64[n]
        Their content.
    """
    content = np.zeros(len(next(iter(values.values()))), np.int64)
    for name, field in FIELDS[register].items():
        width = field.last - field.first + 1
        least, most = (-(1 << (width - 1)), (1 << (width - 1)) - 1) if field.signed else (
            0, (1 << width) - 1
        )  # fmt: skip
        given = ~np.isnan(values[name])
        raw = np.rint(np.where(given, values[name], 0.0) / field.step)
        bits = np.clip(raw, least, most).astype(np.int64) & ((1 << width) - 1)
        bits = bits << (BITS - field.last) | 1 << (BITS - field.status)
        content |= np.where(given, bits, 0)
    return content


def register_values(found: Integers) -> tuple[Numbers, list[Finding]]:
    """Return the values of registers.

    Parameters
    ----------
    found : int64[n, 3]
        As from `read_registers`.

    Returns
    -------
    values : float64[n, 10]
        Columns of `QUANTITIES`; NaN for absent.
    findings : list of Finding
        Registers that were dropped: contradicting copies, registers 5,0 and 6,0 with the same
        content (one of them is the other), bits without their status, and 6,0 with vertical rates
        that contradict each other. Of 5,0 and 6,0 both are dropped: content that is not that of its
        number leaves the other number of the report in doubt, too.
    """
    usable = found.copy()
    findings = []
    same = (found[:, BDS_5_0] > 0) & (found[:, BDS_5_0] == found[:, BDS_6_0])
    for register in range(len(REGISTERS)):
        group = ALTITUDE if register == BDS_4_0 else MOTION + AIR
        content = found[:, register]
        reasons = {
            "copies": content == CONTRADICTING,
            "equal_registers": same & (register != BDS_4_0),
            "unannounced_bits": has_unannounced_bits(content, register),
        }
        for reason, where in reasons.items():
            findings.append(Finding(reason, group, where))
            for one in (register,) if register == BDS_4_0 else (BDS_5_0, BDS_6_0):
                usable[where, one] = ABSENT
    altitudes = decoded(usable[:, BDS_4_0], BDS_4_0)
    motion = decoded(usable[:, BDS_5_0], BDS_5_0)
    air = decoded(usable[:, BDS_6_0], BDS_6_0)
    barometric, inertial = air["barometric_rate"], air["inertial_rate"]
    apart = np.abs(barometric - inertial) > RATES_APART_MAX_M_S
    findings.append(Finding("vertical_rates", MOTION + AIR, apart))
    values = q.absent(len(found))
    for quantity, column in (
        (q.MAGNETIC_HEADING, air["magnetic_heading"] % q.REVOLUTION_DEG),
        (q.ROLL, motion["roll"]),
        (q.TRACK_ANGLE, motion["track_angle"] % q.REVOLUTION_DEG),
        (q.TRACK_ANGLE_RATE, motion["track_angle_rate"]),
        (q.GROUND_SPEED, motion["ground_speed"]),
        (q.TRUE_AIRSPEED, motion["true_airspeed"]),
        (q.INDICATED_AIRSPEED, air["indicated_airspeed"]),
        (q.MACH, air["mach"]),
        (q.VERTICAL_RATE, q.first_of(inertial, barometric)),
        (
            q.SELECTED_ALTITUDE,
            q.first_of(altitudes["panel_altitude"], altitudes["managed_altitude"]),
        ),
    ):
        values[:, quantity] = column
    q.blank(values, apart, MOTION + AIR)
    return values, [one for one in findings if one.where.any()]


def has_unannounced_bits(content: Integers, register: int) -> Flags:
    """Return where a field has bits although its status is 0, or reserved bits are set."""
    found = np.zeros(len(content), dtype=np.bool_)
    for field in FIELDS[register].values():
        silent = bits_of(content, field.status, field.status) == 0
        found |= silent & (bits_of(content, field.first, field.last) != 0)
    if register == BDS_4_0:
        for first, last in RESERVED_4_0:
            found |= bits_of(content, first, last) != 0
    return found & (content > 0)
