"""Configured range and azimuth offsets, against those estimated by the run or from others."""

from collections.abc import Collection, Sequence

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import (
    AZIMUTH_ALIKE_RAD,
    RANGE_OFFSET_MAX_M,
    polar_agreement,
    seen_from,
    wrapped,
)
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, Comparison, configured_bias
from multiradar.diagnosis.cross_sensor.hypotheses import as_given
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named
from multiradar.diagnosis.cross_sensor.registration import SIGMAS, Registration
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import NORMAL_SPREAD, Floats, Integers, Site
from multiradar.diagnosis.times import utc
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_NAMES,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)

#: An offset is wrong from this difference on, m and rad: in correct recordings the fit was off by
#: 0.1 km and 0.02° at most, also with drifting offsets.
DIFFERENT = (150.0, float(np.radians(0.1)))
#: ... and from this number of prior standard deviations on: 4 occur by chance.
PRIOR_SIGMAS = 5.0
#: No radar has offsets beyond these, m and rad: a larger estimate has another cause.
POSSIBLE = (5000.0, float(np.radians(5.0)))
OFFSET_CODE = "bias"
#: Azimuth offsets of all radars from this value on, and within it of each other, have one cause,
#: rad: two prior standard deviations.
COMMON_AZIMUTH = float(np.radians(1.0))
#: An offset is unusual from this number of prior standard deviations on.
LARGE_SIGMAS = 2.0
#: Tracks with plots of other sensors that show it, at least.
_LARGE_TRACKS_MIN = 3
#: Jumps of azimuth from this value on, rad, are reported: more than drifting offsets change. The
#: first and the last part of the plots show the offsets, least number of plots of each, and largest
#: scatter about them in proportion to the jump: a drift scatters more.
JUMP_MIN, _JUMP_PART, _JUMP_PLOTS_MIN, _JUMP_SCATTER_MAX = float(np.radians(0.8)), 0.2, 20, 0.25
#: The offsets within this time of the jump, s, of so many plots at least, are those of the whole
#: parts within this fraction.
_JUMP_NEAR_S, _JUMP_BESIDE_MIN, _JUMP_WITHIN = 120.0, 5, 0.3
_KINDS = (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET)
#: ... and from these values on, m and rad.
_FRAME = {PARAMETER_FRAME_EAST: "east", PARAMETER_FRAME_NORTH: "north"}
LARGE = dict(zip(_KINDS, (1000.0, COMMON_AZIMUTH), strict=True)) | dict.fromkeys(_FRAME, 200.0)
_LARGE_CODES = dict(zip(_KINDS, ("range_offset", "azimuth_offset"), strict=True))
_LARGE_CODES |= dict.fromkeys(_FRAME, "positions_displaced")


def check_offsets(
    sensors: SensorTable, number: int, found: Registration, others: Sequence[str]
) -> Diagnosis | None:
    """Diagnose an offset fixed at a wrong value, or whose prior excludes the right one.

    Parameters
    ----------
    sensors : SensorTable
        As configured.
    number : int
        The radar.
    found : Registration
        Its offsets estimated from the others.
    others : sequence of str
        Names of the others.
    """
    if _has_gain(sensors, number):
        # The fit has no gain: it would appear as a range offset.
        return None
    for index, kind in enumerate(_KINDS):
        value, sigma = found.offset[index], found.offset_sigma[index]
        configured, prior_sigma = configured_bias(sensors, number, kind)
        apart = abs(value - configured)
        if abs(value) <= POSSIBLE[index] and apart >= max(
            DIFFERENT[index], SIGMAS * sigma, PRIOR_SIGMAS * prior_sigma
        ):
            numbers = (configured, prior_sigma, value, sigma)
            return _wrong(sensors.ids[number], kind, numbers, others)
    return None


def check_common_azimuth(evidence: Evidence) -> list[Diagnosis]:
    """Diagnose azimuths of all radars that the run found off by nearly the same angle.

    Radars at different sites show it without any reference: the angle displaces the aircraft of
    one against those of the other by the angle times the distance of the sites.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.

    Returns
    -------
    list of Diagnosis
        One for each radar.
    """
    sensors = evidence.sensors
    off = {}
    for (number, kind), (estimate, sigma) in evidence.biases.items():
        if kind == PARAMETER_AZIMUTH_OFFSET and sensors.kinds[number] == KIND_RADAR:
            apart = estimate - configured_bias(sensors, number, kind)[0]
            if SIGMAS * sigma <= COMMON_AZIMUTH:
                off[number] = apart
    angles = np.array(list(off.values()))
    sites = {(sensors.latitude_rad[one], sensors.longitude_rad[one]) for one in off}
    if len(sites) < 2 or np.abs(angles).min() < COMMON_AZIMUTH or np.ptp(angles) > COMMON_AZIMUTH:
        return []
    low, high = np.degrees([angles.min(), angles.max()])
    # A displaced site and an angle of both radars displace the aircraft alike.
    alone = ", or one of the two sites is wrong" if len(sites) == 2 else ""
    return [
        Diagnosis(
            sensors.ids[number],
            "azimuth_offset",
            f"{sensors.ids[number]}: its azimuths are probably off by {np.degrees(angle):+.1f}°, "
            f"like those of all radars ({low:+.1f} to {high:+.1f}°){alone}; check whether they "
            "refer to magnetic instead of true north",
        )
        for number, angle in sorted(off.items())
    ]


def check_azimuth_jumps(
    comparison: Comparison, numbers: Collection[int], names: Sequence[str]
) -> list[Diagnosis]:
    """Diagnose azimuths that are off by another angle from some time on.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    numbers : collection of int
        The sensors to compare with each other.
    names : sequence of str
        Names of all sensors.
    """
    radars = [one for one in numbers if comparison.is_radar(one)]
    jumps = {one: _azimuth_jump(comparison, one, numbers) for one in radars}
    jumped = {one: jump for one, jump in jumps.items() if jump is not None}
    sound = [one for one in numbers if one not in jumped]
    if len(jumped) > 1 and sound:
        # A radar beside one that jumped appears to jump in the opposite direction.
        again = {one: _azimuth_jump(comparison, one, sound) for one in jumped}
        jumped = {one: jump for one, jump in again.items() if jump is not None} or jumped
    return [
        Diagnosis(
            names[one],
            "azimuth_jump",
            f"{names[one]}: its azimuths probably jumped by {np.degrees(after - before):+.1f}° at "
            f"about {utc(at_s)} (antenna serviced or realigned?): against the positions measured "
            f"by other sensors they are off by {np.degrees(before):+.1f}° before and "
            f"{np.degrees(after):+.1f}° after; correct the azimuths on one side, or track each "
            "part separately",
        )
        for one, (at_s, before, after) in jumped.items()
    ]


# The time of a jump, s, and the offsets before and after it, rad.
def _azimuth_jump(
    comparison: Comparison, number: int, others: Collection[int]
) -> tuple[float, float, float] | None:
    plots, pairs = comparison.tested(number), comparison.pairs(number, others)
    measured, site = as_given(plots.range_m, plots.azimuth_deg), comparison.site(number)
    first, last = _first_and_last_offset(measured, site, pairs)
    jump = float(wrapped(np.array(last - first)))
    if not abs(jump) >= JUMP_MIN:
        return None
    by_range, azimuth = seen_from(site, pairs.position_m)
    near = np.abs(measured[0][pairs.plot] - by_range) <= RANGE_OFFSET_MAX_M
    apart = wrapped(measured[1][pairs.plot] - azimuth - first)[near]
    # Each plot may have several candidates.
    time_s, apart = _best_of_plots(plots.time_s, pairs.plot[near], apart, jump)
    if len(time_s) < AGREES_MIN * len(np.unique(pairs.plot)):
        return None
    row = _jump_row(apart, jump)
    at_s = float(np.mean(time_s[row - 1 : row + 1]))
    before, after = apart[:row], apart[row:]
    offsets = float(np.median(before)), float(np.median(after))
    scatter = np.concatenate([before - offsets[0], after - offsets[1]])
    beside = before[time_s[:row] > at_s - _JUMP_NEAR_S], after[time_s[row:] < at_s + _JUMP_NEAR_S]
    sharp = NORMAL_SPREAD * np.median(np.abs(scatter)) <= _JUMP_SCATTER_MAX * abs(jump)
    if not sharp or min(map(len, beside)) < _JUMP_BESIDE_MIN:
        return None
    at_jump = float(np.median(beside[1]) - np.median(beside[0]))
    if abs(at_jump - jump) > _JUMP_WITHIN * abs(jump):
        return None
    return at_s, first + offsets[0], first + offsets[1]


# The offsets of azimuth in the first and in the last part of the plots, rad; NaN where unknown.
def _first_and_last_offset(
    measured: tuple[Floats, Floats], site: Site, pairs: Pairs
) -> tuple[float, float]:
    compared = np.unique(pairs.plot)
    count = int(_JUMP_PART * len(compared))
    offsets = []
    for part in (compared[:count], compared[len(compared) - count :]):
        own = pairs.select(np.isin(pairs.plot, part))
        agreement = polar_agreement(measured, site, own, compared=count, any_rotation=True)
        sure = count >= _JUMP_PLOTS_MIN and agreement.share >= AGREES_MIN
        offsets.append(agreement.offset[1] if sure else np.nan)
    return offsets[0], offsets[1]


# Times and differences of the plots that are near 0 or near the jump, by time.
def _best_of_plots(
    time_s: Floats, plot: Integers, apart: Floats, jump: float
) -> tuple[Floats, Floats]:
    off = np.minimum(np.abs(apart), np.abs(apart - jump))
    order = np.lexsort((off, plot))
    order = order[off[order] <= max(AZIMUTH_ALIKE_RAD, 0.5 * abs(jump))]
    _, first = np.unique(plot[order], return_index=True)
    chosen = order[first]
    return time_s[plot[chosen]], apart[chosen]


# The first row after the jump: those before it are near 0, those after it near the jump.
def _jump_row(apart: Floats, jump: float) -> int:
    cost = np.abs(apart) - np.abs(apart - jump)
    row = int(np.argmin(np.concatenate([[0.0], np.cumsum(cost)])))
    return min(max(row, 1), len(apart) - 1)


def check_large_offsets(
    evidence: Evidence, comparison: Comparison | None = None
) -> list[Diagnosis]:
    """Warn of ranges, azimuths and positions that the run found off by more than sensors are.

    The tracks are corrected for such an offset; the sensor needs an adjustment, or its azimuths
    refer to magnetic north.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    comparison : Comparison, optional
        Its plots, which an offset must not contradict.

    Returns
    -------
    list of Diagnosis
        One for each sensor with such an offset.
    """
    sensors = evidence.sensors
    found: dict[str, Diagnosis] = {}
    for (number, kind), (estimate, sigma) in sorted(evidence.biases.items()):
        if kind not in LARGE:
            continue
        configured, prior_sigma = configured_bias(sensors, number, kind)
        apart = abs(estimate - configured)
        if not max(LARGE[kind], SIGMAS * sigma, LARGE_SIGMAS * prior_sigma) <= apart:
            continue
        if _common_tracks(evidence, number) < _LARGE_TRACKS_MIN:
            # Plots of another aircraft in one track are an offset, too.
            continue
        if comparison is not None and _agrees_without(comparison, number, kind, estimate):
            continue
        name = sensors.ids[number]
        found[name] = Diagnosis(
            name,
            _LARGE_CODES[kind],
            f"{name}: {_large(kind, estimate, configured, prior_sigma)}",
            "warning",
        )
    return list(found.values())


# Whether the plots of a radar agree with others without an offset that the run estimated: without
# identities, plots of other aircraft in its tracks may show any.
def _agrees_without(comparison: Comparison, number: int, kind: int, estimate: float) -> bool:
    if kind not in _KINDS or number not in comparison.numbers or not comparison.is_radar(number):
        return False
    pairs = comparison.pairs(number, comparison.numbers)
    if are_named(pairs):
        return False
    found = comparison.agreement(number, pairs)
    offset = found.offset[_KINDS.index(kind)]
    return found.share >= AGREES_MIN and abs(offset - estimate) > 0.5 * abs(estimate)


# Number of tracks with plots of a sensor and of others.
def _common_tracks(evidence: Evidence, number: int) -> int:
    tracked = evidence.tracked()
    own = tracked.measured.sensor == number
    return len(np.intersect1d(tracked.track_id[own], tracked.track_id[~own]))


def _large(kind: int, estimate: float, configured: float, prior_sigma: float) -> str:
    if kind == PARAMETER_RANGE_OFFSET:
        return (
            f"the estimated range offset is {estimate:+.0f} m, but {configured:+.0f} m ± "
            f"{prior_sigma:.0f} m is configured: the tracks are corrected for it; check the range "
            "calibration of the radar"
        )
    if kind in _FRAME:
        return (
            f"the estimated displacement of its positions is {estimate:+.0f} m {_FRAME[kind]}, but "
            f"{configured:+.0f} m ± {prior_sigma:.0f} m is configured: the tracks are corrected "
            "for it; check its reference point"
        )
    estimate_deg, configured_deg, sigma_deg = np.degrees([estimate, configured, prior_sigma])
    return (
        f"the estimated azimuth offset is {estimate_deg:+.2f}°, but {configured_deg:+.2f}° ± "
        f"{sigma_deg:.2f}° is configured: the tracks are corrected for it; check the north "
        "alignment of the radar (magnetic north?)"
    )


def _has_gain(sensors: SensorTable, number: int) -> bool:
    return configured_bias(sensors, number, PARAMETER_RANGE_GAIN) != (0.0, 0.0)


def _wrong(
    name: str, kind: int, numbers: tuple[float, float, float, float], others: Sequence[str]
) -> Diagnosis:
    setting = f"bias.{PARAMETER_NAMES[kind]}"
    if kind == PARAMETER_AZIMUTH_OFFSET:
        value, prior_sigma, seen, sigma = np.degrees(numbers).tolist()
        unit, form = "°", ".3f"
    else:
        value, prior_sigma, seen, sigma = numbers
        unit, form = " m", ".0f"
    how, remedy = (
        f"the fixed value {value:g}{unit} (estimate = false)",
        "correct prior, or remove estimate = false",
    )
    if prior_sigma:
        how = f"{value:g}{unit} with a prior_sigma of {prior_sigma:g}{unit}"
        remedy = "correct prior, or increase prior_sigma"
    alone = (
        f" (or {others[0]} is wrong; there is no third sensor to decide)"
        if len(others) == 1
        else ""
    )
    return Diagnosis(
        name,
        OFFSET_CODE,
        f"{name}: {setting} is probably wrong: the sensors file specifies {how}, but "
        f"{listed(others)} indicate {seen:{form}} ± {sigma:{form}}{unit}{alone}; {remedy}",
    )
