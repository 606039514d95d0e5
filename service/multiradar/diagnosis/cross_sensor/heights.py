"""Heights of a sensor against those reported by others for the same aircraft."""

from collections.abc import Collection

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs
from multiradar.diagnosis.cross_sensor.registration import Registration
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import HEIGHT_ASSUMED_M
from multiradar.geodesy.wgs84 import ecef_to_geodetic
from multiradar_schemas.measurements.units import FOOT_M

#: What a height of 1 m is in other units, with their names.
_UNITS = {
    "feet": 1.0 / FOOT_M,
    "flight levels": 1.0 / 30.48,
    "hundreds of metres": 0.01,
    "kilometres": 0.001,
    "metres converted once more as if they were feet": FOOT_M,
}
_WITHIN = 0.05
#: Code of a wrong height of a site.
HEIGHT_CODE = "site_height_off"
#: Smallest difference of heights that is reported, m, and how far half of them are from it at
#: most: Mode C has steps of 30 m, and an aircraft climbs 100 m between two plots.
OFF_MIN_M, _SPREAD_MAX_M = 150.0, 100.0
_ASSUMED_WITHIN_M = 20.0


def check_heights(
    comparison: Comparison, number: int, name: str, agreement: Agreement, pairs: Pairs
) -> Diagnosis | None:
    """Diagnose heights in another unit than those of other sensors.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number, name : int, str
        The sensor.
    agreement, pairs : Agreement, Pairs
        Its agreement with the others.
    """
    chosen = pairs.select(
        np.isin(np.arange(pairs.size), agreement.matched) & (pairs.source != RECORDING)
    )
    own = comparison.tested(number).height_m[chosen.plot]
    _, _, other = ecef_to_geodetic(chosen.position_m)
    known = np.isfinite(own) & (other > 1000.0)
    if np.count_nonzero(known) < TESTED_MIN:
        return None
    ratio = float(np.median(own[known] / other[known]))
    for unit, factor in _UNITS.items():
        if abs(ratio / factor - 1.0) <= _WITHIN:
            return Diagnosis(
                name,
                "height_unit",
                f"{name}: its heights are probably in {unit}: they are {ratio:.3g} times the "
                "heights that other sensors report for the same aircraft; convert them to metres",
            )
    return None


def heights_off(
    comparison: Comparison, number: int, pairs: Pairs, radars: Collection[int]
) -> float:
    """Return by how much the heights of a radar differ from those of most other radars.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The radar.
    pairs : Pairs
        Positions by others of the aircraft of its tested plots, one by each sensor.
    radars : collection of int
        The other radars, which report pressure heights as it does.

    Returns
    -------
    float
        Its heights minus those of the others, m; NaN where they agree or are not known.
    """
    own = comparison.tested(number).height_m
    _, _, other = ecef_to_geodetic(pairs.position_m)
    # The height of a plot without one is assumed.
    known = np.isfinite(own[pairs.plot]) & (np.abs(other - HEIGHT_ASSUMED_M) > _ASSUMED_WITHIN_M)
    offsets = []
    for source in radars:
        rows = known & (pairs.source == source)
        if np.count_nonzero(rows) < TESTED_MIN:
            continue
        apart_m = own[pairs.plot[rows]] - other[rows]
        middle_m = float(np.median(apart_m))
        spread_m = float(np.median(np.abs(apart_m - middle_m)))
        offsets.append(middle_m if spread_m <= _SPREAD_MAX_M else 0.0)
    wrong = [one for one in offsets if abs(one) >= OFF_MIN_M]
    if 2 * len(wrong) <= len(offsets):
        return np.nan
    middle_m = float(np.median(wrong))
    return middle_m if all(abs(one - middle_m) <= _SPREAD_MAX_M for one in wrong) else np.nan


def check_height_offset(
    comparison: Comparison, name: str, number: int, pairs: Pairs, radars: Collection[int]
) -> Diagnosis | None:
    """Diagnose heights that differ from those of most other radars by one value.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    name, number : str, int
        The radar.
    pairs, radars : Pairs, collection of int
        As in `heights_off`.
    """
    off_m = heights_off(comparison, number, pairs, radars)
    if np.isnan(off_m):
        return None
    height_m = comparison.site(number)[2]
    hint = "corrected for pressure (QNH)?"
    if abs(off_m + height_m) <= _SPREAD_MAX_M:
        hint = "heights above its site?"
    sense = "above" if off_m > 0.0 else "below"
    return Diagnosis(
        name,
        "height_offset",
        f"{name}: its heights probably have an offset: they are {abs(off_m):.0f} m {sense} the "
        f"heights that most other radars report for the same aircraft ({hint}); write the "
        "pressure altitudes (Mode C)",
    )


def of_heights(name: str, height_m: float, wrong: Registration) -> list[Diagnosis]:
    """Return what depends on heights of the errors of a radar, with its configured height, m."""
    residual = (
        f"the median distance of its plots from the positions measured by other sensors is "
        f"{wrong.after_m:.0f} m ({wrong.before_m:.0f} m as recorded)"
    )
    if wrong.ground_ranges:
        return [
            Diagnosis(
                name,
                "ground_ranges",
                f"{name}: its ranges are probably ground ranges, not slant ranges: with this "
                f"error corrected, {residual}; write the slant ranges as measured",
            )
        ]
    if wrong.height_in_feet:
        return [
            Diagnosis(
                name,
                "site_height",
                f"{name}: height_m of its site is probably in feet: it is {height_m:g} in the "
                f"sensors file, but with {height_m * FOOT_M:.0f} m {residual}; convert it to "
                "metres",
            )
        ]
    if np.isfinite(wrong.height_m):
        in_kilometres = 0.75 <= 1e3 * height_m / wrong.height_m <= 1.25
        why = "in kilometres" if in_kilometres else "wrong"
        return [
            Diagnosis(
                name,
                HEIGHT_CODE,
                f"{name}: height_m of its site is probably {why}: it is {height_m:g} in the "
                f"sensors file, but with about {wrong.height_m:.0f} m {residual}; correct it in "
                "the sensors file",
            )
        ]
    return []
