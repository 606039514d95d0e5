"""Heights of each sensor against those of the others for the same aircraft.

An offset is that of the sensors outside the largest group whose heights agree. One height of all
aircraft is a placeholder: others report other heights, or ranges and positions contradict it.
"""

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.heights import are_reported, unit_of
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named
from multiradar.diagnosis.cross_sensor.registration import heights_differ
from multiradar.diagnosis.model import Diagnosis, Severity
from multiradar.diagnosis.motion.height_steps import FLIGHT_LEVEL_M, are_stepped
from multiradar.diagnosis.motion.speeds import are_slow
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import Floats, Plots
from multiradar.geodesy.wgs84 import ecef_to_geodetic

#: Smallest difference of heights that is reported, m, and how far half of them are from it at
#: most: Mode C has steps of 30 m, and an aircraft climbs 100 m between two plots.
OFF_MIN_M, SPREAD_MAX_M = 150.0, 100.0
#: ... between radars and reported positions, which may be geometric heights.
REPORTED_OFF_MIN_M = 250.0
#: One height is a placeholder if this fraction of the heights of so many aircraft has it; without
#: others that contradict it, of more aircraft.
_SAME_MIN, _AIRCRAFT_MIN, _AIRCRAFT_ALONE_MIN = 0.98, 5, 8
#: Aircraft that an offset needs.
_OFFSET_AIRCRAFT_MIN = 3
#: `multiradar simulate` gives this height to all aircraft on a plane, m.
_PLANE_HEIGHT_M = 9000.0
OFFSET_CODE = "height_offset"
HEIGHTS_MISSING_CODE = "heights_missing"


class _Offset(NamedTuple):
    """Heights of a sensor minus those of another: median and its spread, m; unit of the ratio."""

    middle_m: float
    spread_m: float
    unit: str


def check_height_levels(
    comparison: Comparison, pairs: Mapping[int, Pairs], names: tuple[str, ...]
) -> list[Diagnosis]:
    """Diagnose heights that are the same for all aircraft, missing, or off by one value.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    pairs : mapping of Pairs
        Positions by the others of the aircraft of the tested plots of each sensor.
    names : tuple of str
        Identifiers of the sensors.
    """
    heights = {one: _known(comparison.plots(one).height_m) for one in pairs}
    constant = [
        one for one in pairs if _is_one_height(comparison.plots(one), heights[one], _AIRCRAFT_MIN)
    ]
    varied = [one for one in pairs if one not in constant and len(heights[one]) >= TESTED_MIN]
    found = [
        diagnosis
        for one in constant
        if (diagnosis := _of_constant(comparison, one, pairs[one], varied, names)) is not None
    ]
    found += [
        _missing(names[one], [names[radar] for radar in radars])
        for one in pairs
        if not comparison.is_radar(one) and not len(heights[one])
        if (radars := _with_heights(comparison, pairs[one], varied))
    ]
    if found:
        return found
    if constant and not varied:
        return _of_all(comparison, constant, pairs, names)
    return _of_offsets(comparison, {one: pairs[one] for one in varied}, names)


def _known(values: Floats) -> Floats:
    return values[np.isfinite(values)]


# Whether the heights of so many aircraft are one height.
def _is_one_height(plots: Plots, heights: Floats, aircraft: int) -> bool:
    if len(heights) < TESTED_MIN:
        return False
    values, counts = np.unique(heights, return_counts=True)
    if counts.max() < _SAME_MIN * len(heights):
        return False
    names = aircraft_of(plots)[plots.height_m == values[counts.argmax()]]
    return len(np.unique(names[names >= 0])) >= aircraft


# Heights of plots and of the positions by some others; those that are not known are assumed.
def _both(
    comparison: Comparison, number: int, pairs: Pairs, others: Collection[int]
) -> tuple[Floats, Floats, Pairs]:
    own_m = comparison.tested(number).height_m[pairs.plot]
    _, _, other_m = ecef_to_geodetic(pairs.position_m)
    rows = np.flatnonzero(
        np.isin(pairs.source, list(others)) & np.isfinite(own_m) & are_reported(other_m)
    )
    return own_m[rows], other_m[rows], pairs.select(rows)


def _of_constant(
    comparison: Comparison, number: int, pairs: Pairs, varied: list[int],
    names: tuple[str, ...],
) -> Diagnosis | None:  # fmt: skip
    if not are_named(pairs):
        return None
    own_m, other_m, _ = _both(comparison, number, pairs, varied)
    apart_m = np.abs(other_m - own_m)
    if len(apart_m) < TESTED_MIN or not np.median(apart_m) > OFF_MIN_M:
        return None
    low_m, high_m = np.quantile(other_m, (0.05, 0.95))
    return _placeholder(
        names[number],
        float(np.median(own_m)),
        f"other sensors report {low_m:.0f} m to {high_m:.0f} m for the same aircraft",
    )


def _placeholder(name: str, value_m: float, why: str, severity: Severity = "error") -> Diagnosis:
    return Diagnosis(
        name,
        "column_constant",
        f"{name}: its height_m is probably a placeholder: the value is {value_m:g} for all its "
        f"aircraft, but {why}; write the measured heights, or leave height_m empty",
        severity,
    )


# Radars with heights for most of the aircraft of a sensor.
def _with_heights(comparison: Comparison, pairs: Pairs, varied: list[int]) -> list[int]:
    if not are_named(pairs):
        return []
    _, _, other_m = ecef_to_geodetic(pairs.position_m)
    known = are_reported(other_m)
    return [
        one
        for one in varied
        if comparison.is_radar(one)
        and np.count_nonzero(known & (pairs.source == one)) >= TESTED_MIN
        and len(np.unique(pairs.name[known & (pairs.source == one)])) >= _AIRCRAFT_MIN
    ]


def _missing(name: str, radars: list[str]) -> Diagnosis:
    return Diagnosis(
        name,
        HEIGHTS_MISSING_CODE,
        f"{name}: its heights may be lost: none of its positions has one, although "
        f"{listed(radars)} report{'s' if len(radars) == 1 else ''} heights for the same aircraft; "
        "fill height_m with the reported heights, if the source has them",
        "warning",
    )


# One height of all sensors: wrong where ranges and positions contradict it.
def _of_all(
    comparison: Comparison, constant: list[int], pairs: Mapping[int, Pairs], names: tuple[str, ...]
) -> list[Diagnosis]:
    values_m = {one: float(np.median(_known(comparison.plots(one).height_m))) for one in constant}
    spreads_m = {
        one: heights_differ(comparison, one, pairs[one])
        for one in constant
        if comparison.is_radar(one) and are_named(pairs[one])
    }
    known = [one for one in spreads_m.values() if np.isfinite(one)]
    plane = set(values_m.values()) == {_PLANE_HEIGHT_M}
    # Nothing contradicts it where no other sensor sees the aircraft: all may fly at one level.
    severity: Severity = "error" if known else "warning"
    if known and max(known) > 0.0:
        why = "their ranges and positions differ as those of aircraft at several heights do"
    elif known or plane:
        return []
    else:
        asked = [
            _is_one_height(comparison.plots(one), _known(comparison.plots(one).height_m),
                           _AIRCRAFT_ALONE_MIN)
            and not are_slow(comparison.plots(one), comparison.site_of_radar(one))
            and not _is_level(values_m[one])
            for one in constant
        ]  # fmt: skip
        if not all(asked):
            return []
        why = "aircraft rarely fly at one height without any change"
    return [_placeholder(names[one], values_m[one], why, severity) for one in constant]


# Whether aircraft may all fly at a height: a flight level, as few placeholders are.
def _is_level(height_m: float) -> bool:
    return height_m > 0.0 and are_stepped(np.array([height_m]), FLIGHT_LEVEL_M)


# Sensors outside the largest group whose heights agree.
def _of_offsets(
    comparison: Comparison, pairs: Mapping[int, Pairs], names: tuple[str, ...]
) -> list[Diagnosis]:
    offsets = {
        (one, other): offset
        for one in pairs
        if are_named(pairs[one])
        for other in pairs
        if other != one and (offset := _offset(comparison, one, other, pairs[one])) is not None
    }
    groups = {
        one: {one}
        | {
            other
            for other in pairs
            if (offset := offsets.get((other, one))) and abs(offset.middle_m) < SPREAD_MAX_M
        }
        for one in pairs
    }
    if not groups:
        return []
    # The heights of a radar count before those that aircraft report, which may be geometric.
    right = max(groups.values(), key=lambda one: (len(one), sum(map(comparison.is_radar, one))))
    found = []
    for one in pairs:
        off_m = _off(comparison, offsets, one, right)
        if one in right or np.isnan(off_m):
            continue
        either = len(groups[one]) == len(right) and len(pairs) <= 2 * len(right)
        found.append(_of_offset(comparison, names, one, sorted(right), off_m, either=either))
    return found


def _off(
    comparison: Comparison, offsets: Mapping[tuple[int, int], _Offset], one: int,
    right: Collection[int],
) -> float:  # fmt: skip
    against = [offsets[one, other] for other in sorted(right) if (one, other) in offsets]
    if not against or any(offset.unit or offset.spread_m > SPREAD_MAX_M for offset in against):
        return np.nan
    off_m = float(np.median([offset.middle_m for offset in against]))
    reported = not comparison.is_radar(one) or not any(map(comparison.is_radar, right))
    least_m = REPORTED_OFF_MIN_M if reported else OFF_MIN_M
    alike = all(abs(offset.middle_m - off_m) <= SPREAD_MAX_M for offset in against)
    return off_m if alike and abs(off_m) >= least_m else np.nan


def _offset(comparison: Comparison, one: int, other: int, pairs: Pairs) -> _Offset | None:
    own_m, other_m, chosen = _both(comparison, one, pairs, [other])
    if len(own_m) < TESTED_MIN or len(np.unique(chosen.name)) < _OFFSET_AIRCRAFT_MIN:
        return None
    apart_m = own_m - other_m
    middle_m = float(np.median(apart_m))
    spread_m = float(np.median(np.abs(apart_m - middle_m)))
    high = other_m > 1000.0
    ratio = own_m[high] / other_m[high]
    is_ratio = len(ratio) >= TESTED_MIN and np.ptp(np.quantile(ratio, (0.1, 0.9))) <= 0.02
    return _Offset(middle_m, spread_m, unit_of(float(np.median(ratio))) if is_ratio else "")


def _of_offset(
    comparison: Comparison, names: tuple[str, ...], one: int, right: list[int], off_m: float,
    *, either: bool,
) -> Diagnosis:  # fmt: skip
    of_all = all(map(comparison.is_radar, right)) and not comparison.is_radar(one)
    hint = "corrected for pressure (QNH)?"
    if comparison.is_radar(one) and abs(off_m + comparison.site(one)[2]) <= SPREAD_MAX_M:
        hint = "heights above its site?"
    elif of_all:
        hint = "geometric heights, or another pressure?"
    others = listed([names[other] for other in right])
    which = f"that {'all radars ' if of_all else ''}{f'({others})' if of_all else others} report "
    which += "for the same aircraft"
    doubt = ""
    if either or of_all:
        them = "the radars" if of_all and len(right) > 1 else others
        doubt = f", or those of {them} have the opposite offset"
    sense = "above" if off_m > 0.0 else "below"
    return Diagnosis(
        names[one],
        OFFSET_CODE,
        f"{names[one]}: its heights probably have an offset{doubt}: they are {abs(off_m):.0f} m "
        f"{sense} the heights {which} ({hint}); write the pressure altitudes (Mode C)",
    )
