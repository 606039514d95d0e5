"""Target reports: items of categories 001, 010, 020, 021 and 048.

====================  ====================  =============  =============  ======================
                      001, 048              010            020            021
====================  ====================  =============  =============  ======================
position              040                   040, 041, 042  041, 042       131, 130
accuracy of it                              500            500            090 with 210
time of day           141 (001), 140 (048)  140            140            073 with 074, 071, 030
Mode 3/A code         070                   060            070            070
height                090 (Mode C)          090, 091       090, 105, 110  145, 140
Mode S address        220                   220            220            080
callsign              240                   245            245            170
ground status         230 (048)             020            230, 020       040
detection             020                   020
extrapolated                                170            170
test, simulated, ...  020                   020            020            040 (SPI: 0.26 only)
aircraft-derived      250 (048)                            250            see `aircraft_items`
====================  ====================  =============  =============  ======================

A garbled or not validated code or flight level is omitted and flagged. Local coordinates (042)
become positions in `local_plane`.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from multiradar_converters.asterix.decoding.aircraft_items import aircraft_data
from multiradar_converters.asterix.decoding.bounds import DAY_S, LATITUDE_MAX_DEG
from multiradar_converters.asterix.decoding.position_quality import (
    sigma_of_adsb,
    sigma_of_deviations,
)
from multiradar_converters.asterix.layout.columns import Columns, Flags, Integers, Numbers
from multiradar_schemas.measurements.measurement import DETECTIONS
from multiradar_schemas.measurements.units import FOOT_M, NAUTICAL_MILE_M

_METRES_OF_LEVEL = 100.0 * FOOT_M

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
    "other_technology",
)
_BIT = {name: 1 << bit for bit, name in enumerate(FLAGS)}
#: Flags of reports that are not aircraft, or not detected in this scan.
NOT_AIRCRAFT = ("test", "simulated", "fixed_transponder", "no_detection", "other_technology")

_PSR, _SSR, _PSR_SSR, _MODE_S, _PSR_MODE_S = range(len(DETECTIONS))
# Types of detection: 001/020/SSRPSR; 048/020/TYP (all-call and roll-call are Mode S).
_DETECTIONS_001 = np.array([-1, _PSR, _SSR, _PSR_SSR])
_DETECTIONS_048 = np.array([-1, _PSR, _SSR, _PSR_SSR, _MODE_S, _MODE_S, _PSR_MODE_S, _PSR_MODE_S])

#: Category of surface movement data.
SURFACE = 10
# Its messages that are target reports, and what measured them (020/TYP). Magnetic loops and types
# that are not defined remain.
_TARGET_REPORT = 1
_MULTILATERATION_010, _ADSB_010, _PRIMARY_010 = (0, 1, 5), 2, 3
_FARTHEST_010_M = 32_767.0
_KNOWN_010 = (*_MULTILATERATION_010, _ADSB_010, _PRIMARY_010)


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
    x_m, y_m : float64[n]
        Local coordinates, east and north of the reference point of the source; NaN if absent.
    position_sigma_m : float64[n]
        Accuracy of the position, 1 sigma on each axis; NaN if unknown.
    category : int64[n]
        Category of the record.
    code, address, callsign : int64[n]
        Mode 3/A code, Mode S address, callsign of six-bit characters; -1 if absent.
    on_ground : int64[n]
        1 on the ground, 0 airborne, -1 if absent or either.
    detection : int64[n]
        How a radar detected it, an index in `DETECTIONS`; -1 if unknown.
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
    x_m: Numbers
    y_m: Numbers
    position_sigma_m: Numbers
    category: Integers
    code: Integers
    address: Integers
    callsign: Integers
    on_ground: Integers
    detection: Integers
    flags: Integers
    aircraft_data: Numbers
    dropped: Integers


def flag_bits(*names: str) -> int:
    """Return the bits of flags."""
    return sum(_BIT[name] for name in names)


def flag_text(bits: int) -> str | None:
    """Return the names of flags, separated by commas; None for none."""
    return ",".join(name for name in FLAGS if bits & _BIT[name]) or None


def read_targets(category: int, columns: Columns) -> list[tuple[Flags, Targets]]:
    """Read target reports.

    Parameters
    ----------
    category : int
        Their category.
    columns : Columns
        The records.

    Returns
    -------
    list of (bool[n], Targets)
        By kind: which records are such reports, and their content. Empty if the category has no
        target reports.
    """
    if category == SURFACE:
        return _category_010(columns)
    reader = _READERS.get(category)
    return [] if reader is None else [(np.ones(len(columns), dtype=np.bool_), reader(columns))]


def select_targets(targets: Targets, own: Flags) -> Targets:
    """Return some of the reports."""
    names = [one.name for one in fields(Targets) if one.name != "kind"]
    return replace(targets, **{name: getattr(targets, name)[own] for name in names})


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
    return np.where(missing, feet * FOOT_M, height), _marked(("height_geometric", missing))


def _ground_bit(columns: Columns, node: str, address_node: str) -> Integers:
    """Return the ground status by the ground bit of a transponder.

    Zero is also sent where there is no such transponder: it counts beside an address only.
    """
    bit, address = columns.integers(node, "GBS"), columns.integers(address_node)
    return np.where((bit == 0) & (address < 0), -1, bit)


def flight_status(columns: Columns, node: str) -> Integers:
    """Return the ground status by the flight status of Mode S.

    0, 2: airborne; 1, 3: on the ground; 4, 5: either, under alert or SPI; 6, 7: not assigned,
    unknown (ICAO Annex 10, volume IV, 3.1.2.6.5.1).
    """
    return np.array([0, 1, 0, 1, -1, -1, -1, -1, -1])[columns.integers(node, "STAT")]


def _radar(
    columns: Columns, *, detection: Integers, level: str, time: Numbers, on_ground: Integers
) -> Targets:
    code, code_flags = _code(columns, "070")
    height, height_flags = _level(columns, "090", level)
    flags = _marked(
        ("test", columns.flags("020+1", "TST")),
        ("simulated", columns.flags("020", "SIM")),
        ("fixed_transponder", columns.flags("020", "RAB")),
        ("spi", columns.flags("020", "SPI")),
        ("no_detection", columns.present("020") & (detection < 0)),
    )
    data, dropped = aircraft_data(48, columns, height)
    return Targets(
        kind="radar",
        time_s=time,
        truncated_s=columns.numbers("141"),
        range_m=columns.numbers("040", "RHO") * NAUTICAL_MILE_M,
        azimuth_deg=columns.numbers("040", "THETA"),
        latitude_deg=_nothing(columns),
        longitude_deg=_nothing(columns),
        height_m=height,
        x_m=_nothing(columns),
        y_m=_nothing(columns),
        position_sigma_m=_nothing(columns),
        category=_category(columns),
        code=code,
        address=columns.integers("220"),
        callsign=columns.integers("240"),
        on_ground=on_ground,
        detection=detection,
        flags=flags | code_flags | height_flags | _marked(("on_ground", on_ground == 1)),
        aircraft_data=data,
        dropped=dropped,
    )


def _category(columns: Columns) -> Integers:
    return np.full(len(columns), columns.walked.program.layout.category)


def _unknown(columns: Columns) -> Integers:
    return np.full(len(columns), -1, np.int64)


def _category_001(columns: Columns) -> Targets:
    return _radar(
        columns,
        detection=_DETECTIONS_001[columns.integers("020", "SSRPSR", 0)],
        level="HGT",
        time=_nothing(columns),
        on_ground=_unknown(columns),
    )


def _category_048(columns: Columns) -> Targets:
    return _radar(
        columns,
        detection=_DETECTIONS_048[columns.integers("020", "TYP", 0)],
        level="FL",
        time=columns.numbers("140"),
        on_ground=flight_status(columns, "230"),
    )


def _category_010(columns: Columns) -> list[tuple[Flags, Targets]]:
    """Read surface movement reports: the type of report decides what measured them.

    Ground bits come from transponders. What a surface movement radar detects is on the ground, or
    so low above it that the difference is within its errors.
    """
    technology = columns.integers("020", "TYP")
    report = (columns.integers("000") == _TARGET_REPORT) & (technology >= 0)
    primary = technology == _PRIMARY_010
    range_m, azimuth_deg = _polar(columns)
    code, code_flags = _code(columns, "060")
    height, height_flags = _level(columns, "090", "FL")
    height, geometric = _or_geometric(height, columns.numbers("091"))
    on_ground = np.where(primary, 1, _ground_bit(columns, "020", "220"))
    flags = _marked(
        ("test", columns.flags("020+1", "TST")),
        ("simulated", columns.flags("020+1", "SIM")),
        ("fixed_transponder", columns.flags("020+1", "RAB")),
        ("spi", columns.flags("020+2", "SPI")),
        ("no_detection", columns.integers("170", "CST") > 0),
        ("on_ground", on_ground == 1),
        ("other_technology", ~np.isin(technology, _KNOWN_010)),
    )
    data, dropped = aircraft_data(10, columns, height)
    whole = Targets(
        kind="",
        time_s=columns.numbers("140"),
        truncated_s=_nothing(columns),
        range_m=np.where(primary, range_m, np.nan),
        azimuth_deg=np.where(primary, azimuth_deg, np.nan),
        latitude_deg=np.where(primary, np.nan, columns.numbers("041", "LAT")),
        longitude_deg=np.where(primary, np.nan, columns.numbers("041", "LON")),
        height_m=height,
        x_m=np.where(primary, np.nan, _within(columns.numbers("042", "X"))),
        y_m=np.where(primary, np.nan, _within(columns.numbers("042", "Y"))),
        position_sigma_m=np.where(
            primary,
            np.nan,
            sigma_of_deviations(columns.numbers("500", "DEVX"), columns.numbers("500", "DEVY")),
        ),
        category=_category(columns),
        code=code,
        address=columns.integers("220"),
        callsign=columns.integers("245", "CHR"),
        on_ground=on_ground,
        detection=np.where(primary, _PSR, -1),
        flags=flags | code_flags | height_flags | geometric,
        aircraft_data=data,
        dropped=dropped,
    )
    kinds = {"radar": primary, "adsb": technology == _ADSB_010}
    kinds["mlat"] = ~kinds["radar"] & ~kinds["adsb"]
    return [
        (report & own, replace(select_targets(whole, report & own), kind=kind))
        for kind, own in kinds.items()
        if (report & own).any()
    ]


def _within(coordinate: Numbers) -> Numbers:
    """Omit coordinates at the end of their range of 16 bits: the target is farther away."""
    return np.where(np.abs(coordinate) < _FARTHEST_010_M, coordinate, np.nan)


def _polar(columns: Columns) -> tuple[Numbers, Numbers]:
    """Return range and azimuth, of local coordinates at the antenna where not reported."""
    x, y = columns.numbers("042", "X"), columns.numbers("042", "Y")
    polar = columns.present("040")
    return (
        np.where(polar, columns.numbers("040", "RHO"), np.hypot(x, y)),
        np.where(polar, columns.numbers("040", "TH"), np.degrees(np.arctan2(x, y)) % 360.0),
    )


def _category_020(columns: Columns) -> Targets:
    code, code_flags = _code(columns, "070")
    level, level_flags = _level(columns, "090", "FL")
    feet = columns.numbers("105")
    height, height_flags = _or_geometric(
        level, np.where(np.isnan(feet), columns.numbers("110"), feet)
    )
    status, bit = flight_status(columns, "230"), _ground_bit(columns, "020+1", "220")
    on_ground = np.where(status < 0, bit, status)
    flags = _marked(
        ("test", columns.flags("020+1", "TST")),
        ("simulated", columns.flags("020+1", "SIM")),
        ("fixed_transponder", columns.flags("020+1", "RAB")),
        ("spi", columns.flags("020+1", "SPI")),
        ("no_detection", columns.flags("170", "CST")),
        ("on_ground", on_ground == 1),
    )
    data, dropped = aircraft_data(20, columns, height)
    deviations = (columns.numbers("500/SDP", axis) for axis in ("X", "Y"))
    return Targets(
        kind="mlat",
        time_s=columns.numbers("140"),
        truncated_s=_nothing(columns),
        range_m=_nothing(columns),
        azimuth_deg=_nothing(columns),
        latitude_deg=columns.numbers("041", "LAT"),
        longitude_deg=columns.numbers("041", "LON"),
        height_m=height,
        x_m=columns.numbers("042", "X"),
        y_m=columns.numbers("042", "Y"),
        position_sigma_m=sigma_of_deviations(*deviations),
        category=_category(columns),
        code=code,
        address=columns.integers("220"),
        callsign=columns.integers("245", "CHR"),
        on_ground=on_ground,
        detection=_unknown(columns),
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
        x_m=_nothing(columns),
        y_m=_nothing(columns),
        position_sigma_m=sigma_of_adsb(columns),
        category=_category(columns),
        code=code,
        address=columns.integers("080"),
        callsign=columns.integers("170"),
        on_ground=on_ground,
        detection=_unknown(columns),
        flags=flags | code_flags | height_flags,
        aircraft_data=data,
        dropped=dropped,
    )


def _reception_021(columns: Columns) -> Numbers:
    """Return the time of the position: fine reception time, reception, applicability, sending.

    The second of the fine time may be that of the next or the previous day.
    """
    coarse = columns.numbers("073")
    step = np.array([0.0, 1.0, -1.0, 0.0])[np.maximum(columns.integers("074", "FSI"), 0)]
    fine = np.floor(coarse) + step + columns.numbers("074", "TOMRP")
    time = np.where(np.isnan(fine) | (coarse >= DAY_S), coarse, fine % DAY_S)
    for other in ("071", "077"):
        time = np.where(np.isnan(time), columns.numbers(other), time)
    return time


_READERS: dict[int, Callable[[Columns], Targets]] = {
    1: _category_001,
    20: _category_020,
    21: _category_021,
    48: _category_048,
}
