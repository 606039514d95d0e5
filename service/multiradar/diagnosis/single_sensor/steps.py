"""Values that were rounded or saturated before they were recorded."""

from collections.abc import Mapping

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.noise import two_digits
from multiradar.diagnosis.plots import Floats, Plots
from multiradar.geodesy.geodesic import EARTH_RADIUS_M

#: Plots that show a step.
_PLOTS_MIN = 100
#: Tolerance of a step as a fraction of it, and of whole numbers.
_WITHIN, _WHOLE_WITHIN = 0.02, 1.1
#: Times that a step is estimated from all values, the first one from the least difference.
_REFINED = 3
#: Fraction of the successive steps of an aircraft that rounding makes unequal, at least.
_BENDS_MIN = 0.1
#: Length of a degree of latitude, m.
_DEGREE_M = EARTH_RADIUS_M * float(np.radians(1.0))
#: The largest value is a limit if this fraction of the plots has it, so many times more than each
#: other value, in directions, degrees, that one transponder at a fixed place does not have.
_LIMIT_MIN, _LIMIT_RATIO, _LIMIT_DIRECTIONS_DEG = 0.02, 8.0, 5.0


def check_rounded(name: str, plots: Plots, sigmas: Mapping[str, float]) -> Diagnosis | None:
    """Diagnose values rounded so much that this is their largest error.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    sigmas : mapping
        Configured standard deviation by column: `range_m` and `latitude_deg`, m, `azimuth_deg`,
        degrees.
    """
    if plots.size < _PLOTS_MIN:
        return None
    for column, sigma in sigmas.items():
        values: Floats = getattr(plots, column)
        known = np.unique(values[np.isfinite(values)])
        if len(known) < TESTED_MIN:
            continue
        size = _DEGREE_M if column == "latitude_deg" else 1.0
        # The standard deviation of a rounding error is the step over √12.
        step = step_of(known, np.sqrt(12.0) * sigma / size)
        if not step or _is_regular(plots, values, step):
            continue
        error = step / np.sqrt(12.0) * size
        unit = "°" if column == "azimuth_deg" else " m"
        length = f"{step:.4g}{unit if column == 'range_m' else '°'}"
        return Diagnosis(
            name,
            "resolution",
            f"{name}: its {column} is probably rounded: all values are multiples of {length}, "
            f"which adds an error of {two_digits(error)}{unit} (1 sigma), but the sigma in the "
            f"sensors file is {sigma:g}{unit}; write the values as measured",
        )
    return None


# Whether aircraft move by equal steps, as at a constant speed, which rounding makes unequal.
def _is_regular(plots: Plots, values: Floats, step: float) -> bool:
    names = aircraft_of(plots)
    order = np.lexsort((plots.time_s, names))
    alike = names[order][2:] == names[order][:-2]
    bends = np.abs(np.diff(values[order], 2))[alike] > 0.5 * step
    return len(bends) < TESTED_MIN or float(np.mean(bends)) < _BENDS_MIN


def step_of(values: Floats, least: float) -> float:
    """Return the step of distinct values, in order, of which all are multiples but for an offset.

    Parameters
    ----------
    values : (n,) float64
        The values.
    least : float
        Smaller steps do not count.

    Returns
    -------
    float
        0 without such a step.
    """
    apart = np.diff(values)
    if len(apart) == 0 or not apart.min() > 0.9 * least:
        return 0.0
    whole = _WHOLE_WITHIN if (values == np.round(values)).all() else 0.0
    step = float(apart.min())
    for _ in range(_REFINED):
        number = np.cumsum(np.round(apart / step))
        step = float((values[-1] - values[0]) / number[-1])
    off = np.abs(values[1:] - values[0] - step * number)
    return step if off.max() <= _WITHIN * step + whole and step > least else 0.0


def check_limits(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose ranges that end at one value, which many plots have.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    """
    known = np.isfinite(plots.range_m)
    ranges, azimuths_deg = plots.range_m[known], plots.azimuth_deg[known]
    if len(ranges) < TESTED_MIN:
        return None
    _, counts = np.unique(ranges, return_counts=True)
    count = counts[-1]
    if count < max(TESTED_MIN, _LIMIT_MIN * len(ranges)) or len(counts) < TESTED_MIN:
        return None
    if count < _LIMIT_RATIO * np.max(counts[:-1], initial=1):
        return None
    turned = np.exp(1j * np.radians(azimuths_deg[ranges == ranges.max()]))
    if not np.abs(turned.mean()) < np.cos(np.radians(_LIMIT_DIRECTIONS_DEG)):
        return None
    return Diagnosis(
        name,
        "range_limit",
        f"{name}: its ranges are probably limited to {ranges.max():g} m: {count / len(ranges):.0%} "
        "of its plots have this range, in several directions, and none is farther away (too few "
        "bits in a recorder?); write the ranges as measured, or remove these plots",
    )
