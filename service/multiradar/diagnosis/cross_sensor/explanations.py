"""The single error that explains a sensor whose plots match no other sensor."""

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
from multiradar.diagnosis.cross_sensor.clocks import LATE_MIN_S, late_on_paths, late_positions
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.displacements import OPPOSITE, displacement, place
from multiradar.diagnosis.cross_sensor.hypotheses import (
    AZIMUTH_UNITS,
    CONVERSIONS,
    RARE_RANGE_UNITS,
    READINGS,
    Reading,
    as_given,
    other_sites,
    reversed_from,
    scaled,
    turned,
)
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import Plots, Site, reported
from multiradar.geodesy.wgs84 import geodetic_to_ecef
from multiradar.report.times import gps_time

#: An error explains a sensor when correcting it raises the fraction that agrees by this much.
GAIN_MIN = 0.3
#: Compared plots that suffice for another of the configured sites, or a change of its signs: one in
#: some hundred fits by chance.
FEW_MIN = 8
#: Where plots lie that agree with the positions in the recording.
BY_RECORDING = "where the recording places aircraft"
#: An explanation with fewer free parameters is preferred unless another explains this much more.
SIMPLER_SHARE = 0.1
#: Offsets of azimuth up to this may be those of magnetic north, which differs by less from true
#: north outside the polar regions (WMM2020), degrees.
MAGNETIC_MAX_DEG = 25.0
#: Offsets of the azimuths of all radars that are tried, degrees: in steps of 1°, which displace
#: aircraft by 2 km for sites 230 km apart.
_TURNS_DEG = (90.0, -90.0, 180.0, *(sign * float(one) for one in range(3, 13) for sign in (1, -1)))
#: Largest azimuth, rad, and the number of outliers accepted beyond it.
CIRCLE_MAX_RAD, BEYOND_MAX = 2.002 * np.pi, 2
#: Equal factors of ranges, as a fraction; a smaller one is a gain.
_FACTOR_WITHIN = 0.05
#: Times that a clock error is estimated, each from positions at the time by the one before.
_CLOCK_STEPS = 4
#: ... from the one of these, s, with which most plots agree.
_CLOCKS_S, _ALIKE = tuple(3.0 * step for step in range(1, 108)), 0.95
#: Largest displacement of reported positions that is tried, m.
DISPLACED_MAX_M = 100_000.0
#: Time offsets are tried in steps of half an hour up to a day; only three time zones are finer.
ZONE_STEP_S, ZONES = 1800.0, 48


@dataclass(frozen=True, slots=True)
class Explanation:
    """An error that would explain the disagreement.

    Attributes
    ----------
    code : str
        Of the diagnosis.
    mistake, with_it, remedy : str
        Parts of the sentence.
    share, before : float
        Fraction of the plots that agree with the error corrected, and as they are.
    few : bool
        Whether few plots suffice: the correction is one of few and has no free parameter.
    """

    code: str
    mistake: str
    with_it: str
    remedy: str
    share: float
    before: float
    few: bool = False

    def sentence(self, name: str, elsewhere: str) -> str:
        """Return the message for a sensor; `elsewhere` says where the plots lie then."""
        return (
            f"{name}: {self.mistake}: with {self.with_it}, {self.share:.0%} of its plots lie "
            f"{elsewhere} ({self.before:.0%} as recorded); {self.remedy}"
        )


def explain(
    comparison: Comparison,
    number: int,
    trusted: Collection[int],
    names: tuple[str, ...],
    *,
    agreeing: bool = False,
) -> Explanation | None:
    """Return the error that explains a sensor, None when no single one does.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The sensor.
    trusted : collection of int
        The sensors to compare with.
    names : tuple of str
        Names of the sensors.
    agreeing : bool
        Whether the others agree with each other: else the positions of the sensor may be right.
    """
    pairs = comparison.pairs(number, trusted)
    before = _before(comparison, number, pairs)
    tried = _radar_hypotheses if comparison.is_radar(number) else _position_hypotheses
    found = _best(tried(comparison, number, pairs, names), before)
    found = found or _best(_clocks(comparison, number, trusted), before)
    if found or comparison.is_radar(number) or not agreeing:
        return found
    return _best(_displaced(comparison, number, pairs, names), before)


# Of few plots, too.
def _before(comparison: Comparison, number: int, pairs: Pairs) -> float:
    if not comparison.is_radar(number):
        return comparison.agreement(number, pairs).share
    plots, compared = comparison.tested(number), len(np.unique(pairs.plot))
    measured = as_given(plots.range_m, plots.azimuth_deg)
    return polar_agreement(measured, comparison.site(number), pairs, compared=compared).share


def common_mistake(
    comparison: Comparison, suspects: Collection[int], names: tuple[str, ...]
) -> list[Diagnosis]:
    """Return the error that all radars have in common: correcting it in all makes them agree.

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
    units = [one for one in READINGS if not one.any_rotation]
    rare = (*RARE_RANGE_UNITS, *CONVERSIONS, reversed_from("north"), *map(turned, _TURNS_DEG))
    for reading in (*units, *rare):
        shares = []
        for one in radars:
            shares.append(common_share(comparison, one, suspects, reading))
            if shares[-1] < AGREES_MIN:
                break
        if shares and min(shares) >= AGREES_MIN:
            return [
                Diagnosis(
                    names[one], reading.code,
                    f"{names[one]}: {reading.mistake}, like those of all radars: with "
                    f"{reading.with_it}, {share:.0%} of its plots lie where other sensors "
                    f"detect aircraft; {reading.remedy}",
                )
                for one, share in zip(radars, shares, strict=True)
            ]  # fmt: skip
    return []


def anticlockwise(
    comparison: Comparison, number: int, names: tuple[str, ...], alike: Collection[int]
) -> Diagnosis | None:
    """Return from where a radar measures its azimuths anticlockwise, None where no other shows it.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The radar.
    names : tuple of str
        Names of the sensors.
    alike : collection of int
        The radars whose azimuths decrease from plot to plot; others are right.
    """
    plots, right = comparison.tested(number), set(comparison.numbers) - set(alike)
    found = []
    for reading in map(reversed_from, ("east", "north", "west", "south")):
        measured = reading.polar(plots.range_m, plots.azimuth_deg)
        # The others that are wrong have the same error, if there is none that is right.
        others, read = (right, as_given) if right else (set(alike), reading.polar)
        pairs = comparison.pairs(number, others, reading=read)
        compared = len(np.unique(pairs.plot))
        agreement = polar_agreement(measured, comparison.site(number), pairs, compared=compared)
        if compared >= TESTED_MIN and agreement.share >= AGREES_MIN:
            found.append((reading, agreement.share))
    if len(found) != 1:
        # Radars at one site agree from every direction.
        return None
    (reading, share) = found[0]
    return Diagnosis(
        names[number],
        reading.code,
        f"{names[number]}: {reading.mistake}: they decrease from plot to plot, and with "
        f"{reading.with_it}, {share:.0%} of its plots lie where other sensors detect "
        f"aircraft; {reading.remedy}",
    )


def common_share(
    comparison: Comparison, number: int, others: Collection[int], reading: Reading
) -> float:
    """Return the fraction of the plots of a radar that agree if an error of all is corrected."""
    plots = comparison.tested(number)
    pairs = comparison.pairs(number, others, reading=reading.polar)
    compared = len(np.unique(pairs.plot))
    if compared < TESTED_MIN:
        return 0.0
    measured = reading.polar(plots.range_m, plots.azimuth_deg)
    return polar_agreement(measured, comparison.site(number), pairs, compared=compared).share


_Hypotheses = Iterator[tuple[Callable[[Agreement, float], Explanation], Agreement]]


def _best(tried: _Hypotheses, before: float) -> Explanation | None:
    best: Explanation | None = None
    for make, agreement in tried:
        if agreement.share < max(AGREES_MIN, before + GAIN_MIN):
            continue
        found = make(agreement, before)
        if agreement.compared < (FEW_MIN if found.few else TESTED_MIN):
            continue
        if best is None or agreement.share > best.share + SIMPLER_SHARE:
            best = found
    return best


# The simplest errors first.
def _radar_hypotheses(
    comparison: Comparison, number: int, pairs: Pairs, names: tuple[str, ...]
) -> _Hypotheses:
    plots, site = comparison.tested(number), comparison.site(number)
    compared = len(np.unique(pairs.plot))
    factor = _range_factor(plots, site, pairs)
    for reading in (*READINGS, *([] if factor is None else [scaled(factor)])):
        if not _within_a_circle(reading, comparison.plots(number)):
            continue
        measured = reading.polar(plots.range_m, plots.azimuth_deg)
        agreement = polar_agreement(
            measured, site, pairs, compared=compared, any_rotation=reading.any_rotation
        )
        yield _by_reading(reading), agreement
    measured = as_given(plots.range_m, plots.azimuth_deg)
    sites = {
        names[one]: comparison.site(one)
        for one in range(len(names))
        if one != number and np.isfinite(comparison.site(one)).all()
    }
    for other in other_sites(site, sites):
        agreement = polar_agreement(measured, other.site, pairs, compared=compared)
        make = _by_words("site", other.mistake, other.with_it, other.remedy, few=True)
        yield make, agreement
    if compared:
        found = best_site(plots, measured, site, pairs)
        agreement = polar_agreement(measured, found, pairs, compared=compared)
        yield _by_site(site, found), agreement


# What the ranges of named aircraft are to be multiplied by; None where it differs, or is near 1.
def _range_factor(plots: Plots, site: Site, pairs: Pairs) -> float | None:
    own = plots.range_m[pairs.plot]
    if not are_named(pairs) or not (own > 0.0).any():
        return None
    seen, _ = seen_from(site, pairs.position_m)
    low, middle, high = np.quantile((seen[own > 0.0] / own[own > 0.0]), (0.25, 0.5, 0.75))
    # Offsets of near plots are a large fraction of their range.
    equal = high - low <= _FACTOR_WITHIN * middle
    return float(middle) if equal and abs(middle - 1.0) > _FACTOR_WITHIN else None


# Distinguishes mils (6400 to a circle) from milliradians, which are nearly equal.
def _within_a_circle(reading: Reading, plots: Plots) -> bool:
    if reading not in AZIMUTH_UNITS:
        return True
    _, azimuth = reading.polar(plots.range_m, plots.azimuth_deg)
    return bool(np.count_nonzero(azimuth > CIRCLE_MAX_RAD) <= BEYOND_MAX)


def _by_reading(reading: Reading) -> Callable[[Agreement, float], Explanation]:
    def made(agreement: Agreement, before: float) -> Explanation:
        offset_deg = float(np.degrees(agreement.offset[1])) if reading.any_rotation else 0.0
        hint = "check the reference direction of its azimuths"
        if AZIMUTH_OFFSET_MAX_RAD < abs(np.radians(offset_deg)) <= np.radians(MAGNETIC_MAX_DEG):
            hint = "check whether azimuths refer to magnetic instead of true north"
        words = {"offset": f"{offset_deg:+.1f}°", "origin": _origin(offset_deg), "hint": hint}
        return Explanation(
            reading.code, reading.mistake.format(**words), reading.with_it.format(**words),
            reading.remedy.format(**words), agreement.share, before,
        )  # fmt: skip

    return made


# −measured = azimuth + offset: the reference direction is −offset.
def _origin(offset_deg: float) -> str:
    from_north = -offset_deg % 360.0
    nearest = round(from_north / 90.0) % 4
    if abs((from_north - 90.0 * nearest + 180.0) % 360.0 - 180.0) < 5.0:
        return ("north", "east", "south", "west")[nearest]
    return f"{from_north:.1f}°"


def _by_site(site: Site, found: Site) -> Callable[[Agreement, float], Explanation]:
    def made(agreement: Agreement, before: float) -> Explanation:
        distance_m, azimuth = seen_from(site, geodetic_to_ecef(*found)[None])
        where = displacement(float(distance_m[0]), float(azimuth[0]))
        return Explanation(
            "site",
            f"its site is probably {where} of the configured site",
            f"the site at {place(found[0], found[1])}",
            "correct latitude_deg and longitude_deg in the sensors file",
            agreement.share,
            before,
        )

    return made


def _position_hypotheses(
    comparison: Comparison, number: int, pairs: Pairs, _names: tuple[str, ...]
) -> _Hypotheses:
    plots = comparison.tested(number)
    compared = len(np.unique(pairs.plot))
    latitude, longitude = plots.latitude_deg, plots.longitude_deg
    tries = (
        ("columns_exchanged", "latitude_deg and longitude_deg are probably swapped",
         "the two columns swapped", "swap the columns", longitude, latitude),
        ("position_sign", "its longitudes probably have the wrong sign",
         "the opposite sign", "make east positive", latitude, -longitude),
        ("position_sign", "its latitudes probably have the wrong sign",
         "the opposite sign", "make north positive", -latitude, longitude),
        ("position_unit", "its positions are probably in radians",
         "positions interpreted as radians", "convert them to degrees",
         np.degrees(latitude), np.degrees(longitude)),
    )  # fmt: skip
    for code, mistake, with_it, remedy, north, east in tries:
        moved = replace(plots, latitude_deg=north, longitude_deg=east)
        agreement = position_agreement(reported(moved), pairs, compared=compared)
        yield _by_words(code, mistake, with_it, remedy), agreement


# By one distance: of another datum, or of local coordinates with a wrong reference point.
def _displaced(
    comparison: Comparison, number: int, pairs: Pairs, names: tuple[str, ...]
) -> _Hypotheses:
    moved = reported(comparison.tested(number))
    compared = len(np.unique(pairs.plot))
    agreement = position_agreement(moved, pairs, compared=compared, within_m=DISPLACED_MAX_M)
    east_m, north_m = agreement.offset
    where = displacement(float(np.hypot(east_m, north_m)), float(np.arctan2(east_m, north_m)))
    mistake, remedy = f"its positions are probably displaced by {where}", "its positions"
    others = np.unique(pairs.source).tolist()
    if len(others) > 1 and all(comparison.is_radar(one) for one in others):
        radars = listed([names[one] for one in others])
        mistake += f", or the sites of all radars ({radars}) by {OPPOSITE}"
        remedy += ", or the sites in the sensors file"
    else:
        remedy += " (the reference point of local coordinates?)"
    with_it = "this displacement removed"
    yield _by_words("positions_displaced", mistake, with_it, f"correct {remedy}"), agreement


def _clocks(comparison: Comparison, number: int, trusted: Collection[int]) -> _Hypotheses:
    late_s = (
        _along(comparison, number, trusted, 0.0)
        or _along(comparison, number, trusted, late_on_paths(comparison, number, trusted))
        or _nearest_clock(comparison, number, trusted)
    )
    if abs(late_s) >= LATE_MIN_S:
        pairs = _timed(comparison, number, trusted, late_s)
        yield _seconds(late_s), comparison.agreement(number, pairs)
    for step in range(1, ZONES + 1):
        for late_s in (step * ZONE_STEP_S, -step * ZONE_STEP_S):
            if not comparison.overlaps(number, trusted, late_s):
                continue
            pairs = comparison.pairs(number, trusted, late_s=late_s)
            timed = pairs.select(pairs.source >= 0)
            if len(np.unique(timed.plot)) >= TESTED_MIN:
                yield _clock(late_s), comparison.agreement(number, timed)


# The clock error, s, by the places along the paths of the aircraft, from one about right; 0 where
# unknown.
def _along(comparison: Comparison, number: int, trusted: Collection[int], late_s: float) -> float:
    for _ in range(_CLOCK_STEPS):
        # Aircraft turn: the nearer the positions by others, the better the time.
        step_s = late_positions(comparison, number, _timed(comparison, number, trusted, late_s))
        late_s += np.nan_to_num(step_s)
        if not abs(step_s) >= LATE_MIN_S:
            break
    return late_s


# The clock error, s, with which most plots lie near the aircraft: 0 where none is better by far.
def _nearest_clock(comparison: Comparison, number: int, trusted: Collection[int]) -> float:
    if not are_named(_timed(comparison, number, trusted, 0.0)):
        return 0.0
    shares = {}
    for late_s in (0.0, *(sign * one for one in _CLOCKS_S for sign in (1.0, -1.0))):
        if comparison.overlaps(number, trusted, late_s):
            pairs = _timed(comparison, number, trusted, late_s)
            shares[late_s] = comparison.agreement(number, pairs).share
    best = max(shares.values(), default=0.0)
    if best < shares.get(0.0, 0.0) + GAIN_MIN:
        return 0.0
    return float(np.mean([late_s for late_s, share in shares.items() if share >= _ALIKE * best]))


# Positions by other sensors, without those in the recording, which have the same times.
def _timed(
    comparison: Comparison, number: int, trusted: Collection[int], late_s: float
) -> Pairs:  # fmt: skip
    pairs = comparison.pairs(number, trusted, late_s=late_s)
    return pairs.select(pairs.source >= 0)


def _clock(late_s: float) -> Callable[[Agreement, float], Explanation]:
    sense = "ahead" if late_s > 0.0 else "behind"
    return _by_words(
        "clock",
        f"its clock is probably {abs(late_s) / 3600.0:g} h {sense} (another time zone?)",
        f"{'later' if late_s < 0.0 else 'earlier'} times for its plots",
        "convert its times to UTC",
    )


def _seconds(late_s: float) -> Callable[[Agreement, float], Explanation]:
    sense = "ahead" if late_s > 0.0 else "behind"
    minutes = f" ({abs(late_s) / 60.0:.1f} min)" if abs(late_s) >= 300.0 else ""
    return _by_words(
        "clock",
        f"its clock is probably {abs(late_s):.1f} s {sense}{minutes}{gps_time(late_s)}",
        f"{'later' if late_s < 0.0 else 'earlier'} times for its plots",
        "correct its times, or set bias.time_offset_s in the sensors file",
    )


def _by_words(
    code: str, mistake: str, with_it: str, remedy: str, *, few: bool = False
) -> Callable[[Agreement, float], Explanation]:
    return lambda agreement, before: Explanation(
        code, mistake, with_it, remedy, agreement.share, before, few
    )
