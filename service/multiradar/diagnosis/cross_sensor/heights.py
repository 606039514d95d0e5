"""Heights of a sensor against those reported by others for the same aircraft."""

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs
from multiradar.diagnosis.cross_sensor.registration import Registration
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import HEIGHT_ASSUMED_M, Booleans, Floats
from multiradar.geodesy.wgs84 import ecef_to_geodetic
from multiradar_schemas.measurements.units import FOOT_M

#: The unit of heights that are too low where those of another sensor are in feet.
CONVERTED_TWICE = "metres converted once more as if they were feet"
#: What a height of 1 m is in other units, with their names.
_UNITS = {
    "feet": 1.0 / FOOT_M,
    "flight levels": 1.0 / 30.48,
    "units of 25 ft": 4.0 / 30.48,
    "tens of metres": 0.1,
    "hundreds of metres": 0.01,
    "kilometres": 0.001,
    CONVERTED_TWICE: FOOT_M,
}
#: ... within this, as a fraction; the fraction of the heights that have the ratio, at least.
_WITHIN, _EQUAL_MIN = 0.05, 0.5
#: Heights this near to the assumed one may not have been reported, m.
_ASSUMED_WITHIN_M = 20.0
#: Code of a wrong height of a site.
HEIGHT_CODE = "site_height_off"


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
    known = np.isfinite(own) & (other > 1000.0) & are_reported(other)
    if np.count_nonzero(known) < TESTED_MIN:
        return None
    ratios = own[known] / other[known]
    ratio = float(np.median(ratios))
    unit = unit_of(ratio)
    # Heights of other aircraft have any ratio.
    if not unit or np.mean(np.abs(ratios / ratio - 1.0) <= _WITHIN) < _EQUAL_MIN:
        return None
    return Diagnosis(
        name,
        "height_unit",
        f"{name}: its heights are probably in {unit}: they are {ratio:.3g} times the heights that "
        "other sensors report for the same aircraft; convert them to metres",
    )


def are_reported(height_m: Floats) -> Booleans:
    """Return which heights of positions are not those assumed for aircraft that report none."""
    return np.asarray(np.abs(height_m - HEIGHT_ASSUMED_M) > _ASSUMED_WITHIN_M)


def unit_of(ratio: float) -> str:
    """Return the unit in which heights are so many times those in metres; empty for none."""
    return next((one for one, by in _UNITS.items() if abs(ratio / by - 1.0) <= _WITHIN), "")


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
