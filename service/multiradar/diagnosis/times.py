"""Sources whose times differ from the others: another day, another time zone, no date."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta

import numpy as np

from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.names import first_and_last

#: Times below this are times of day without a date, s.
DATELESS_MAX_S = 10.0 * 86_400.0
#: Sources separated by more than the data clock may jump have no common time, s.
GAP_MIN_S = 600.0
#: Offsets this close to whole hours are attributed to time zones, s.
ZONE_WITHIN_S = 120.0


def check_times(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return the sources that have no time in common with most others, by name."""
    groups = _groups(sources)
    if len(groups) < 2:
        return []
    most = max(groups, key=lambda names: (len(names), sum(sources[one].read for one in names)))
    rest = first_and_last(sources, most)
    return [
        _times_differ(name, first_and_last(sources, [name]), rest)
        for name in sorted(one for names in groups if names is not most for one in names)
    ]


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
        f"its measurements are from {utc(own[0])} to {utc(own[1])}, those of the others from "
        f"{utc(rest[0])} to {utc(rest[1])}"
    )
    if abs(own[0]) < DATELESS_MAX_S <= abs(rest[0]):
        cause, remedy = "its times probably lack the date", "add the date"
    elif abs(rest[0]) < DATELESS_MAX_S <= abs(own[0]):
        cause, remedy = "its times have a date, those of the others do not", "use one form of time"
    else:
        cause, remedy = _shift(later), "correct its times, or exclude it"
    return Diagnosis(name, "times_apart", f"{name}: {cause}: {spans}; {remedy}")


def _shift(later_s: float) -> str:
    sense = "ahead" if later_s > 0.0 else "behind"
    hours = later_s / 3600.0
    if abs(later_s - 3600.0 * round(hours)) > ZONE_WITHIN_S:
        return "its times are probably of another day or zone"
    if round(hours) % 24 == 0:
        return f"its times are probably of another day ({abs(round(hours)) // 24} d {sense})"
    return f"its clock is probably {abs(round(hours))} h {sense} (another time zone?)"
