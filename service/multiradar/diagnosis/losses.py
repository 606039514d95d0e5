"""Lost measurements of a sensor by cause, and the errors that they indicate."""

from collections import Counter
from itertools import combinations
from typing import NamedTuple, get_args

import numpy as np
import polars as pl

from multiradar.diagnosis.evidence import COLUMNS, Evidence
from multiradar.diagnosis.model import Diagnosis, Severity
from multiradar.diagnosis.names import counted
from multiradar.diagnosis.plots import NORMAL_SPREAD, Integers, Plots
from multiradar.diagnosis.times import utc
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar_schemas.measurements.units import FOOT_M, NAUTICAL_MILE_M
from multiradar_schemas.reject import INSTRUMENTED_RANGE, RejectCode
from multiradar_schemas.sensors.sensor import SensorKind

_MEASURED = ["time_s", "range_m", "azimuth_deg"]
#: A sensor that loses more than this fraction of its measurements is diagnosed, from `READ_MIN` on.
LOST_MAX = 1.0 / 3.0
READ_MIN = 20
#: Reject codes of values that are never correct; above this fraction they cause a warning.
VALUE_CODES = (
    RejectCode.NON_FINITE, RejectCode.MISSING_FIELD, RejectCode.NOT_A_NUMBER, RejectCode.WRONG_TYPE,
)  # fmt: skip
VALUES_MAX = 0.01
#: ... and fraction of values outside their limits, as of garbled replies, without the plots beyond
#: range_max_m.
OUTSIDE_MAX = 0.1
#: Outcomes that are no loss: used for tracks, or in the cone of silence.
_USED = (Outcome.UPDATED, Outcome.STARTED, Outcome.CONE_OF_SILENCE)
#: Units of range that range_max_m is given in by mistake, m.
_RANGE_MAX_UNITS = {"kilometres": 1000.0, "nautical miles": NAUTICAL_MILE_M}
_RANGE_MAX_FACTOR = 1.05
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
#: The settings of noise.
SIGMAS, _UNITS = ("range_sigma_m", "azimuth_sigma_deg"), (" m", "°")
#: What to check for an unexplained loss, by reject code or outcome.
_SETTINGS = {
    "TIME_LATE": "its clock, and reorder_horizon_s in the settings",
    "TIME_FUTURE": "its clock",
    "RATE_EXCEEDED": "plots_per_scan_max, rotation_period_s and range_max_m",
    "OUT_OF_RANGE": "range_max_m and the units of its columns",
    "MISSING_FIELD": "which columns are filled in its measurements",
    "UNKNOWN_KIND": "kind",
    "REFUSED": "its site, range_sigma_m, azimuth_sigma_deg and its clock",
    "RESTARTED": "its site, range_sigma_m, azimuth_sigma_deg and its clock",
    "UNASSOCIATED": "range_sigma_m, azimuth_sigma_deg and clutter",
    "UNLOCATABLE": "its site and the units of its columns",
    "IMPLAUSIBLE": "whether it reports the same aircraft as the radars",
    "NO_ROOM": "the number of aircraft that the filter can track (--filter)",
    "UNSUPPORTED": "whether the filter supports this kind of measurement (--filter)",
}


class Losses(NamedTuple):
    """Outcome of the measurements of a sensor.

    Attributes
    ----------
    known : int
        Measurements with a known outcome.
    lost : Counter
        Lost measurements by reject code or outcome.
    duplicate : int
        Duplicate measurements.
    """

    known: int
    lost: Counter[str]
    duplicate: int

    @property
    def share(self) -> float:
        """Fraction of the measurements that were lost."""
        return sum(self.lost.values()) / self.known if self.known else 0.0

    def words(self) -> str:
        """Return the losses by cause as text, the most frequent first."""
        parts = [f"{counted(number)} {name}" for name, number in self.lost.most_common(3)]
        of_all = f"{self.share:.0%} of its {counted(self.known)} measurements"
        return f"{of_all} were lost ({', '.join(parts)})"


def losses_of(evidence: Evidence, name: str) -> Losses:
    """Return the outcome of the measurements of a sensor."""
    lost = Counter(evidence.sources[name].rejected)
    outcomes = evidence.outcomes_of(name)
    for number, count in enumerate(outcomes.tolist()):
        if count and Outcome(number) not in _USED:
            lost[Outcome(number).name] += count
    duplicate = evidence.duplicates[name]
    known = int(outcomes.sum()) + sum(evidence.sources[name].rejected.values()) + duplicate
    # As configured.
    known -= lost.pop(RejectCode.SENSOR_DISABLED.value, 0)
    return Losses(known, lost, duplicate)


def check_kind(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Diagnose measurements of another kind than the declared kind of the sensor."""
    kinds: Counter[str] = Counter()
    for part in evidence.sources[name].kept:
        for one, count in part.group_by("kind", maintain_order=True).len().iter_rows():
            kinds[str(one)] += count
    kind, most = (kinds.most_common(1) or [("", 0)])[0]
    why = "which a sensor of the configured kind does not report"
    if losses.lost["UNKNOWN_KIND"] <= LOST_MAX * losses.known:
        # Both report positions, and those of ADS-B alone may be false or of low integrity.
        number, sensors = evidence.number(name), evidence.sensors
        declared = "adsb" if sensors.self_reported[number] else "mlat"
        other = kind in {"adsb", "mlat"} - {declared} and most >= (1.0 - LOST_MAX) * kinds.total()
        if sensors.kinds[number] != KIND_POSITION or not other:
            return None
        why = f"but the sensors file declares {declared}"
    declared = "direction-finder" if kind == "bearing" else kind
    remedy = f'declare it as kind = "{declared}"'
    if declared not in get_args(SensorKind):
        remedy = "write radar, adsb, mlat or bearing in the column kind of its measurements"
    elif declared in ("adsb", "mlat") and evidence.sources[name].plots()["range_m"].count():
        remedy = "its measurements have ranges: correct their column kind"
    return Diagnosis(
        name,
        "kind",
        f"{name}: kind is probably wrong: its measurements are of kind {kind}, {why}; {remedy}",
    )


def check_range_max(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Diagnose a range_max_m given in a larger unit than metres."""
    if losses.lost["OUT_OF_RANGE"] <= LOST_MAX * losses.known:
        return None
    end_m = float(evidence.sensors.range_max_m[evidence.number(name)])
    ranges = evidence.sources[name].plots()["range_m"].drop_nulls().to_numpy()
    beyond = ranges > _RANGE_MAX_FACTOR * end_m
    if not np.isfinite(end_m) or np.mean(beyond) <= LOST_MAX:
        return None
    far = float(np.quantile(ranges, 0.999))
    units = [
        unit
        for unit, metres in _RANGE_MAX_UNITS.items()
        if end_m < 1000.0 and far <= _RANGE_MAX_FACTOR * end_m * metres
    ]
    guess = f" (in {units[0]}?)" if units else ""
    if not units and far * FOOT_M <= _RANGE_MAX_FACTOR * end_m:
        return Diagnosis(
            name,
            "range_unit",
            f"{name}: its ranges are probably in feet, or range_max_m is wrong: it is {end_m:g} in "
            f"the sensors file, but {np.mean(beyond):.0%} of the plots are farther away, up to "
            f"{far:.0f} m ({far * FOOT_M:.0f} m if the ranges are in feet); convert the ranges to "
            "metres, or correct range_max_m",
        )
    return Diagnosis(
        name,
        "range_max",
        f"{name}: range_max_m is probably wrong{guess}: it is {end_m:g} in the sensors file, but "
        f"{np.mean(beyond):.0%} of the plots are farther away, up to {far:.0f} m; convert it to "
        "metres",
    )


def check_noise(evidence: Evidence, name: str, *, causes: bool) -> Diagnosis | None:
    """Diagnose configured sigmas that are far from the measured noise.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The sensor.
    causes : bool
        Whether another error was found: it may explain noise above its sigma.
    """
    return _of_sigmas(name, [one for one in _by_noise(evidence, name, causes=causes) if one])


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
    time_s, of = plots.time_s[order], aircraft[order]
    before_s, after_s = np.diff(time_s)[:-1], np.diff(time_s)[1:]
    shorter, longer = np.minimum(before_s, after_s), np.maximum(before_s, after_s)
    chosen = (of[2:] == of[:-2]) & (longer <= _APART_FACTOR * shorter) & (longer <= _APART_MAX_S)
    if np.count_nonzero(chosen & (shorter > 0.0)) < _SCATTER_MIN:
        return None
    middle = np.flatnonzero(chosen & (shorter > 0.0)) + 1
    azimuth = np.radians(plots.azimuth_deg[order])
    range_m = plots.range_m[order]
    place = np.column_stack([range_m * np.sin(azimuth), range_m * np.cos(azimuth)])
    weight = (before_s / (before_s + after_s))[middle - 1, None]
    apart = place[middle] - (1.0 - weight) * place[middle - 1] - weight * place[middle + 1]
    outward = place[middle] / np.linalg.norm(place[middle], axis=1)[:, None]
    along = np.sum(apart * outward, axis=1)
    across = apart[:, 0] * outward[:, 1] - apart[:, 1] * outward[:, 0]
    of_three = np.sqrt(1.0 + weight[:, 0] ** 2 + (1.0 - weight[:, 0]) ** 2)
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
        for setting, sigma, scatter, unit in zip(
            SIGMAS, sigmas(evidence, name), scatters, _UNITS, strict=True
        )
        if scatter >= SCATTER_FACTOR * sigma
    ]  # fmt: skip
    return _of_sigmas(name, found)


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
def _by_noise(evidence: Evidence, name: str, *, causes: bool) -> list[_WrongSigma | None]:
    ratios = evidence.noise.get(name, (np.nan, np.nan))
    largest = np.nanmax([1.0, *(ratio for both in evidence.noise.values() for ratio in both)])
    high = max(NOISE_WARNING, _NOISE_OF_OTHERS * largest)
    found: list[_WrongSigma | None] = []
    for setting, sigma, ratio in zip(SIGMAS, sigmas(evidence, name), ratios, strict=True):
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


def check_repeated(evidence: Evidence, name: str) -> Diagnosis | None:
    """Diagnose measurements that are exact copies of others."""
    plots = evidence.sources[name].plots()
    again = len(plots) - plots.n_unique()
    if len(plots) < READ_MIN:
        return None
    if again <= LOST_MAX * len(plots):
        return _of_two_feeds(evidence, name)
    return Diagnosis(
        name,
        "measurements_twice",
        f"{name}: its measurements are probably in the recording twice: {again / len(plots):.0%} "
        "are exact copies of another measurement; record or merge each plot once",
    )


# Copies that are not exact have passed through another recorder or network.
def _of_two_feeds(evidence: Evidence, name: str) -> Diagnosis | None:
    again, read = evidence.duplicates[name], evidence.sources[name].read
    if again <= LOST_MAX * read:
        return None
    return Diagnosis(
        name,
        "measurements_twice",
        f"{name}: its measurements are probably in the recording twice, from two feeds: "
        f"{again / read:.0%} repeat another plot within a fraction of a scan and are not used; "
        "record or merge each plot once",
    )


def check_copied_sensors(evidence: Evidence) -> list[Diagnosis]:
    """Diagnose radars whose plots are those of another: one radar under two identifiers.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.

    Returns
    -------
    list of Diagnosis
        For the later one of each pair.
    """
    parts = [
        one.plots().drop_nulls(_MEASURED).select(*_MEASURED, pl.lit(name).alias("name")).unique()
        for name, one in evidence.sources.items()
        if evidence.number(name) >= 0
    ]
    if len(parts) < 2:
        return []
    names = pl.concat(parts).group_by(_MEASURED).agg(pl.col("name").sort().unique())
    pairs = names.filter(pl.col("name").list.len() > 1)["name"].to_list()
    shared = Counter(
        (first, later) for several in pairs for first, later in combinations(sorted(several), 2)
    )
    sizes = {part["name"][0]: len(part) for part in parts if len(part)}
    found = {}
    for (first, later), count in sorted(shared.items()):
        least = min(sizes[first], sizes[later])
        if least >= READ_MIN and count > LOST_MAX * least:
            found[later] = Diagnosis(
                later,
                "sensor_twice",
                f"{later}: {count / sizes[later]:.0%} of its plots are also plots of {first}, "
                "with the same times, ranges and azimuths: probably one radar under two "
                "identifiers, so that its errors count twice; remove one of them",
            )
    return list(found.values())


def check_values(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Report rejected values of a sensor whose other measurements are used."""
    wrong = Counter({code: losses.lost[code] for code in VALUE_CODES if losses.lost[code]})
    many = wrong.total() > VALUES_MAX * losses.known and wrong.total() >= READ_MIN
    outside = losses.lost[RejectCode.OUT_OF_RANGE]
    reason = evidence.sources[name].reasons.get(RejectCode.OUT_OF_RANGE, INSTRUMENTED_RANGE)
    if (
        outside > OUTSIDE_MAX * losses.known
        and outside >= READ_MIN
        and INSTRUMENTED_RANGE not in reason
    ):
        wrong[RejectCode.OUT_OF_RANGE] = outside
        many = True
    if not many or losses.share > LOST_MAX:
        return None
    codes = ", ".join(f"{counted(number)} {code}" for code, number in wrong.most_common())
    first = evidence.sources[name].reasons.get(wrong.most_common(1)[0][0], "")
    return Diagnosis(
        name,
        "values_rejected",
        f"{name}: {wrong.total() / losses.known:.0%} of its {counted(losses.known)} measurements "
        f"were rejected because of their values ({codes}{'; the first: ' if first else ''}{first}"
        "); correct or remove these measurements",
        "warning",
    )


def check_unexplained_losses(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Report losses that no diagnosed error explains."""
    if losses.known < READ_MIN or losses.share <= LOST_MAX:
        return None
    most = losses.lost.most_common(1)[0][0]
    when = ""
    if most in ("TIME_LATE", "TIME_FUTURE"):
        source = evidence.sources[name]
        when = f" (its times: {utc(source.first_s)} to {utc(source.last_s)})"
    check = _SETTINGS.get(most, "its measurements in rejects.ndjson")
    reason = evidence.sources[name].reasons.get(most)
    if reason is not None:
        when += f" (the first {most}: {reason})"
        column = reason.partition(":")[0]
        check = f"the values and the unit of {column}" if column in COLUMNS else check
    return Diagnosis(
        name,
        "measurements_lost",
        f"{name}: {losses.words()}{when}, and no single mistake explains the loss; check {check}",
    )
