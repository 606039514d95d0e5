"""Values that were rounded or saturated before they were recorded."""

from collections.abc import Mapping

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.noise import two_digits
from multiradar.diagnosis.plots import Floats, Plots
from multiradar.geodesy.geodesic import EARTH_RADIUS_M
from multiradar_schemas.sensors.sensor import Sensor

#: Of reported positions, where it is not configured, m.
POSITION_SIGMA_M = float(Sensor.model_fields["position_sigma_m"].default)
#: Plots that show a step.
_PLOTS_MIN = 100
#: Tolerance of a step as a fraction of it, and of whole numbers.
_WITHIN, _WHOLE_WITHIN = 0.02, 1.1
#: Times that a step is estimated from all values, the first one from the least difference.
_REFINED = 3
#: Values that a step needs, and steps that fewer values than usual may have, degrees or m.
_VALUES_MIN, _DECIMALS = 5, (0.1, 1.0, 1000.0, 10_000.0)
#: Fraction of the successive steps of an aircraft that rounding makes unequal, at least.
_BENDS_MIN = 0.1
#: Significant digits of values that a spreadsheet rounded, and the tolerance of whole numbers.
_DIGITS, _DIGITS_WITHIN = (2, 3, 4), 1e-6
#: Length of a degree of latitude, m.
_DEGREE_M = EARTH_RADIUS_M * float(np.radians(1.0))
#: The largest value is a limit if this fraction of the plots has it, so many times more than each
#: other value, in directions, degrees, that one transponder at a fixed place does not have.
_LIMIT_MIN, _LIMIT_RATIO, _LIMIT_DIRECTIONS_DEG = 0.02, 8.0, 5.0
#: Ranges start again from 0 where aircraft jump from one end of them to the other, which are so far
#: away, m and m/s: number of jumps and of aircraft, at least, and fraction of the long jumps.
_END_M, _END_MPS, _WRAPS_MIN, _WRAPPED_AIRCRAFT_MIN, _WRAPS_SHARE = 2000.0, 500.0, 5, 3, 0.9
#: Longest time between two plots of a jump, s.
_WRAP_MAX_S = 30.0


def check_rounded(
    name: str, plots: Plots, sigmas: Mapping[str, float], *, configured: bool = True
) -> Diagnosis | None:
    """Diagnose values rounded so much that this is their largest error.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its plots.
    sigmas : mapping
        Standard deviation by column: `range_m` and `latitude_deg`, m, `azimuth_deg`, degrees.
    configured : bool
        Whether it is that of the sensors file; else that of sensors of its kind.
    """
    if plots.size < _PLOTS_MIN:
        return None
    of = "in the sensors file" if configured else "of such reports"
    if "range_m" in sigmas and (figures := _figures(plots.range_m, sigmas["range_m"])):
        digits, error_m = figures
        return Diagnosis(
            name,
            "resolution",
            f"{name}: its range_m is probably rounded to {digits} significant digits (in a "
            f"spreadsheet?), which adds an error of {two_digits(error_m)} m (1 sigma), but the "
            f"sigma {of} is {sigmas['range_m']:g} m; write the values as measured",
        )
    for column, sigma in sigmas.items():
        values: Floats = getattr(plots, column)
        known = np.unique(values[np.isfinite(values)])
        if len(known) < _VALUES_MIN:
            continue
        size = _DEGREE_M if column == "latitude_deg" else 1.0
        # The standard deviation of a rounding error is the step over √12.
        step = step_of(known, np.sqrt(12.0) * sigma / size)
        # Few values have a common divisor by chance, but not one of decimals.
        if len(known) < TESTED_MIN and not np.isclose(step, _DECIMALS).any():
            continue
        if not step or _is_regular(plots, values, step):
            continue
        error = step / np.sqrt(12.0) * size
        unit = "°" if column == "azimuth_deg" else " m"
        length = f"{step:.4g}{unit if column == 'range_m' else '°'}"
        return Diagnosis(
            name,
            "resolution",
            f"{name}: its {column} is probably rounded: all values are multiples of {length}, "
            f"which adds an error of {two_digits(error)}{unit} (1 sigma), but the sigma {of} is "
            f"{sigma:g}{unit}; write the values as measured",
        )
    return None


# The significant digits of all values and their rounding error, if it exceeds sigma: the steps grow
# with the values, so not all are multiples of the largest one.
def _figures(values: Floats, sigma: float) -> tuple[int, float] | None:
    known = values[np.isfinite(values) & (values > 0.0)]
    if len(known) < _PLOTS_MIN:
        return None
    power = np.floor(np.log10(known))
    for digits in _DIGITS:
        step = 10.0 ** (power - digits + 1)
        if _are_whole(known / step) and not _are_whole(known / step.max()):
            error = float(np.sqrt(np.mean(np.square(step)) / 12.0))
            return (digits, error) if error > sigma else None
    return None


def _are_whole(numbers: Floats) -> bool:
    return bool((np.abs(numbers - np.round(numbers)) <= _DIGITS_WITHIN).all())


# Whether aircraft move by equal steps, as at a constant speed, which rounding makes unequal.
def _is_regular(plots: Plots, values: Floats, step: float) -> bool:
    names = aircraft_of(plots)
    order = np.lexsort((plots.time_s, names))
    # An aircraft may stay at a coarse value for many plots.
    moves = np.abs(np.diff(values[order])) > 0.5 * step
    alike = (names[order][2:] == names[order][:-2]) & (moves[1:] | moves[:-1])
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


def check_wrapped(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose ranges that start again from 0 beyond some range, as counters of few bits do.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    """
    aircraft = aircraft_of(plots)
    order = np.lexsort((plots.time_s, aircraft))
    order = order[(aircraft[order] >= 0) & np.isfinite(plots.range_m[order])]
    if len(order) < TESTED_MIN:
        return None
    of, time_s, ranges = aircraft[order], plots.time_s[order], plots.range_m[order]
    apart_s, end_m = np.diff(time_s), float(ranges.max())
    long_ = (of[1:] == of[:-1]) & (apart_s <= _WRAP_MAX_S) & (np.abs(np.diff(ranges)) > end_m / 2.0)
    near_m = _END_M + _END_MPS * apart_s
    low, high = np.minimum(ranges[1:], ranges[:-1]), np.maximum(ranges[1:], ranges[:-1])
    wraps = long_ & (low <= near_m) & (high >= end_m - near_m) & (near_m < end_m / 3.0)
    count = np.count_nonzero(wraps)
    if count < max(_WRAPS_MIN, _WRAPS_SHARE * np.count_nonzero(long_)):
        return None
    if len(np.unique(of[1:][wraps])) < _WRAPPED_AIRCRAFT_MIN:
        return None
    return Diagnosis(
        name,
        "range_wrapped",
        f"{name}: its ranges probably start again from 0 beyond {end_m:.0f} m (too few bits in a "
        f"recorder?): {count} times, the range of an aircraft jumps from one end to the other, and "
        "none is farther away; write the ranges as measured",
    )
