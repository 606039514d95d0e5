"""Columns that are not filled as measured: one value for all, times or codes in another form."""

from collections.abc import Callable, Collection, Iterable

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import PERIOD_WITHIN, gaps_s, measured_period
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.losses import SAME_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import counted, listed
from multiradar.diagnosis.plots import CONSPICUITY, Floats, Plots
from multiradar.diagnosis.scans import coherence_at
from multiradar_schemas.documents.names import PER_SECOND

#: Times in the unit, per second, and its name.
TIME_UNITS = PER_SECOND | {"minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0, "days": 1.0 / 86_400.0}
#: Unix times in seconds stay below this for 3000 years.
_UNIX_MAX_S = 1e11
#: So many azimuths of at most `SIGNED_MAX_DEG` are no rounding about north.
SIGNED_MIN, SIGNED_MAX_DEG = 20, -1.0
#: Coherence of azimuths and times in the right unit, at least, also among clutter; in another unit
#: it is at most half of it.
_STEADY_MIN = 0.4
#: Largest azimuth of plots in most directions, degrees, and scans that show a rotation, at least.
_WHOLE_CIRCLE_DEG = 180.0, 360.5
_SCANS_MIN = 3.0
#: Tolerance of a ratio of scan periods: missed detections lengthen the median.
_RATIO_WITHIN = 0.05
#: Resolutions of times that are too coarse, s, and plots that show one; the error of a finer one
#: than the second is that of a range: a warning.
_RESOLUTIONS_S, _RESOLUTION_PLOTS = (256.0, 128.0, 64.0, 60.0, 32.0, 10.0, 1.0, 0.5), 100
_RESOLUTION_ERROR_S = 1.0
#: ... of which those of Unix times in 32 bits since 1970, s.
_FLOAT32_S = (256.0, 128.0, 64.0, 32.0)
#: Ratios of measured to configured scan periods within this of each other have one cause.
_RATES_WITHIN = 0.02
#: Speed for the effect of a coarse time, m/s.
_SPEED_MPS = 250.0
#: Codes of a sensor are those of other aircraft if at most this fraction of the tracks that it has
#: in common with each other sensor has the same code; such tracks, and plots with a code in each.
CODES_EQUAL_MAX, CODES_TRACKS_MIN, CODES_PLOTS_MIN = 0.25, 8, 3
#: Numbers of codes to which codes may be truncated.
_CODE_MODULI = (2048, 1024, 1000, 512, 256, 128, 100, 64, 8)
#: Transformations of codes, octal digits, with what is wrong.
_CODE_FORMS: dict[str, Callable[[str], str]] = {
    "decimal instead of octal numbers": lambda code: str(int(code, 8)).zfill(4),
    "hexadecimal instead of octal numbers": lambda code: f"{int(code, 8):04x}",
    "digits in reverse order (D, C, B, A)": lambda code: code[::-1],
    "digits in the order A, C, B, D": lambda code: code[0] + code[2] + code[1] + code[3],
}


def check_constant(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose a column of a radar that has one value in most plots.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    """
    columns = {"time_s": plots.time_s, "range_m": plots.range_m, "azimuth_deg": plots.azimuth_deg}
    same = {column: _most(values) for column, values in columns.items()}
    constant = [column for column, (share, _) in same.items() if share >= SAME_MIN]
    # A transponder at a fixed place has one range and one azimuth.
    if not constant or constant == ["range_m", "azimuth_deg"]:
        return None
    measured = np.column_stack([plots.time_s, plots.range_m, plots.azimuth_deg])
    if len(np.unique(measured, axis=0)) < TESTED_MIN:
        # Copies are another mistake.
        return None
    column = constant[0]
    share, value = same[column]
    return Diagnosis(
        name,
        "column_constant",
        f"{name}: its {column} is probably a placeholder: the value is {value:.10g} in "
        f"{share:.0%} of the plots; fill the column with the measured values",
    )


def check_time_unit(name: str, plots: Plots, period_s: float) -> Diagnosis | None:
    """Diagnose times in another unit than seconds.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    period_s : float
        The configured scan period, s; NaN where unknown.
    """
    if plots.size < TESTED_MIN:
        return None
    if np.median(np.abs(plots.time_s)) > _UNIX_MAX_S:
        why = f"the first time is {plots.time_s[0]:.0f}"
        return _of_time_unit(name, "milliseconds or microseconds", why)
    between_s = _between_plots(plots)
    for unit, factor in TIME_UNITS.items():
        if abs(between_s / (period_s * factor) - 1.0) <= _RATIO_WITHIN:
            form = ".3g" if between_s < 100.0 else ",.0f"
            why = (
                f"the plots of an aircraft are {between_s:{form}} apart, but rotation_period_s is "
                f"{period_s:g} in the sensors file"
            )
            return _of_time_unit(name, unit, why)
    return _by_rotation(name, plots, period_s)


# Plots that name no aircraft: the unit in which the azimuths advance at the configured period.
def _by_rotation(name: str, plots: Plots, period_s: float) -> Diagnosis | None:
    azimuth = np.radians(plots.azimuth_deg)
    # Azimuths in another unit do not advance in any unit of times.
    whole = _WHOLE_CIRCLE_DEG[0] <= np.max(plots.azimuth_deg) <= _WHOLE_CIRCLE_DEG[1]
    if not (whole and period_s > 0.0):
        return None
    if coherence_at(plots.time_s, azimuth, period_s) >= _STEADY_MIN / 2.0:
        return None
    for unit, factor in TIME_UNITS.items():
        time_s = plots.time_s / factor
        # Within a part of a scan, azimuths in one direction are steady.
        if np.ptp(time_s) < _SCANS_MIN * period_s:
            continue
        if coherence_at(time_s, azimuth, period_s) >= _STEADY_MIN:
            why = (
                f"its azimuths advance by one revolution in {period_s:g} s, rotation_period_s in "
                f"the sensors file, with times interpreted as {unit}"
            )
            return _of_time_unit(name, unit, why)
    return None


def check_time_rate(radars: Iterable[tuple[Plots, float]]) -> Diagnosis | None:
    """Diagnose times that run too fast or too slow: all radars rotate slower or faster than given.

    Parameters
    ----------
    radars : iterable of (Plots, float)
        The plots of each radar, and its configured scan period, s; NaN where unknown.
    """
    periods_s = []
    for plots, configured_s in radars:
        if not np.isfinite(configured_s):
            continue
        found_s = measured_period(plots)
        if not abs(found_s / configured_s - 1.0) > PERIOD_WITHIN:
            return None
        periods_s.append((found_s, configured_s))
    found, configured = np.array(periods_s).reshape(-1, 2).T
    ratios = found / configured
    # Radars of one period may all have the same wrong one.
    if len(found) < 2 or np.ptp(ratios) > _RATES_WITHIN * ratios.min() or (
        np.ptp(found) <= PERIOD_WITHIN * found.min()
    ):  # fmt: skip
        return None
    ratio = float(np.median(ratios))
    units = [unit for unit, one in TIME_UNITS.items() if abs(ratio / one - 1.0) <= _RATIO_WITHIN]
    code, what, remedy = (
        ("time_unit", f"are probably in {units[0]}", "convert them to seconds")
        if units
        else (
            "time_rate",
            f"probably advance {ratio:.3g} s per second",
            "correct the unit of the times, or, if they are right, rotation_period_s in the "
            "sensors file",
        )
    )
    return Diagnosis(
        "",
        code,
        f"the times {what}: all {len(found)} radars complete a revolution in "
        f"{ratio:.4g} times their rotation_period_s; {remedy}",
    )


def check_time_resolution(name: str, plots: Plots, period_s: float) -> Diagnosis | None:
    """Diagnose times of a rotating radar without the fractions of a second.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    period_s : float
        The configured scan period, s; NaN where unknown.
    """
    if plots.size < _RESOLUTION_PLOTS or not np.isfinite(period_s):
        return None
    coarse = [one for one in _RESOLUTIONS_S if (np.mod(plots.time_s, one) == 0.0).all()]
    if not coarse:
        return None
    resolution_s = coarse[0]
    # One time for each scan is another convention, and positions are extrapolated to it.
    between = np.diff(np.unique(plots.time_s))
    if not len(between) or abs(float(np.median(between)) / period_s - 1.0) <= _RATIO_WITHIN:
        return None
    if resolution_s in _FLOAT32_S:
        return Diagnosis(
            name,
            "time_resolution",
            f"{name}: its times were probably stored as 32-bit floating-point numbers: all are "
            f"multiples of {resolution_s:g} s; store them as 64-bit numbers",
        )
    return Diagnosis(
        name,
        "time_resolution",
        f"{name}: its times probably lack fractions of a second: all are multiples of "
        f"{resolution_s:g} s, in which an aircraft flies {_SPEED_MPS * resolution_s:.0f} m; write "
        "the times with at least two decimals",
        "error" if resolution_s >= _RESOLUTION_ERROR_S else "warning",
    )


def check_signed(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose azimuths from −180° to 180°, of which the negative ones are rejected."""
    azimuth = plots.azimuth_deg[np.isfinite(plots.azimuth_deg)]
    negative = azimuth[azimuth <= SIGNED_MAX_DEG]
    if len(negative) < SIGNED_MIN or negative.min() < -180.0 or azimuth.max() > 180.0:
        return None
    return Diagnosis(
        name,
        "azimuth_signed",
        f"{name}: its azimuths probably range from -180° to 180°: {counted(len(negative))} of "
        f"{counted(len(azimuth))} are negative and therefore rejected; azimuths must be 0 to 360° "
        "clockwise from north: add 360° to negative azimuths",
    )


def _most(values: Floats) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if len(known) < TESTED_MIN:
        return 0.0, np.nan
    found, counts = np.unique(known, return_counts=True)
    return float(counts.max() / len(values)), float(found[counts.argmax()])


# Median time between successive plots of an aircraft; NaN where aircraft are not identified.
def _between_plots(plots: Plots) -> float:
    gaps = gaps_s(plots)
    return float(np.median(gaps)) if len(gaps) >= TESTED_MIN else np.nan


def _of_time_unit(name: str, unit: str, why: str) -> Diagnosis:
    return Diagnosis(
        name, "time_unit",
        f"{name}: its times are probably in {unit}: {why}; convert them to seconds",
    )  # fmt: skip


def check_codes(evidence: Evidence, named: Collection[str]) -> list[Diagnosis]:
    """Diagnose Mode 3/A codes of a sensor that differ from those of others for the same tracks.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    named : collection of str
        Sensors with another diagnosis, which are not compared.
    """
    wrong_ones = [evidence.number(name) for name in named]
    codes = _codes_of_tracks(evidence).filter(~pl.col("sensor").is_in(wrong_ones))
    pairs = codes.join(codes, on="track", suffix="_other").filter(
        pl.col("sensor") != pl.col("sensor_other"),
        ~pl.col("code_other").is_in(CONSPICUITY),
    )
    equal = (pl.col("code") == pl.col("code_other")).mean().alias("equal")
    shares = (
        pairs.group_by("sensor", "sensor_other")
        .agg(equal, pl.len().alias("tracks"))
        .filter(pl.col("tracks") >= CODES_TRACKS_MIN)
    )
    best = shares.group_by("sensor").agg(pl.col("equal").max(), pl.col("tracks").max())
    wrong = best.filter(pl.col("equal") <= CODES_EQUAL_MAX).sort("sensor")
    right = best.filter(pl.col("equal") > 1.0 - CODES_EQUAL_MAX)
    names = [evidence.sensors.ids[one] for one in wrong["sensor"].to_list()]
    if not names or (right.is_empty() and len(names) != 2):
        return []
    if right.is_empty():
        tracks = int(wrong["tracks"].max())  # type: ignore[arg-type]  # of a column of integers
        return [_codes_differ(names[0], f"those of {listed(names[1:])}", tracks, "")]
    found = []
    for name, number, tracks in zip(names, wrong["sensor"], wrong["tracks"], strict=True):
        own = pairs.filter(
            pl.col("sensor") == number, pl.col("sensor_other").is_in(right["sensor"].to_list())
        )
        found.append(_codes_differ(name, "those of the other sensors", tracks, _code_form(own)))
    return found


def _codes_differ(name: str, of: str, tracks: int, why: str) -> Diagnosis:
    cause = why or "the codes of one of them belong to other rows or are in another form"
    return Diagnosis(
        name,
        "codes",
        f"{name}: its Mode 3/A codes (mode_3a) differ from {of} for nearly all of {tracks} common "
        f"tracks: {cause}; correct the column, or leave it empty",
    )


# The code of most plots of each sensor in each track.
def _codes_of_tracks(evidence: Evidence) -> pl.DataFrame:
    plots = evidence.tracked()
    columns = {
        "track": plots.track_id,
        "sensor": plots.measured.sensor,
        "code": plots.measured.mode_3a,
    }
    return (
        pl.DataFrame(columns)
        .filter(pl.col("code") >= 0)
        .group_by("track", "sensor")
        .agg(pl.col("code").mode().min(), pl.len().alias("plots"))
        .filter(pl.col("plots") >= CODES_PLOTS_MIN)
        .select("track", "sensor", pl.col("code").cast(pl.Int64))
    )


def _code_form(pairs: pl.DataFrame) -> str:
    own = [f"{code:04o}" for code in pairs["code"].to_list()]
    others = [f"{code:04o}" for code in pairs["code_other"].to_list()]
    for what, form in _CODE_FORMS.items():
        same = sum(form(other) == one for one, other in zip(own, others, strict=True))
        if same > 0.5 * len(own):
            return f"probably {what}"
    for modulus in _CODE_MODULI:
        same = sum(
            int(other, 8) % modulus == int(one, 8) for one, other in zip(own, others, strict=True)
        )
        if same > 0.5 * len(own):
            return f"probably truncated (modulo {modulus}, of 4096 codes)"
    if len(set(own)) == 1:
        return f"all are {own[0]}"
    if np.isin(own, others).mean() > 0.5:
        return "they are codes of other aircraft, and probably belong to other rows"
    return "they are probably in another form"
