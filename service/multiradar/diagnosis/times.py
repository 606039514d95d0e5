"""Sources whose times differ from the others: another day, another time zone, no date."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl

from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.model import Diagnosis, Severity
from multiradar.diagnosis.names import first_and_last, listed
from multiradar.diagnosis.plots import Floats, plots_of, positions
from multiradar_schemas.documents.names import PER_SECOND

TIMES_APART, TIMES_JUMP, TIME_UNIT = "times_apart", "times_jump", "time_unit"
#: Sensors of one recording start and end within this, s.
_TOGETHER_S = 60.0
#: Times as HHMMSS: plots, the span of the numbers, and how many of the 60 seconds have a plot.
_DIGITS_MIN, _DIGITS_SPAN, _DIGITS_SECONDS = 100, 200.0, 30
_NAMES = ("mode_s_address", "track_number", "mode_3a")
#: A radar is anywhere: distances between its plots do not depend on its site.
_SITE = (0.0, 0.0, 0.0)
#: Times below this are times of day without a date, s.
DATELESS_MAX_S = 10.0 * 86_400.0
#: Sources separated by more than the data clock may jump have no common time, s.
GAP_MIN_S = 600.0
#: Offsets this close to whole hours are attributed to time zones, s.
ZONE_WITHIN_S = 120.0
DAY_S, HOUR_S = 86_400.0, 3600.0
#: Groups of sensors whose starts and ends are as far apart as each other have one period, s.
_ENDS_WITHIN_S = 300.0
#: 1970-01-01 as spreadsheets count days.
_SPREADSHEET_DAYS = 25_569.0
#: Unix times in seconds stay below this for 3000 years: gaps of larger times have no unit.
UNIX_MAX_S = 1e11
#: A source ends early if it does so by this time, s, by this fraction of the recording and by so
#: many times its longest gap; shorter recordings are not examined, s.
ENDS_MIN_S, ENDS_MIN, ENDS_GAPS, ENDS_SPAN_MIN_S = 30.0, 0.02, 3.0, 300.0
#: A larger missing fraction is an error, if there were so many aircraft that not all have landed.
ENDS_MISSING_MAX, ENDS_AIRCRAFT_MIN = 1.0 / 3.0, 5
#: At a cut, so many aircraft are seen in this time, s, and this fraction of their usual number: of
#: fewer, each may have entered or left the coverage, or have landed. Plots without identity that
#: are farther apart than this are of several aircraft, m. Times that the usual number is taken at.
_CUT_S, _CUT_AIRCRAFT_MIN, _CUT_USUAL_MIN = 30.0, 5, 0.6
_APART_M, _USUAL_TIMES = 20_000.0, 15


def check_times(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return sources with times as HHMMSS, else those without a time in common with most others."""
    digits = [name for name in sorted(sources) if _are_digits(sources[name])]
    if digits:
        return [_of_digits(name) for name in digits]
    groups = _groups(sources)
    if len(groups) < 2:
        return []
    most = max(
        groups,
        key=lambda names: (
            len(names), _are_unix(sources, names), sum(sources[one].read for one in names),
        ),
    )  # fmt: skip
    rest = first_and_last(sources, most)
    alike = [
        names
        for names in groups
        if len(names) == len(most) and _are_unix(sources, names) == _are_unix(sources, most)
    ]
    if len(alike) == 2 == len(groups):
        return [_times_of_either(sources, *alike)]
    return [
        _times_differ(name, first_and_last(sources, [name]), rest)
        for name in sorted(one for names in groups if names is not most for one in names)
    ]


# Whether the digits of times are those of hours, minutes and seconds: none has 60 to 99 seconds or
# minutes. Days before it may have been added.
def _are_digits(source: Source) -> bool:
    time_s = source.plots()["time_s"].to_numpy()
    whole = np.floor(time_s[np.isfinite(time_s)])
    if len(whole) < _DIGITS_MIN or not np.ptp(whole) >= _DIGITS_SPAN:
        return False
    for days in range(3):
        value = whole - DAY_S * (np.floor(whole.min() / DAY_S) - days)
        seconds, minutes = value % 100.0, value // 100.0 % 100.0
        if (seconds < 60.0).all() and (minutes < 60.0).all() and value.max() < 240_000.0:
            return len(np.unique(seconds)) >= _DIGITS_SECONDS
    return False


def _of_digits(name: str) -> Diagnosis:
    return Diagnosis(
        name,
        TIME_UNIT,
        f"{name}: its times are probably hours, minutes and seconds as one number (HHMMSS): none "
        "has 60 to 99 in the last two digits of its seconds of the day, or in the two before; "
        "convert them to seconds",
    )


# Whether times are seconds since 1970: those without a date or in another unit are wrong.
def _are_unix(sources: Mapping[str, Source], names: Sequence[str]) -> bool:
    return DATELESS_MAX_S <= first_and_last(sources, names)[0] < UNIX_MAX_S


# Two groups of as many sources do not show which one is wrong, or whether the later ones replaced
# the others: in a pause of less than an hour, unless both groups are off by the same whole hours.
def _times_of_either(
    sources: Mapping[str, Source], first: Sequence[str], later: Sequence[str]
) -> Diagnosis:
    spans = [first_and_last(sources, names) for names in (first, later)]
    apart_s, ends_apart_s = (spans[1][one] - spans[0][one] for one in (0, 1))
    hours = round(apart_s / HOUR_S)
    zone = abs(apart_s - HOUR_S * hours) <= ZONE_WITHIN_S
    # Aircraft may leave one of them earlier.
    shifted = zone and abs(ends_apart_s - apart_s) <= _ENDS_WITHIN_S
    by = "from another day or time zone"
    if zone:
        days = hours // 24 if hours % 24 == 0 else 0
        by = f"{f'{days} d' if days else f'{hours} h'} off"
    them = " and ".join(listed(sorted(names)) for names in (first, later))
    from_to = ", ".join(
        f"{listed(sorted(names))} from {utc(start)} to {utc(end)}"
        for names, (start, end) in zip((first, later), spans, strict=True)
    )
    if spans[1][0] - spans[0][1] < HOUR_S and not shifted:
        return Diagnosis(
            "",
            TIMES_APART,
            f"{them} have no time in common ({from_to}): probably one replaced the other; they are "
            "not compared, check that the recording is complete",
            "warning",
        )
    return Diagnosis(
        "",
        TIMES_APART,
        f"{them} have no time in common, and there is no other sensor to decide which is wrong: "
        f"the clock of one is probably {by} ({from_to}); correct its times, or exclude the sensor",
    )


def check_ends(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return the sources that end long before the others, or start long after them.

    A radar that is switched off ends alone: a warning. If all sources of a kind end together and
    more than a third of the time is missing, a file is probably truncated: an error.

    Parameters
    ----------
    sources : mapping of str to Source
        The sources, by name.
    """
    timed = {name: one for name, one in sources.items() if one.last_s > one.first_s}
    if len(timed) < 2:
        return []
    # Radars have clutter before the first aircraft, which reports of positions start with.
    spans = np.array([_of_aircraft(one) for one in timed.values()])
    first_s, last_s = float(spans[:, 0].min()), float(spans[:, 1].max())
    whole_s = last_s - first_s
    if whole_s < ENDS_SPAN_MIN_S or last_s >= UNIX_MAX_S:
        return []
    early = {
        name: one
        for name, one in timed.items()
        if last_s - one.last_s > _pause_max_s(one, whole_s)
        and one.first_s - first_s <= _pause_max_s(one, whole_s)
        and _is_cut(one, one.last_s - _CUT_S)
    }
    found = []
    for group in _ended_together(early, whole_s):
        names = _with_few_aircraft(timed, group, whole_s, last_s)
        kinds = {kind_of(timed[one]) for one in names}
        same = [one for one in timed if kind_of(timed[one]) in kinds and one not in names]
        missing = (last_s - max(timed[one].last_s for one in names)) / whole_s
        traffic = any(_aircraft(timed[one]) >= ENDS_AIRCRAFT_MIN for one in names)
        cut = not same and missing > ENDS_MISSING_MAX and traffic
        rest = [one for one in timed if one not in early and one not in names]
        found.append(_ends(timed, names, rest, missing, "error" if cut else "warning"))
    late = [
        name
        for name, one in timed.items()
        if one.first_s - first_s > _pause_max_s(one, whole_s)
        and last_s - one.last_s <= _pause_max_s(one, whole_s)
        and _is_cut(one, one.first_s)
    ]
    return [*found, *(_starts(timed, name) for name in sorted(late))]


# Whether a source has its usual traffic at one of its ends: a radar that sees its last aircraft
# leave, or its first ones enter, ends or starts there, too.
def _is_cut(source: Source, from_s: float) -> bool:
    plots = source.plots()
    found = _aircraft_from(plots, from_s)
    if found == 0:
        # Later plots are not retained.
        return True
    first_s, last_s = plots["time_s"].to_numpy()[[0, -1]]
    times = np.linspace(first_s, max(last_s - _CUT_S, first_s), _USUAL_TIMES)
    usual = float(np.median([_aircraft_from(plots, one) for one in times.tolist()]))
    return found >= max(_CUT_AIRCRAFT_MIN, _CUT_USUAL_MIN * usual)


def _aircraft_from(plots: pl.DataFrame, from_s: float) -> int:
    beside = plots.filter(pl.col("time_s").is_between(from_s, from_s + _CUT_S))
    unnamed = beside.filter(pl.all_horizontal(pl.col(_NAMES).is_null()))
    where = positions(plots_of(unnamed), None if unnamed["range_m"].is_null().all() else _SITE)
    return _names_in(beside) + _places(where[np.isfinite(where).all(axis=1)])


# Number of places that are far from each other.
def _places(where: Floats) -> int:
    count = 0
    while len(where):
        where = where[np.linalg.norm(where - where[0], axis=1) > _APART_M]
        count += 1
    return count


def _names_in(plots: pl.DataFrame) -> int:
    return max((plots[name].drop_nulls().n_unique() for name in _NAMES), default=0)


def _of_aircraft(source: Source) -> tuple[float, float]:
    first_s, last_s = source.named_s
    return (first_s, last_s) if last_s > first_s else (source.first_s, source.last_s)


def _starts(sources: Mapping[str, Source], name: str) -> Diagnosis:
    rest = [one for one in sources if one != name]
    return Diagnosis(
        name,
        "starts_late",
        f"{name}: its measurements start at {utc(sources[name].first_s)}, while those of "
        f"{listed(rest)} start at {utc(first_and_last(sources, rest)[0])}: switched on later, or a "
        "file is missing; check that the recording is complete",
        "warning",
    )


# Time without measurements that is usual for a source, s.
def _pause_max_s(source: Source, whole_s: float) -> float:
    return max(ENDS_MIN_S, ENDS_MIN * whole_s, ENDS_GAPS * source.gap_s)


def _ended_together(early: Mapping[str, Source], whole_s: float) -> list[list[str]]:
    groups: list[list[str]] = []
    for name in sorted(early, key=lambda one: (early[one].last_s, one)):
        apart_s = early[name].last_s - early[groups[-1][-1]].last_s if groups else np.inf
        if apart_s > _pause_max_s(early[name], whole_s):
            groups.append([])
        groups[-1].append(name)
    return [sorted(names) for names in groups]


# Also the sources that end with the others of a group, but with too few aircraft to end one.
def _with_few_aircraft(
    timed: Mapping[str, Source], group: Sequence[str], whole_s: float, last_s: float
) -> list[str]:
    end_s = max(timed[one].last_s for one in group)
    few = [
        name
        for name, one in timed.items()
        if name not in group
        and last_s - one.last_s > _pause_max_s(one, whole_s)
        and abs(one.last_s - end_s) <= _pause_max_s(one, whole_s)
    ]
    return sorted([*group, *few])


def kind_of(source: Source) -> str:
    """Return the kind of the measurements of a source; empty without any."""
    return next((str(part["kind"][0]) for part in source.kept if len(part)), "")


def _aircraft(source: Source) -> int:
    return _names_in(source.plots())


def _ends(
    sources: Mapping[str, Source],
    names: Sequence[str],
    rest: Sequence[str],
    missing: float,
    severity: Severity,
) -> Diagnosis:
    end_s = max(sources[one].last_s for one in names)
    them = "its" if len(names) == 1 else "their"
    cause = "a truncated file, or sensors that were switched off"
    remedy = "check that the recording is complete"
    if severity == "error":
        cause, remedy = "probably a truncated file", "copy the file again"
    elif len(names) == 1:
        cause = "switched off, or a truncated file"
    return Diagnosis(
        names[0] if len(names) == 1 else "",
        "ends_early",
        f"{listed(names)}: {them} measurements end at {utc(end_s)}, while those of {listed(rest)} "
        f"continue until {utc(first_and_last(sources, rest)[1])} ({missing:.0%} of the recording): "
        f"{cause}; {remedy}",
        severity,
    )


def utc(time_s: float) -> str:
    """Return a time as text: UTC, or the time of day where there is no date."""
    if abs(time_s) < DATELESS_MAX_S:
        day, rest = divmod(time_s, 86_400.0)
        text = str(timedelta(seconds=int(rest)))
        return f"{text} (no date)" if day == 0.0 else f"{text} of day {int(day)} (no date)"
    try:
        return datetime.fromtimestamp(time_s, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    except (OverflowError, OSError, ValueError):
        return f"{time_s:g} s"


# Sources grouped by time; gaps between groups are larger than the data clock may jump.
def _groups(sources: Mapping[str, Source]) -> list[list[str]]:
    groups: list[list[str]] = []
    end_s = -np.inf
    timed = [name for name, source in sources.items() if np.isfinite(source.first_s)]
    for name in sorted(timed, key=lambda one: sources[one].first_s):
        if sources[name].first_s - end_s > GAP_MIN_S:
            groups.append([])
        groups[-1].append(name)
        end_s = max(end_s, sources[name].last_s)
    return groups


def _times_differ(name: str, own: tuple[float, float], rest: tuple[float, float]) -> Diagnosis:
    later = own[0] - rest[0]
    spans = (
        f"its measurements are from {utc(own[0])} to {utc(own[1])}, the measurements of the other "
        f"sensors from {utc(rest[0])} to {utc(rest[1])}"
    )
    code = TIMES_APART
    if unit := _unit(own[0], rest[0]):
        cause, remedy = f"its times are probably in {unit}", "convert them to seconds"
    elif unit := _unit_of_day(own, rest):
        code = TIME_UNIT
        cause, remedy = f"its times of day are probably in {unit}", "convert them to seconds"
    elif unit := _unit_of_day(rest, own):
        code = TIME_UNIT
        cause = f"the times of day of the other sensors are probably in {unit}"
        remedy = "convert them to seconds"
    elif abs(own[0]) < DATELESS_MAX_S <= abs(rest[0]):
        cause, remedy = "its times probably lack the date", "add the date"
    elif abs(rest[0]) < DATELESS_MAX_S <= abs(own[0]):
        cause = "its times have a date, but the times of the other sensors do not"
        remedy = "use the same time format for all sensors"
    else:
        cause, remedy = _shift(later), "correct its times, or exclude the sensor"
    return Diagnosis(name, code, f"{name}: {cause}: {spans}; {remedy}")


# The unit in which a time is another one, s; days of a spreadsheet count from 1899-12-30.
def _unit(own: float, rest_s: float) -> str:
    if abs(rest_s) >= DATELESS_MAX_S and abs(own - rest_s / DAY_S - _SPREADSHEET_DAYS) <= 1.0:
        return "days since 1899-12-30, as spreadsheets count them"
    if rest_s == 0.0:
        return ""
    units = PER_SECOND | {"hours": 1.0 / 3600.0, "days": 1.0 / DAY_S}
    return next((name for name, per_s in units.items() if 0.99 < own / rest_s / per_s < 1.01), "")


# The unit of times of day with a date, by their first and their last one.
def _unit_of_day(own: tuple[float, float], rest_s: tuple[float, float]) -> str:
    day, units = np.floor(rest_s[0] / DAY_S) * DAY_S, {"minutes": 60.0, "hours": 3600.0}
    (first, last), (first_s, last_s) = ((one[0] - day, one[1] - day) for one in (own, rest_s))
    for name, seconds in units.items():
        # Sensors that start together are as far apart as their first measurements.
        if all(
            time > 0.0 and abs(seconds * time - time_s) <= _TOGETHER_S
            for time, time_s in ((first, first_s), (last, last_s))
        ):
            return name
    return ""


def _shift(later_s: float) -> str:
    sense = "ahead" if later_s > 0.0 else "behind"
    hours = later_s / 3600.0
    if abs(later_s - 3600.0 * round(hours)) > ZONE_WITHIN_S:
        return "its times are probably from another day or time zone"
    if round(hours) % 24 == 0:
        return f"its times are probably from another day ({abs(round(hours)) // 24} d {sense})"
    return f"its clock is probably {abs(round(hours))} h {sense} (another time zone?)"
