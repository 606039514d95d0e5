"""Lost measurements of a sensor by cause, and the errors that they indicate."""

from collections import Counter
from itertools import combinations
from typing import NamedTuple, get_args

import numpy as np
import polars as pl

from multiradar.diagnosis.evidence import COLUMNS, Evidence
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import counted
from multiradar.diagnosis.plots import HEIGHT_ASSUMED_M, Floats
from multiradar.diagnosis.times import utc
from multiradar.estimation.filters.bank import Outcome
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar_schemas.measurements.units import FOOT_M, NAUTICAL_MILE_M
from multiradar_schemas.reject import INSTRUMENTED_RANGE, RejectCode
from multiradar_schemas.sensors.sensor import SensorKind

_MEASURED = ["time_s", "range_m", "azimuth_deg"]
#: A sensor that loses more than this fraction of its measurements is diagnosed, from `READ_MIN` on.
LOST_MAX = 1.0 / 3.0
READ_MIN = 20
#: A value that this fraction of the plots has was not measured.
SAME_MIN = 1.0 - LOST_MAX
#: Reject codes of values that are never correct; above this fraction they cause a warning.
VALUE_CODES = (
    RejectCode.NON_FINITE, RejectCode.MISSING_FIELD, RejectCode.NOT_A_NUMBER, RejectCode.WRONG_TYPE,
)  # fmt: skip
VALUES_MAX = 0.01
#: ... and fraction of values outside their limits, as of garbled replies, without the plots beyond
#: range_max_m.
OUTSIDE_MAX = 0.1
_KINDS = ("radar", "adsb", "mlat", "bearing")
#: Fraction of the measurements of a radar that are of another kind by mistake.
_MIXED_MIN = 0.01
#: Outcomes that are no loss: used for tracks, or in the cone of silence.
_USED = (Outcome.UPDATED, Outcome.STARTED, Outcome.CONE_OF_SILENCE)
#: Units of range that range_max_m is given in by mistake, m.
_RANGE_MAX_UNITS = {"kilometres": 1000.0, "nautical miles": NAUTICAL_MILE_M}
_RANGE_MAX_FACTOR = 1.05
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
    "NO_ROOM": "whether it sends false plots (plots_per_scan_max), and the number of aircraft that "
    "the filter can track (--filter)",
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
    return (
        _of_two_kinds(evidence, name, kinds, losses)
        or _of_kind(evidence, name, kinds, losses)
        or _of_bearings(evidence, name)
    )


# A radar that is jammed delivers bearings without ranges.
def _of_bearings(evidence: Evidence, name: str) -> Diagnosis | None:
    number, plots = evidence.number(name), evidence.sources[name].plots()
    if number < 0 or evidence.sensors.kinds[number] != KIND_RADAR:
        return None
    bearings = int(((plots["kind"] == "bearing") & plots["range_m"].is_not_null()).sum())
    if bearings <= max(READ_MIN, LOST_MAX * len(plots)):
        return None
    return Diagnosis(
        name,
        "kind",
        f"{name}: kind is probably wrong: {bearings / len(plots):.0%} of its measurements are of "
        "kind bearing, but have ranges, which are not used; write radar in the column kind of its "
        "measurements",
    )


# Most measurements of another kind than the declared one.
def _of_kind(
    evidence: Evidence, name: str, kinds: Counter[str], losses: Losses
) -> Diagnosis | None:
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
    if kind.lower() in _KINDS and kind not in _KINDS:
        remedy = f"write {kind.lower()} in lower case in the column kind of its measurements"
        return Diagnosis(
            name,
            "kind",
            f"{name}: kind is probably wrong: its measurements are of kind {kind}; {remedy}",
        )
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


# Measurements of two kinds under the name of one sensor, most or some of which it cannot have.
def _of_two_kinds(
    evidence: Evidence, name: str, kinds: Counter[str], losses: Losses
) -> Diagnosis | None:
    if evidence.number(name) < 0 or evidence.sensors.kinds[evidence.number(name)] != KIND_RADAR:
        return None
    own, others = kinds["radar"], Counter({one: kinds[one] for one in _KINDS[1:] if kinds[one]})
    least = max(READ_MIN, _MIXED_MIN * kinds.total())
    if own < least or others.total() < least or losses.lost["UNKNOWN_KIND"] < least:
        return None
    kind, count = others.most_common(1)[0]
    return Diagnosis(
        name,
        "kind",
        f"{name}: its measurements are probably those of two sensors: {count / kinds.total():.0%} "
        f"are of kind {kind} and rejected, the others of kind radar; give those of kind {kind} the "
        "sensor_id of their own sensor",
    )


# The ranges of a sensor with many values out of range, and its range_max_m; a direction finder has
# no ranges.
def _out_of_range(evidence: Evidence, name: str, losses: Losses) -> tuple[Floats, float] | None:
    number = evidence.number(name)
    if number < 0 or losses.lost["OUT_OF_RANGE"] <= LOST_MAX * losses.known:
        return None
    ranges = evidence.sources[name].plots()["range_m"].drop_nulls().to_numpy()
    return (ranges, float(evidence.sensors.range_max_m[number])) if len(ranges) else None


def check_range_constant(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Diagnose ranges to which a constant was added: all are beyond range_max_m.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The sensor.
    losses : Losses
        Its losses.
    """
    lost = _out_of_range(evidence, name, losses)
    if lost is None:
        return None
    ranges, end_m = lost
    near, far = np.quantile(ranges, (0.001, 0.999)).tolist()
    # In another unit, near aircraft would have small numbers, too.
    if not near > end_m >= max(far - near, 1000.0):
        return None
    feet = ", or be in feet" if far * FOOT_M <= _RANGE_MAX_FACTOR * end_m else ""
    return Diagnosis(
        name,
        "range_constant",
        f"{name}: its ranges probably contain a constant of up to {near / 1e3:.0f} km: they are "
        f"from {near:.0f} m to {far:.0f} m, all beyond range_max_m ({end_m:g} in the sensors "
        f"file), although they differ by less than that; subtract it (they may be right{feet}, if "
        "all aircraft are far away: then correct range_max_m, or their unit)",
    )


def check_range_max(
    evidence: Evidence, name: str, losses: Losses, *, in_metres: bool = False
) -> Diagnosis | None:
    """Diagnose a range_max_m that is too small, or given in a larger unit than metres.

    Parameters
    ----------
    evidence : Evidence
        What is retained of the run.
    name : str
        The sensor.
    losses : Losses
        Its losses.
    in_metres : bool
        Whether the ranges are known to be in metres.
    """
    lost = _out_of_range(evidence, name, losses)
    if lost is None:
        return None
    ranges, end_m = lost
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
    if not units and not in_metres and far * FOOT_M <= _RANGE_MAX_FACTOR * end_m:
        return Diagnosis(
            name,
            "range_unit",
            f"{name}: its ranges are probably in feet, or range_max_m is wrong: it is {end_m:g} in "
            f"the sensors file, but {np.mean(beyond):.0%} of the plots are farther away, up to "
            f"{far:.0f} m ({far * FOOT_M:.0f} m if the ranges are in feet); convert the ranges to "
            "metres, or correct range_max_m",
        )
    small, remedy = ("too small", "increase it to the instrumented range of the radar")
    if end_m < 1000.0:
        small, remedy = (f"wrong{guess}", "convert it to metres")
    return Diagnosis(
        name,
        "range_max",
        f"{name}: range_max_m is probably {small}: it is {end_m:g} in the sensors file, but "
        f"{np.mean(ranges > end_m):.0%} of the plots are farther away, up to {far:.0f} m; {remedy}",
    )


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


# Copies that are not exact have passed through another recorder or network; as declared, where they
# have another name of the sensor.
def _of_two_feeds(evidence: Evidence, name: str) -> Diagnosis | None:
    again, read = evidence.duplicates[name], evidence.sources[name].read
    declared = 0 < evidence.renamed[name] < read
    if again <= LOST_MAX * read or declared:
        return None
    return Diagnosis(
        name,
        "measurements_twice",
        f"{name}: its measurements are probably in the recording twice, from two feeds: "
        f"{again / read:.0%} repeat another plot within a fraction of a scan and are not used; "
        "if there are two networks, give the second one its own sensor_id and declare it with also",
        "warning",
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


# Whether most plots of a radar are nearer than the height that they are taken to be at.
def _are_surface(evidence: Evidence, name: str) -> bool:
    plots = evidence.sources[name].plots()
    near = plots.filter(pl.col("height_m").is_null() & (pl.col("range_m") < HEIGHT_ASSUMED_M))
    return len(near) > 0.5 * len(plots)


# What is wrong with values that are no measurements, by the reason of the first one.
def _never_a_value(code: str, reason: str) -> str:
    column, _, was = reason.partition(":")
    if column not in COLUMNS:
        return ""
    if code == RejectCode.NON_FINITE:
        return f"{column} is not a number (NaN); leave it empty (null) where there is no value"
    if code == RejectCode.MISSING_FIELD:
        return f"{column} is empty in them ({reason}); fill it, or remove these rows"
    if column == "mode_s_address" and "was '0x" in was.casefold():
        return "mode_s_address has the prefix 0x; write its six hexadecimal digits alone"
    if column == "range_m" and was.rpartition("was ")[2].startswith("-"):
        return f"{column} is negative ({was.rpartition('was ')[2]}); write ranges above 0"
    return ""


def check_unexplained_losses(evidence: Evidence, name: str, losses: Losses) -> Diagnosis | None:
    """Report losses that no diagnosed error explains."""
    if losses.known < READ_MIN or losses.share <= LOST_MAX:
        return None
    most = losses.lost.most_common(1)[0][0]
    if most == Outcome.UNASSOCIATED.name and _are_surface(evidence, name):
        return Diagnosis(
            name,
            "measurements_lost",
            f"{name}: {losses.words()}: its plots have no heights, aircraft without one are taken "
            f"to be at {HEIGHT_ASSUMED_M:.0f} m, and most of its ranges are shorter (a surface "
            "movement radar?); fill height_m, or exclude the sensor",
            "warning",
        )
    reason = evidence.sources[name].reasons.get(most)
    value = _never_a_value(most, reason or "")
    if value:
        return Diagnosis(name, "measurements_lost", f"{name}: {losses.words()}: {value}")
    when = ""
    if most in ("TIME_LATE", "TIME_FUTURE"):
        source = evidence.sources[name]
        when = f" (its times: {utc(source.first_s)} to {utc(source.last_s)})"
    check = _SETTINGS.get(most, "its measurements in rejects.ndjson")
    if reason is not None:
        when += f" (the first {most}: {reason})"
        column = reason.partition(":")[0]
        check = f"the values and the unit of {column}" if column in COLUMNS else check
    return Diagnosis(
        name,
        "measurements_lost",
        f"{name}: {losses.words()}{when}, and no single mistake explains the loss; check {check}",
    )
