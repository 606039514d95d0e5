"""Configured sigmas against the noise that the run, or the plots themselves, show."""

from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis, Severity
from multiradar.diagnosis.plots import NORMAL_SPREAD, Booleans, Floats, Integers, Plots
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.geodesic import EARTH_RADIUS_M

#: Ratio of measured to configured noise above which a sigma is too small, and its inverse below
#: which it is too large: the estimate adapts slowly downwards, and 1/100 reads as 1/10 at first.
NOISE_FACTOR, NOISE_LOW_FACTOR = 5.0, 4.0
#: ... and from which on a warning suffices. In 33 simulated scenarios with the right sigmas the
#: ratios were 0.69 to 1.4; a sigma three times too small or too large gave 1.8 to 3.4 or 0.33 to
#: 0.53.
NOISE_WARNING = 1.75
#: A sigma that is too small raises the measured noise of the other sensors: smaller ratios than
#: this fraction of the largest are its effect.
_NOISE_OF_OTHERS = 0.5
#: A sigma is too small from this ratio of the scatter of plots about the path of their aircraft to
#: it on: then the motion of the tracks explains all of the noise, which cannot be measured. The
#: scatter is that of plots between two others: largest ratio of the two times, longest, s, and
#: least number.
SCATTER_FACTOR, _APART_FACTOR, _APART_MAX_S, _SCATTER_MIN = 8.0, 1.5, 15.0, 200
#: Of three successive plots of noise alone 73 % have deviations to opposite sides: turns have less.
_OPPOSITE_MIN = 0.6
#: Aircraft have moved by more than this in two intervals, in sigmas. The scatter across the path is
#: less than the error of positions, so that this ratio to the sigma is sure.
_FLOWN_SIGMAS, _POSITION_WARNING = 10.0, 2.5
#: The settings of noise.
SIGMAS, _UNITS = ("range_sigma_m", "azimuth_sigma_deg"), (" m", "°")


def check_noise(
    evidence: Evidence, name: str, scatter: tuple[float, float], *, causes: bool
) -> Diagnosis | None:
    """Diagnose configured sigmas that are far from the measured noise.

    The noise that innovations show contains the manoeuvres of aircraft, and that of the scatter of
    plots about smooth paths does not: the smaller one counts.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The sensor.
    scatter : (float, float)
        Result of `track_scatter`, m and degrees; NaN where unknown.
    causes : bool
        Whether another error was found: it may explain noise above its sigma.
    """
    found = _by_noise(evidence, name, causes=causes, scatter=scatter)
    return _of_sigmas(name, [one for one in found if one])


def check_spread(evidence: Evidence, name: str, spread: tuple[float, float]) -> Diagnosis | None:
    """Diagnose a sigma much larger than the scatter about the positions measured by other sensors.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The radar.
    spread : (float, float)
        Standard deviation of the difference in range, m, and azimuth, rad; not less than the noise.
    """
    scatters = spread[0], float(np.degrees(spread[1]))
    found: list[_WrongSigma | None] = []
    for setting, sigma, scatter, unit in zip(
        SIGMAS, sigmas(evidence, name), scatters, _UNITS, strict=True
    ):
        amount = f"{two_digits(scatter)}{unit}"
        words = f"its plots scatter by {amount} about the positions measured by other sensors"
        low = scatter < sigma / NOISE_FACTOR
        found.append(_WrongSigma(setting, "large", sigma, words, "error") if low else None)
    if found == [None, None]:
        return None
    # The scatter includes the noise of the others; the measured noise may show the other sigma.
    by_noise = _by_noise(evidence, name, causes=True)
    return _of_sigmas(name, [one for one in map(_either, found, by_noise) if one])


def check_scatter(
    evidence: Evidence, name: str, plots: Plots, aircraft: Integers
) -> Diagnosis | None:
    """Diagnose sigmas far below the scatter of plots about the path of their aircraft.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The radar.
    plots : Plots
        Its plots.
    aircraft : (n,) int64
        Aircraft of each; −1 where unknown.
    """
    order = np.lexsort((plots.time_s, aircraft))
    order = order[aircraft[order] >= 0]
    middle, weight = _between(plots.time_s[order], aircraft[order])
    if len(middle) < _SCATTER_MIN:
        return None
    azimuth = np.radians(plots.azimuth_deg[order])
    range_m = plots.range_m[order]
    place = np.column_stack([range_m * np.sin(azimuth), range_m * np.cos(azimuth)])
    later = weight[:, None]
    apart = place[middle] - (1.0 - later) * place[middle - 1] - later * place[middle + 1]
    outward = place[middle] / np.linalg.norm(place[middle], axis=1)[:, None]
    along = np.sum(apart * outward, axis=1)
    across = apart[:, 0] * outward[:, 1] - apart[:, 1] * outward[:, 0]
    # The plots of a turn are all on one side of the chord; noise alternates.
    follows = np.diff(middle) == 1
    turns = [_turns(one, follows) for one in (along, across)]
    of_three = np.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2)
    scatters = (
        NORMAL_SPREAD * float(np.median(np.abs(along) / of_three)),
        float(np.degrees(NORMAL_SPREAD * np.median(np.abs(across) / of_three / range_m[middle]))),
    )
    found = [
        _WrongSigma(
            setting, "small", sigma,
            f"its plots scatter by {two_digits(scatter)}{unit} about the path of their aircraft",
            "error",
        )
        for setting, sigma, scatter, unit, is_turn in zip(
            SIGMAS, sigmas(evidence, name), scatters, _UNITS, turns, strict=True
        )
        if scatter >= SCATTER_FACTOR * sigma and not is_turn
    ]  # fmt: skip
    return _of_sigmas(name, found)


# Rows soon after and before others of their aircraft, in order of aircraft and time, and
# the weight of the later one on the line between these two.
def _between(time_s: Floats, of: Integers) -> tuple[Integers, Floats]:
    before_s, after_s = np.diff(time_s)[:-1], np.diff(time_s)[1:]
    shorter, longer = np.minimum(before_s, after_s), np.maximum(before_s, after_s)
    chosen = (of[2:] == of[:-2]) & (shorter > 0.0) & (longer <= _APART_FACTOR * shorter)
    middle = np.flatnonzero(chosen & (longer <= _APART_MAX_S)) + 1
    return middle, before_s[middle - 1] / (time_s[middle + 1] - time_s[middle - 1])


# Whether the deviations of successive plots from the chord are on one side as often as on both.
def _turns(apart: Floats, follows: Booleans) -> bool:
    opposite = (apart[1:] * apart[:-1] < 0.0)[follows]
    return len(opposite) > 0 and float(np.mean(opposite)) < _OPPOSITE_MIN


def check_position_scatter(
    name: str, plots: Plots, aircraft: Integers, sigma_m: float
) -> Diagnosis | None:
    """Diagnose a position_sigma_m far below the scatter of positions across the path of aircraft.

    Errors along the path may be those of times, and slow errors do not show.

    Parameters
    ----------
    name : str
        A sensor that reports positions.
    plots : Plots
        Its reports.
    aircraft : (n,) int64
        Aircraft of each; −1 where unknown.
    sigma_m : float
        The configured standard deviation, m.
    """
    scatter_m = _scatter_across(plots, aircraft, _FLOWN_SIGMAS * sigma_m)
    if not scatter_m >= _POSITION_WARNING * sigma_m:
        return None
    severity: Severity = "error" if scatter_m >= NOISE_FACTOR * sigma_m else "warning"
    words = f"its positions scatter by {two_digits(scatter_m)} m across the path of their aircraft"
    wrong = _WrongSigma("position_sigma_m", "small", sigma_m, words, severity)
    return _of_sigmas(name, [wrong])


# Standard deviation of positions about the line between those before and after, m; NaN where there
# are too few, or where aircraft turn.
def _scatter_across(plots: Plots, aircraft: Integers, flown_min_m: float) -> float:
    known = (aircraft >= 0) & np.isfinite(plots.latitude_deg) & np.isfinite(plots.longitude_deg)
    order = np.lexsort((plots.time_s, aircraft))
    order = order[known[order]]
    middle, weight = _between(plots.time_s[order], aircraft[order])
    latitude = np.radians(plots.latitude_deg[order])
    longitude = np.unwrap(np.radians(plots.longitude_deg[order]))
    east = EARTH_RADIUS_M * longitude * np.cos(np.median(latitude)) if len(order) else longitude
    place = np.column_stack([east, EARTH_RADIUS_M * latitude])
    flown = place[middle + 1] - place[middle - 1]
    length = np.linalg.norm(flown, axis=1)
    moving = length > flown_min_m
    middle, weight, flown, length = middle[moving], weight[moving], flown[moving], length[moving]
    if len(middle) < _SCATTER_MIN:
        return np.nan
    apart = place[middle] - place[middle - 1] - weight[:, None] * flown
    across = (apart[:, 0] * flown[:, 1] - apart[:, 1] * flown[:, 0]) / length
    if _turns(across, np.diff(middle) == 1):
        return np.nan
    of_three = np.sqrt(1.0 + weight**2 + (1.0 - weight) ** 2)
    return NORMAL_SPREAD * float(np.median(np.abs(across) / of_three))


def check_position_spread(
    sensors: SensorTable, number: int, spread: tuple[float, float]
) -> Diagnosis | None:
    """As `check_spread`, of a sensor that reports positions: spread east and north, m."""
    name, sigma, scatter = sensors.ids[number], float(sensors.position_sigma_m[number]), max(spread)
    if not scatter < sigma / NOISE_FACTOR:
        return None
    words = f"its positions scatter by {two_digits(scatter)} m about those of other sensors"
    return _of_sigmas(name, [_WrongSigma("position_sigma_m", "large", sigma, words, "error")])


class _WrongSigma(NamedTuple):
    setting: str
    sense: str
    sigma: float
    found: str
    severity: Severity


def _either(first: _WrongSigma | None, second: _WrongSigma | None) -> _WrongSigma | None:
    return first or second


# Sigmas that differ from the measured noise.
def _by_noise(
    evidence: Evidence, name: str, *, causes: bool, scatter: tuple[float, float] = (np.nan, np.nan)
) -> list[_WrongSigma | None]:
    ratios = evidence.noise.get(name, (np.nan, np.nan))
    largest = np.nanmax([1.0, *(ratio for both in evidence.noise.values() for ratio in both)])
    high = max(NOISE_WARNING, _NOISE_OF_OTHERS * largest)
    found: list[_WrongSigma | None] = []
    for setting, sigma, by_innovations, apart in zip(
        SIGMAS, sigmas(evidence, name), ratios, scatter, strict=True
    ):
        # Manoeuvres leave the noise at 1.
        ratio = by_innovations
        if ratio > 1.0:
            ratio = max(float(np.fmin(ratio, apart / sigma)), 1.0)
            if np.isnan(apart) and ratio <= NOISE_FACTOR:
                ratio = np.nan
        elif ratio < 1.0:
            # Innovations of few plots of a radar among many others may be smaller than its noise.
            ratio = min(float(np.fmax(ratio, apart / sigma)), 1.0)
        wrong = ratio < 1.0 / NOISE_WARNING or (ratio > high and not causes)
        sense = "large" if ratio < 1.0 else "small"
        far = not 1.0 / NOISE_LOW_FACTOR <= ratio <= NOISE_FACTOR
        words = f"the measured noise is {two_digits(ratio)} times as large"
        severity: Severity = "error" if far else "warning"
        found.append(_WrongSigma(setting, sense, sigma, words, severity) if wrong else None)
    return found


def sigmas(evidence: Evidence, name: str) -> tuple[float, float]:
    """Return the sigmas of range, m, and azimuth, degrees, that are configured."""
    number, sensors = evidence.number(name), evidence.sensors
    return float(sensors.range_sigma_m[number]), float(
        np.degrees(sensors.azimuth_sigma_rad[number])
    )


def _of_sigmas(name: str, wrong: list[_WrongSigma]) -> Diagnosis | None:
    if not wrong:
        return None
    first, last = wrong[0], wrong[-1]
    if first is last:
        head, them = f"{first.setting} is probably too {first.sense}", "it"
    elif first.sense == last.sense:
        head = f"{first.setting} and {last.setting} are probably too {first.sense}"
        them = "them"
    else:
        head = f"{first.setting} is probably too {first.sense} and {last.setting} too {last.sense}"
        them = "them"
    text = f"it is {first.sigma:g} in the sensors file, but {first.found}"
    if first is not last:
        text = (
            f"{first.setting} is {first.sigma:g} in the sensors file, but {first.found}; "
            f"{last.setting} is {last.sigma:g}, but {last.found}"
        )
    severity: Severity = "error" if any(one.severity == "error" for one in wrong) else "warning"
    return Diagnosis(
        name, "noise", f"{name}: {head}: {text}; correct {them} in the sensors file", severity
    )


def two_digits(ratio: float) -> str:
    """Return a positive number with two digits, whole numbers with all."""
    return f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.2g}"
