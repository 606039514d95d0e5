"""Which single mistake explains the plots of a sensor that lie where nobody else sees aircraft."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import (
    AZIMUTH_OFFSET_MAX_RAD,
    Agreement,
    best_site,
    polar_agreement,
    position_agreement,
    seen_from,
)
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.hypotheses import (
    AZIMUTH_UNITS,
    READINGS,
    Reading,
    as_given,
    other_sites,
)
from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.plots import Plots, Site, reported
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: A mistake explains a sensor when so many more of its plots agree with it than without it.
GAIN_MIN = 0.3
#: An explanation with fewer free numbers is preferred to one that explains so much more.
SIMPLER_SHARE = 0.1
#: Offsets of azimuth up to this may be those of magnetic north, which differs by less from true
#: north outside the polar regions (WMM2020), degrees.
MAGNETIC_MAX_DEG = 25.0
#: Azimuths end here, rad, but for so many wrong ones.
CIRCLE_MAX_RAD, BEYOND_MAX = 2.002 * np.pi, 2
#: Clocks are tried in steps of half hours, the finest of time zones but for three, up to a day.
ZONE_STEP_S, ZONES = 1800.0, 48
_COMPASS = (
    "north",
    "north-east",
    "east",
    "south-east",
    "south",
    "south-west",
    "west",
    "north-west",
)


@dataclass(frozen=True, slots=True)
class Explanation:
    """A mistake that would explain what is seen.

    Attributes
    ----------
    code : str
        Of the diagnosis.
    mistake, with_it, remedy : str
        Parts of the sentence.
    share, before : float
        Part of the plots that agree with the mistake corrected, and as they are.
    """

    code: str
    mistake: str
    with_it: str
    remedy: str
    share: float
    before: float

    def sentence(self, name: str, elsewhere: str) -> str:
        """Return it in words: of which sensor, and where the plots lie then."""
        return (
            f"{name}: {self.mistake}: with {self.with_it}, {self.share:.0%} of its plots lie "
            f"{elsewhere} ({self.before:.0%} as they are); {self.remedy}"
        )


def explained(
    comparison: Comparison, number: int, trusted: Collection[int], names: tuple[str, ...]
) -> Explanation | None:
    """Return the mistake that explains a sensor, None when no single one does.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The sensor.
    trusted : collection of int
        The sensors that it is compared with.
    names : tuple of str
        Names of the sensors.
    """
    pairs = comparison.pairs(number, trusted)
    before = comparison.agreement(number, pairs).share
    tried = _tried_radar if comparison.is_radar(number) else _tried_positions
    found = _best(tried(comparison, number, pairs, names), before)
    return found or _best(_clocks(comparison, number, trusted), before)


def alike(
    comparison: Comparison, suspects: Collection[int], names: tuple[str, ...]
) -> list[Diagnosis]:
    """Return the mistake that all radars have alike: sensors agree once it is corrected in all.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    suspects : collection of int
        Sensors of which none agrees with another.
    names : tuple of str
        Names of the sensors.
    """
    radars = [one for one in suspects if comparison.is_radar(one)]
    for reading in READINGS:
        if reading.turned:
            continue
        shares = [_share_alike(comparison, one, suspects, reading) for one in radars]
        if shares and min(shares) >= AGREES_MIN:
            return [
                Diagnosis(
                    names[one], reading.code,
                    f"{names[one]}: {reading.mistake}, as those of all radars: with "
                    f"{reading.with_it}, {share:.0%} of its plots lie where other sensors see "
                    f"aircraft; {reading.remedy}",
                )
                for one, share in zip(radars, shares, strict=True)
            ]  # fmt: skip
    return []


def _share_alike(
    comparison: Comparison, number: int, others: Collection[int], reading: Reading
) -> float:
    plots = comparison.tested(number)
    pairs = comparison.pairs(number, others, reading=reading.polar)
    compared = len(np.unique(pairs.plot))
    if compared < TESTED_MIN:
        return 0.0
    measured = reading.polar(plots.range_m, plots.azimuth_deg)
    return polar_agreement(measured, comparison.site(number), pairs, compared=compared).share


_Tried = Iterator[tuple[Callable[[Agreement, float], Explanation], Agreement]]


def _best(tried: _Tried, before: float) -> Explanation | None:
    best: Explanation | None = None
    for make, agreement in tried:
        enough = agreement.compared >= TESTED_MIN and agreement.share >= AGREES_MIN
        if not enough or agreement.share < before + GAIN_MIN:
            continue
        if best is None or agreement.share > best.share + SIMPLER_SHARE:
            best = make(agreement, before)
    return best


# The simplest mistakes first.
def _tried_radar(
    comparison: Comparison, number: int, pairs: Pairs, names: tuple[str, ...]
) -> _Tried:
    plots, site = comparison.tested(number), comparison.site(number)
    compared = len(np.unique(pairs.plot))
    for reading in READINGS:
        if not _within_a_circle(reading, comparison.plots(number)):
            continue
        measured = reading.polar(plots.range_m, plots.azimuth_deg)
        agreement = polar_agreement(measured, site, pairs, compared=compared, turned=reading.turned)
        yield _read_so(reading), agreement
    measured = as_given(plots.range_m, plots.azimuth_deg)
    sites = {
        names[one]: comparison.site(one)
        for one in range(len(names))
        if one != number and np.isfinite(comparison.site(one)).all()
    }
    for other in other_sites(site, sites):
        agreement = polar_agreement(measured, other.site, pairs, compared=compared)
        yield _so("site", other.mistake, other.with_it, other.remedy), agreement
    if compared:
        found = best_site(plots, measured, site, pairs)
        agreement = polar_agreement(measured, found, pairs, compared=compared)
        yield _stands(site, found), agreement


# 6400 mils are not so many milliradians, though one is nearly the other.
def _within_a_circle(reading: Reading, plots: Plots) -> bool:
    if reading not in AZIMUTH_UNITS:
        return True
    _, azimuth = reading.polar(plots.range_m, plots.azimuth_deg)
    return bool(np.count_nonzero(azimuth > CIRCLE_MAX_RAD) <= BEYOND_MAX)


def _read_so(reading: Reading) -> Callable[[Agreement, float], Explanation]:
    def made(agreement: Agreement, before: float) -> Explanation:
        offset_deg = float(np.degrees(agreement.offset[1])) if reading.turned else 0.0
        hint = "check what its azimuths count from"
        if AZIMUTH_OFFSET_MAX_RAD < abs(np.radians(offset_deg)) <= np.radians(MAGNETIC_MAX_DEG):
            hint = "check whether they count from magnetic in place of true north"
        words = {"offset": f"{offset_deg:+.1f}°", "origin": _origin(offset_deg), "hint": hint}
        return Explanation(
            reading.code, reading.mistake.format(**words), reading.with_it.format(**words),
            reading.remedy.format(**words), agreement.share, before,
        )  # fmt: skip

    return made


# −measured = azimuth + offset, so that zero was counted from −offset.
def _origin(offset_deg: float) -> str:
    from_north = -offset_deg % 360.0
    nearest = round(from_north / 90.0) % 4
    if abs((from_north - 90.0 * nearest + 180.0) % 360.0 - 180.0) < 5.0:
        return ("north", "east", "south", "west")[nearest]
    return f"{from_north:.1f}°"


def _stands(site: Site, found: Site) -> Callable[[Agreement, float], Explanation]:
    def made(agreement: Agreement, before: float) -> Explanation:
        distance_m, azimuth = seen_from(site, geodetic_to_ecef(*found)[None])
        latitude, longitude = np.degrees(found[0]), np.degrees(found[1])
        course = _COMPASS[round(float(azimuth[0]) / (np.pi / 4.0)) % 8]
        at = f"{latitude:.4f}, {longitude:.4f}"
        return Explanation(
            "site",
            f"its site is probably {float(distance_m[0]) / 1e3:.1f} km {course} of the one "
            "configured",
            f"the site at {at}",
            "correct latitude_deg and longitude_deg in the sensors file",
            agreement.share,
            before,
        )

    return made


def _tried_positions(
    comparison: Comparison, number: int, pairs: Pairs, _names: tuple[str, ...]
) -> _Tried:
    plots = comparison.tested(number)
    compared = len(np.unique(pairs.plot))
    latitude, longitude = plots.latitude_deg, plots.longitude_deg
    tries = (
        ("columns_exchanged", "latitude_deg and longitude_deg are probably exchanged",
         "the two exchanged", "exchange the columns", longitude, latitude),
        ("position_sign", "its longitudes probably have the wrong sign",
         "the sign changed", "make east positive", latitude, -longitude),
        ("position_sign", "its latitudes probably have the wrong sign",
         "the sign changed", "make north positive", -latitude, longitude),
        ("position_unit", "its positions are probably in radians",
         "them taken as radians", "convert them to degrees",
         np.degrees(latitude), np.degrees(longitude)),
    )  # fmt: skip
    for code, mistake, with_it, remedy, north, east in tries:
        moved = replace(plots, latitude_deg=north, longitude_deg=east)
        agreement = position_agreement(reported(moved), pairs, compared=compared)
        yield _so(code, mistake, with_it, remedy), agreement


def _clocks(comparison: Comparison, number: int, trusted: Collection[int]) -> _Tried:
    for step in range(1, ZONES + 1):
        for late_s in (step * ZONE_STEP_S, -step * ZONE_STEP_S):
            if not comparison.overlaps(number, trusted, late_s):
                continue
            pairs = comparison.pairs(number, trusted, late_s=late_s)
            timed = pairs.take(pairs.source >= 0)
            if len(np.unique(timed.plot)) >= TESTED_MIN:
                yield _clock(late_s), comparison.agreement(number, timed)


def _clock(late_s: float) -> Callable[[Agreement, float], Explanation]:
    way = "ahead" if late_s > 0.0 else "behind"
    return _so(
        "clock",
        f"its clock is probably {abs(late_s) / 3600.0:g} h {way} (another time zone?)",
        f"{'later' if late_s < 0.0 else 'earlier'} times",
        "convert its times to UTC",
    )


def _so(
    code: str, mistake: str, with_it: str, remedy: str
) -> Callable[[Agreement, float], Explanation]:
    return lambda agreement, before: Explanation(
        code, mistake, with_it, remedy, agreement.share, before
    )
