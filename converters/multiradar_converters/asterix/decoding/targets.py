"""Target reports: items of categories 001, 048, 020 and 021.

===========================  =====================  ================  ===========================
                             001, 048               020               021
===========================  =====================  ================  ===========================
position                     040                    041               131, 130
time of day                  141 (001), 140 (048)   140               073 with 074, 071, 030
Mode 3/A code                070                    070               070
height                       090 (Mode C)           090, 105, 110     145, 140
Mode S address               220                    220               080
callsign                     240                    245               170
ground status                230 (048)              230, 020          040
test, simulated, fixed, SPI  020                    020               040 (SPI: 0.26 only)
aircraft-derived data        250 (048)              250               see `aircraft_items`
===========================  =====================  ================  ===========================

A garbled or not validated code or flight level is omitted and flagged.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from multiradar_converters.asterix.decoding.aircraft_items import aircraft_data
from multiradar_converters.asterix.decoding.bounds import LATITUDE_MAX_DEG
from multiradar_converters.asterix.layout.columns import Columns, Flags, Integers, Numbers

METRES_OF_MILE = 1852.0
METRES_OF_FOOT = 0.3048
_METRES_OF_LEVEL = 100.0 * METRES_OF_FOOT

#: Names of the flags, by bit.
FLAGS = (
    "test",
    "simulated",
    "fixed_transponder",
    "spi",
    "code_garbled",
    "code_not_validated",
    "height_garbled",
    "height_not_validated",
    "height_geometric",
    "on_ground",
    "no_detection",
)
_BIT = {name: 1 << bit for bit, name in enumerate(FLAGS)}
#: Flags of reports that are not aircraft, or not detected in this scan.
NOT_AIRCRAFT = ("test", "simulated", "fixed_transponder", "no_detection")


@dataclass(frozen=True)
class Targets:
    """Target reports, a row per report.

    Attributes
    ----------
    kind : str
        radar, mlat or adsb.
    time_s : float64[n]
        Time of day, s; NaN if absent.
    truncated_s : float64[n]
        Time of day modulo 512 s; NaN if absent.
    range_m, azimuth_deg, latitude_deg, longitude_deg, height_m : float64[n]
        NaN if absent.
    code, address, callsign : int64[n]
        Mode 3/A code, Mode S address, callsign of six-bit characters; -1 if absent.
    on_ground : int64[n]
        1 on the ground, 0 airborne, -1 if absent or either.
    flags : int64[n]
        Bits, see `FLAGS`.
    aircraft_data : float64[n, 10] or float64[n, 0]
        Aircraft-derived data, see `quantities`; without columns if the reports have none.
    dropped : int64[n]
        Reasons for which some of them were dropped, bits, see `checking.REASONS`.
    """

    kind: str
    time_s: Numbers
    truncated_s: Numbers
    range_m: Numbers
    azimuth_deg: Numbers
    latitude_deg: Numbers
    longitude_deg: Numbers
    height_m: Numbers
    code: Integers
    address: Integers
    callsign: Integers
    on_ground: Integers
    flags: Integers
    aircraft_data: Numbers
    dropped: Integers


def flag_bits(*names: str) -> int:
    """Return the bits of flags."""
    return sum(_BIT[name] for name in names)


def flag_text(bits: int) -> str | None:
    """Return the names of flags, separated by commas; None for none."""
    return ",".join(name for name in FLAGS if bits & _BIT[name]) or None


def read_targets(category: int, columns: Columns) -> Targets | None:
    """Read target reports.

    Parameters
    ----------
    category : int
        Their category.
    columns : Columns
        The records.

    Returns
    -------
    Targets or None
        None if the category has no target reports that are measurements.
    """
    reader = _READERS.get(category)
    return None if reader is None else reader(columns)


def _nothing(columns: Columns) -> Numbers:
    return np.full(len(columns), np.nan)


def _marked(*parts: tuple[str, Flags]) -> Integers:
    bits = np.zeros(len(parts[0][1]), dtype=np.int64)
    for name, flags in parts:
        bits |= np.where(flags, _BIT[name], 0)
    return bits


def _code(columns: Columns, node: str) -> tuple[Integers, Integers]:
    """Return valid codes, and flags."""
    garbled, unsure = columns.flags(node, "G"), columns.flags(node, "V")
    code = columns.integers(node, "MODE3A")
    flags = _marked(("code_garbled", garbled), ("code_not_validated", unsure))
    return np.where(garbled | unsure, -1, code), flags


def _level(columns: Columns, node: str, field: str) -> tuple[Numbers, Integers]:
    """Return heights from valid flight levels, and flags."""
    garbled, unsure = columns.flags(node, "G"), columns.flags(node, "V")
    height = columns.numbers(node, field) * _METRES_OF_LEVEL
    flags = _marked(("height_garbled", garbled), ("height_not_validated", unsure))
    return np.where(garbled | unsure, np.nan, height), flags


def _or_geometric(height: Numbers, feet: Numbers) -> tuple[Numbers, Integers]:
    """Fill in geometric heights where no other is available."""
    missing = np.isnan(height) & ~np.isnan(feet)
    return np.where(missing, feet * METRES_OF_FOOT, height), _marked(("height_geometric", missing))


def _ground_bit(columns: Columns, node: str, address_node: str) -> Integers:
    """Return the ground status by the ground bit of a transponder.

    Zero is also sent where there is no such transponder: it counts beside an address only.
    """
    bit, address = columns.integers(node, "GBS"), columns.integers(address_node)
    return np.where((bit == 0) & (address < 0), -1, bit)


def _flight_status(columns: Columns) -> Integers:
    """Return the ground status by the flight status of Mode S.

    0, 2: airborne; 1, 3: on the ground; 4, 5: either, under alert or SPI; 6, 7: not assigned,
    unknown (ICAO Annex 10, volume IV, 3.1.2.6.5.1).
    """
    return np.array([0, 1, 0, 1, -1, -1, -1, -1, -1])[columns.integers("230", "STAT")]


def _radar(
    columns: Columns, *, detection: str, level: str, time: Numbers, on_ground: Integers
) -> Targets:
    code, code_flags = _code(columns, "070")
    height, height_flags = _level(columns, "090", level)
    flags = _marked(
        ("test", columns.flags("020+1", "TST")),
        ("simulated", columns.flags("020", "SIM")),
        ("fixed_transponder", columns.flags("020", "RAB")),
        ("spi", columns.flags("020", "SPI")),
        ("no_detection", columns.integers("020", detection) == 0),
    )
    data, dropped = aircraft_data(48, columns, height)
    return Targets(
        kind="radar",
        time_s=time,
        truncated_s=columns.numbers("141"),
        range_m=columns.numbers("040", "RHO") * METRES_OF_MILE,
        azimuth_deg=columns.numbers("040", "THETA"),
        latitude_deg=_nothing(columns),
        longitude_deg=_nothing(columns),
        height_m=height,
        code=code,
        address=columns.integers("220"),
        callsign=columns.integers("240"),
        on_ground=on_ground,
        flags=flags | code_flags | height_flags | _marked(("on_ground", on_ground == 1)),
        aircraft_data=data,
        dropped=dropped,
    )


def _category_001(columns: Columns) -> Targets:
    unknown = np.full(len(columns), -1, np.int64)
    return _radar(
        columns, detection="SSRPSR", level="HGT", time=_nothing(columns), on_ground=unknown
    )


def _category_048(columns: Columns) -> Targets:
    time, on_ground = columns.numbers("140"), _flight_status(columns)
    return _radar(columns, detection="TYP", level="FL", time=time, on_ground=on_ground)


def _category_020(columns: Columns) -> Targets:
    code, code_flags = _code(columns, "070")
    level, level_flags = _level(columns, "090", "FL")
    feet = columns.numbers("105")
    height, height_flags = _or_geometric(
        level, np.where(np.isnan(feet), columns.numbers("110"), feet)
    )
    status, bit = _flight_status(columns), _ground_bit(columns, "020+1", "220")
    on_ground = np.where(status < 0, bit, status)
    flags = _marked(
        ("test", columns.flags("020+1", "TST")),
        ("simulated", columns.flags("020+1", "SIM")),
        ("fixed_transponder", columns.flags("020+1", "RAB")),
        ("spi", columns.flags("020+1", "SPI")),
        ("on_ground", on_ground == 1),
    )
    data, dropped = aircraft_data(20, columns, height)
    return Targets(
        kind="mlat",
        time_s=columns.numbers("140"),
        truncated_s=_nothing(columns),
        range_m=_nothing(columns),
        azimuth_deg=_nothing(columns),
        latitude_deg=columns.numbers("041", "LAT"),
        longitude_deg=columns.numbers("041", "LON"),
        height_m=height,
        code=code,
        address=columns.integers("220"),
        callsign=columns.integers("245", "CHR"),
        on_ground=on_ground,
        flags=flags | code_flags | level_flags | height_flags,
        aircraft_data=data,
        dropped=dropped,
    )


def _category_021(columns: Columns) -> Targets:
    old = columns.has("030")
    place, time = ("130", columns.numbers("030")) if old else ("131", _reception_021(columns))
    code, code_flags = _code(columns, "070")
    height, height_flags = _or_geometric(
        columns.numbers("145") * _METRES_OF_LEVEL, columns.numbers("140")
    )
    kinds = "040" if old else "040+1"
    on_ground = _ground_bit(columns, kinds, "080")
    flags = _marked(
        ("test", columns.flags(kinds, "TST")),
        ("simulated", columns.flags(kinds, "SIM")),
        ("fixed_transponder", columns.flags("040", "RAB")),
        ("spi", columns.flags("040", "SPI") | (columns.integers("200", "SS") == 3)),
        ("on_ground", on_ground == 1),
    )
    # An impossible high-resolution position has another scale; the coarse one is correct.
    fine = columns.present(place) & (np.abs(columns.numbers(place, "LAT")) <= LATITUDE_MAX_DEG)
    data, dropped = aircraft_data(21, columns, height)
    return Targets(
        kind="adsb",
        time_s=time,
        truncated_s=_nothing(columns),
        range_m=_nothing(columns),
        azimuth_deg=_nothing(columns),
        latitude_deg=np.where(fine, columns.numbers(place, "LAT"), columns.numbers("130", "LAT")),
        longitude_deg=np.where(fine, columns.numbers(place, "LON"), columns.numbers("130", "LON")),
        height_m=height,
        code=code,
        address=columns.integers("080"),
        callsign=columns.integers("170"),
        on_ground=on_ground,
        flags=flags | code_flags | height_flags,
        aircraft_data=data,
        dropped=dropped,
    )


def _reception_021(columns: Columns) -> Numbers:
    """Return the time of the position: fine reception time, reception, applicability, sending."""
    coarse = columns.numbers("073")
    step = np.array([0.0, 1.0, -1.0, 0.0])[np.maximum(columns.integers("074", "FSI"), 0)]
    fine = np.floor(coarse) + step + columns.numbers("074", "TOMRP")
    time = np.where(np.isnan(fine), coarse, fine)
    for other in ("071", "077"):
        time = np.where(np.isnan(time), columns.numbers(other), time)
    return time


_READERS: dict[int, Callable[[Columns], Targets]] = {
    1: _category_001,
    20: _category_020,
    21: _category_021,
    48: _category_048,
}
