"""Errors that are tested on the plots of a radar: other interpretations of its values."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from multiradar.diagnosis.plots import Floats, Site
from multiradar_schemas.measurements.units import FOOT_M, NAUTICAL_MILE_M

Polar = tuple[Floats, Floats]


@dataclass(frozen=True, slots=True)
class Reading:
    """Another interpretation of the range and azimuth columns.

    Attributes
    ----------
    code : str
        Of the diagnosis.
    polar : callable
        Converts the values of the two columns to ranges, m, and azimuths, rad.
    mistake : str
        The error, as it follows the name of the sensor.
    with_it : str
        The correction, as it follows "with".
    remedy : str
        What to do.
    any_rotation : bool
        Whether it allows any azimuth offset.
    """

    code: str
    polar: Callable[[Floats, Floats], Polar]
    mistake: str
    with_it: str
    remedy: str
    any_rotation: bool = False


def as_given(range_m: Floats, azimuth_deg: Floats) -> Polar:
    """Return ranges, m, and azimuths, rad, of correct columns."""
    return range_m, np.radians(azimuth_deg)


def _range_unit(name: str, metres: float) -> Reading:
    return Reading(
        "range_unit",
        lambda ranges, azimuths: (ranges * metres, np.radians(azimuths)),
        f"its ranges are probably in {name}",
        f"ranges interpreted as {name}",
        "convert them to metres",
    )


def _azimuth_unit(name: str, radians: float) -> Reading:
    return Reading(
        "azimuth_unit",
        lambda ranges, azimuths: (ranges, azimuths * radians),
        f"its azimuths are probably in {name}",
        f"azimuths interpreted as {name}",
        "convert them to degrees",
    )


#: Possible units of range, m; the last two are those of ASTERIX categories 001 and 048.
RANGE_UNITS = (
    _range_unit("kilometres", 1e3),
    _range_unit("nautical miles", NAUTICAL_MILE_M),
    _range_unit("feet", FOOT_M),
    _range_unit("yards", 0.9144),
    _range_unit("units of 1/128 NM", NAUTICAL_MILE_M / 128.0),
    _range_unit("units of 1/256 NM", NAUTICAL_MILE_M / 256.0),
)
#: Rarer ones, tried where all radars have them, or with the factor that the plots show.
RARE_RANGE_UNITS = tuple(
    _range_unit(name, metres)
    for name, metres in {
        "statute miles": 1609.344,
        "decimetres": 0.1,
        "decametres": 10.0,
        "hectometres": 100.0,
        **{f"units of 1/{parts} NM": NAUTICAL_MILE_M / parts for parts in (8, 16, 32, 64)},
        "microseconds from pulse to echo": 149.896,
    }.items()
)
#: Units of the values and units from which they were converted, m.
_LENGTHS = {
    "nautical miles": NAUTICAL_MILE_M,
    "statute miles": 1609.344,
    "kilometres": 1e3,
    "metres": 1.0,
    "yards": 0.9144,
    "feet": FOOT_M,
}
#: Factors of ranges by a conversion from the wrong unit: both are miles, or both are short.
CONVERSIONS = tuple(
    replace(
        _range_unit(given, _LENGTHS[given] / _LENGTHS[taken]),
        code="range_factor",
        mistake=f"its ranges are probably {given} that were converted as {taken}",
        with_it=f"conversion from {given}",
        remedy=f"convert them from {given}",
    )
    for given, taken in (
        ("nautical miles", "statute miles"),
        ("statute miles", "nautical miles"),
        ("nautical miles", "kilometres"),
        ("kilometres", "nautical miles"),
        ("metres", "yards"),
        ("metres", "feet"),
    )
)
#: A factor of ranges is that of a unit within this.
_UNIT_WITHIN = 0.01
#: Possible units of azimuth, rad; the last ones are counts of an encoder.
AZIMUTH_UNITS = (
    _azimuth_unit("radians", 1.0),
    _azimuth_unit("revolutions", 2.0 * np.pi),
    _azimuth_unit("milliradians", 1e-3),
    _azimuth_unit("gradians", np.pi / 200.0),
    _azimuth_unit("mils (6400 to a circle)", np.pi / 3200.0),
    _azimuth_unit("tenths of a degree", np.pi / 1800.0),
    _azimuth_unit("hundredths of a degree", np.pi / 18_000.0),
    _azimuth_unit("counts of 4096 per revolution", np.pi / 2048.0),
    _azimuth_unit("counts of 8192 per revolution", np.pi / 4096.0),
    _azimuth_unit("counts of 16 384 per revolution", np.pi / 8192.0),
    _azimuth_unit("counts of 65 536 per revolution", np.pi / 32_768.0),
)
HALVED_AZIMUTHS = Reading(
    "azimuth_factor",
    lambda ranges, azimuths: (ranges, 2.0 * np.radians(azimuths)),
    "its azimuths are probably half the true ones",
    "twice those azimuths",
    "multiply them by 2",
)
EXCHANGED = Reading(
    "columns_exchanged",
    lambda ranges, azimuths: (azimuths, np.radians(ranges)),
    "its range and azimuth columns are probably swapped",
    "the two columns swapped",
    "swap range_m and azimuth_deg",
)


def _exchanged(name: str, metres: float) -> Reading:
    return Reading(
        EXCHANGED.code,
        lambda ranges, azimuths: (azimuths * metres, np.radians(ranges)),
        f"{EXCHANGED.mistake}, with ranges in {name}",
        f"{EXCHANGED.with_it}, and ranges interpreted as {name}",
        f"{EXCHANGED.remedy}, and convert the ranges to metres",
    )


#: Ranges below 360 in these units are no impossible azimuths.
EXCHANGED_UNITS = (_exchanged("kilometres", 1e3), _exchanged("nautical miles", NAUTICAL_MILE_M))
MIRRORED = Reading(
    "azimuth_anticlockwise",
    lambda ranges, azimuths: (ranges, -np.radians(azimuths)),
    "its azimuths are probably measured anticlockwise",
    "azimuths measured anticlockwise from {origin}",
    "measure them clockwise from true north",
    any_rotation=True,
)
_REVERSED = {"north": 360.0, "east": 90.0, "south": 180.0, "west": 270.0}


def reversed_from(origin: str) -> Reading:
    """Return the interpretation of azimuths measured anticlockwise from north, east, south or west.

    Those from east are the angles of mathematics: 90° − azimuth.
    """
    turn_deg = _REVERSED[origin]
    convention = f" ({turn_deg:.0f}° minus the azimuth)"
    if origin == "east":
        convention = " (mathematical convention: 90° minus the azimuth)"
    return Reading(
        "azimuth_anticlockwise",
        lambda ranges, azimuths: (ranges, np.radians(turn_deg - azimuths)),
        f"its azimuths are probably measured anticlockwise from {origin}{convention}",
        f"{turn_deg:.0f}° minus these values",
        f"replace each value by {turn_deg:.0f}° minus it (plus 360° if that is negative)",
    )


MATHEMATICAL = reversed_from("east")
ROTATED = Reading(
    "azimuth_offset",
    as_given,
    "its azimuths are probably off by {offset}",
    "this offset removed",
    "{hint}",
    any_rotation=True,
)


def turned(offset_deg: float) -> Reading:
    """Return the interpretation of azimuths that are off by an angle."""
    return Reading(
        "azimuth_offset",
        lambda ranges, azimuths: (ranges, np.radians(azimuths - offset_deg)),
        f"its azimuths are probably off by about {offset_deg:+.0f}°",
        "this offset removed",
        "check the reference direction of its azimuths (magnetic north?)",
    )


def _range_factor(word: str, other: str, factor: float) -> Reading:
    return Reading(
        "range_factor",
        lambda ranges, azimuths: (ranges * factor, np.radians(azimuths)),
        f"its ranges are probably {word} the true distances",
        f"{other} those ranges",
        f"multiply them by {factor:g}",
    )


def scaled(factor: float) -> Reading:
    """Return the interpretation of ranges that are to be multiplied by a factor, as of a unit."""
    for unit in (*RARE_RANGE_UNITS, *CONVERSIONS):
        metres, _ = unit.polar(np.ones(1), np.zeros(1))
        if abs(metres[0] / factor - 1.0) <= _UNIT_WITHIN:
            return unit
    times = f"{1.0 / factor:.3g}"
    return Reading(
        "range_factor",
        lambda ranges, azimuths: (ranges * factor, np.radians(azimuths)),
        f"its ranges are probably {times} times the true distances",
        f"ranges divided by {times}",
        "check their unit",
    )


#: The way to the target and back was taken as that to the target, or the other way round.
HALVED, DOUBLED = _range_factor("half", "twice", 2.0), _range_factor("twice", "half", 0.5)
READINGS = (
    *RANGE_UNITS,
    HALVED,
    DOUBLED,
    *AZIMUTH_UNITS,
    EXCHANGED,
    *EXCHANGED_UNITS,
    MATHEMATICAL,
    MIRRORED,
    ROTATED,
)


@dataclass(frozen=True, slots=True)
class SiteReading:
    """Another site of a radar.

    Attributes
    ----------
    site : Site
        The site.
    mistake, with_it, remedy : str
        As of `Reading`.
    """

    site: Site
    mistake: str
    with_it: str
    remedy: str


def other_sites(site: Site, of_others: dict[str, Site]) -> Iterator[SiteReading]:
    """Yield sites from which a typical error would produce the configured one.

    Parameters
    ----------
    site : Site
        As configured, rad and m.
    of_others : dict
        Sites of the other sensors.
    """
    latitude, longitude, height = site
    if abs(longitude) <= np.pi / 2.0:
        yield SiteReading(
            (longitude, latitude, height),
            "latitude_deg and longitude_deg of its site are probably swapped",
            "the two values swapped",
            "correct them in the sensors file",
        )
    for names, signs in (
        ("latitude_deg", (-1.0, 1.0)),
        ("longitude_deg", (1.0, -1.0)),
        ("latitude_deg and longitude_deg", (-1.0, -1.0)),
    ):
        both = " and " in names
        yield SiteReading(
            (signs[0] * latitude, signs[1] * longitude, height),
            f"{names} of its site probably {'have' if both else 'has'} the wrong sign",
            "the opposite sign",
            f"correct {'them' if both else 'it'} in the sensors file (north and east are positive)",
        )
    for name, other in of_others.items():
        if other[:2] != site[:2]:
            yield SiteReading(
                other,
                f"its site is probably the site of {name}",
                f"the site of {name}",
                "correct latitude_deg, longitude_deg and height_m of both sensors in the sensors "
                "file",
            )
