"""Heights of a radar in another unit, or filled where none was reported.

The steps in which transponders report show the unit; without them only heights that no aircraft
can have in metres do.
"""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import (
    CEILING_M,
    HIGH_MAX,
    aircraft_of,
    median_speed,
)
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.motion.height_steps import FLIGHT_LEVEL_M, HIGHEST_M, are_in
from multiradar.diagnosis.motion.speeds import are_flying, are_slow
from multiradar.diagnosis.plots import Floats, Integers, Plots, Site
from multiradar.geodesy.geodesic import EARTH_RADIUS_M
from multiradar_schemas.measurements.units import FOOT_M

#: Effective Earth radius for radio propagation: 4/3 of its radius (ITU-R P.834).
_RADIO_RADIUS_M = EARTH_RADIUS_M * 4.0 / 3.0
#: Fraction of plots that must be impossible in one unit and possible in the other.
MOST = 0.5
_LARGE_UNITS = {
    "units of 25 ft": FLIGHT_LEVEL_M / 4.0, "flight levels": FLIGHT_LEVEL_M,
    "tens of metres": 10.0, "hundreds of metres": 100.0, "kilometres": 1e3,
}  # fmt: skip
#: All traffic is below the first only near a radar, in a median range below the second, m.
_LOW_M, _LOW_SEEN_M = 600.0, 60e3
#: Below the first, 10 000 ft, aircraft fly at 250 kt at most; most of a traffic of so many aircraft
#: is not there with a median ground speed above the second, m/s.
_SLOW_M, _SLOW_MPS, _SLOW_AIRCRAFT_MIN = 3048.0, 190.0, 5
#: Tolerance of heights about a horizon, m: pressure heights.
_BELOW_M = 300.0
#: Fraction of the heights that are 0 by mistake.
_FILLED_MIN = 0.02


def check_height_unit(name: str, plots: Plots, site: Site) -> Diagnosis | None:
    """Diagnose heights in another unit.

    Military aircraft fly low and fast, and some aircraft higher than 16 km: where heights show no
    step, only those that are impossible in metres are in another unit.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    site : Site
        Its site, rad and m.
    """
    known = np.isfinite(plots.height_m)
    heights, ranges = plots.height_m[known], plots.range_m[known]
    if len(heights) < TESTED_MIN:
        return None
    if np.ptp(heights) > 0.0 and are_in(heights, 1.0):
        return None
    if (feet := of_feet(name, heights)) is not None:
        return feet
    lowest = _lowest_m(ranges, site)
    hidden = np.mean(heights < lowest - _BELOW_M)
    # A radar on a mountain sees low aircraft far away, but not only such.
    # Half of the plots of a radar at an airport are those of aircraft on and near the ground.
    low = heights.max() < _LOW_M and np.quantile(ranges, 0.75) > _LOW_SEEN_M
    far = known & (plots.range_m >= np.median(ranges))
    speed = _low_speed(plots.select(np.flatnonzero(far)), site)
    possible = hidden <= MOST / 2.0 and not low and not speed > _SLOW_MPS
    # Ships are at sea level, also beyond the horizon in ducts.
    if possible or are_slow(plots, site):
        return None
    if np.ptp(heights) == 0.0:
        return Diagnosis(
            name,
            "column_constant",
            f"{name}: its height_m is probably a placeholder: the value is {heights[0]:g} in all "
            "plots that have a height; leave height_m empty where no height was reported",
        )
    units = [
        unit
        for unit, metres in _LARGE_UNITS.items()
        if np.mean(heights * metres > CEILING_M) < 0.01
        and np.mean(heights * metres < lowest - _BELOW_M) <= 0.1 * hidden
        and (not speed > _SLOW_MPS or heights.max() * metres > _SLOW_M)
    ]
    stepped = [unit for unit in units if are_in(heights, _LARGE_UNITS[unit])]
    # Those by which the others are multiples, too: 0.25 flight levels are no whole numbers.
    units = stepped or (units if hidden > MOST / 2.0 else [])
    why = f"{hidden:.0%} of its plots are below the horizon of the radar"
    if speed > _SLOW_MPS:
        why = (
            f"most aircraft are below {_SLOW_M:.0f} m (FL100), with a median speed of {speed:.0f} "
            "m/s"
        )
    if low:
        why = f"none exceeds {heights.max():.0f} m"
    return _height(name, " or ".join(units), why) if units else None


def of_feet(name: str, heights: Floats) -> Diagnosis | None:
    """Diagnose heights in feet by the number that is too high in metres.

    Parameters
    ----------
    name : str
        The sensor.
    heights : (n,) float64
        Known heights, as recorded.
    """
    ceiling_m = CEILING_M if are_in(heights, FOOT_M) else HIGHEST_M
    above = np.mean(heights > ceiling_m)
    possible = np.mean(heights * FOOT_M > CEILING_M) < HIGH_MAX / 5.0
    if above <= HIGH_MAX or not possible or are_in(heights, 1.0):
        return None
    return _height(name, "feet", f"{above:.0%} of them exceed {ceiling_m:.0f} m")


def check_filled_heights(name: str, plots: Plots, site: Site | None) -> Diagnosis | None:
    """Diagnose heights of 0 where none was reported: of aircraft that fly.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.
    """
    zero = plots.height_m == 0.0
    known = np.isfinite(plots.height_m)
    if np.count_nonzero(zero) < TESTED_MIN or zero.sum() >= known.sum():
        return None
    wrong = zero & are_flying(plots, site)
    if site is not None:
        wrong |= zero & (_lowest_m(plots.range_m, site) > _BELOW_M)
    count = np.count_nonzero(wrong)
    if count < max(TESTED_MIN, _FILLED_MIN * known.sum()) or 2 * count < np.count_nonzero(zero):
        return None
    return Diagnosis(
        name,
        "column_constant",
        f"{name}: its height_m is probably 0 where no height was reported: {zero.sum()} of its "
        f"{known.sum()} heights are 0, most of aircraft that fly; leave height_m empty where no "
        "height was reported",
    )


# Lowest height in sight over a smooth Earth in standard atmosphere.
def _lowest_m(ranges: Floats, site: Site) -> Floats:
    to_horizon = np.sqrt(2.0 * max(site[2], 0.0) / _RADIO_RADIUS_M)
    return np.asarray(ranges**2 / (2.0 * _RADIO_RADIUS_M) - to_horizon * ranges)


# Median speed of aircraft lower than `_SLOW_M`, m/s; NaN unless most plots are of such.
def _low_speed(plots: Plots, site: Site) -> float:
    rows = np.flatnonzero(plots.height_m < _SLOW_M)
    paths = aircraft_of(plots)
    aircraft: Integers = np.unique(paths[rows][paths[rows] >= 0])
    if len(rows) <= (1.0 - HIGH_MAX) * plots.size or len(aircraft) < _SLOW_AIRCRAFT_MIN:
        return np.nan
    chosen = plots.select(rows)
    return median_speed(chosen, chosen.range_m, site, paths[rows])


def _height(name: str, unit: str, why: str) -> Diagnosis:
    return Diagnosis(
        name, "height_unit",
        f"{name}: its heights are probably in {unit}: {why}; convert them to metres",
    )  # fmt: skip
