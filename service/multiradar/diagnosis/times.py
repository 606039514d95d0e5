"""Sources whose times are not those of the others: another day, another zone, no date."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta

import numpy as np

from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.names import first_and_last

#: Times below this are times of day without a date, s.
DATELESS_MAX_S = 10.0 * 86_400.0
#: Sources that are farther apart in time than the data clock may jump share none, s.
GAP_MIN_S = 600.0
#: Offsets that are so near whole hours are those of zones, s.
ZONE_WITHIN_S = 120.0


def times_amiss(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return the sources that share no time with the others, by name."""
    names = [name for name, source in sources.items() if np.isfinite(source.first_s)]
    found = []
    for name in sorted(names):
        others = [one for one in names if one != name]
        rest = _most(sources, others)
        own = first_and_last(sources, [name])
        if not rest or _overlap(own, first_and_last(sources, rest)):
            continue
        # Of two that share no time, the one with fewer measurements is named.
        if len(rest) > 1 or sources[rest[0]].read > sources[name].read:
            found.append(_apart(name, own, first_and_last(sources, rest)))
    return found


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


def _most(sources: Mapping[str, Source], names: list[str]) -> list[str]:
    """Return the sources that share the time of the largest."""
    if not names:
        return []
    largest = max(names, key=lambda one: sources[one].read)
    span = first_and_last(sources, [largest])
    return [one for one in names if _overlap(first_and_last(sources, [one]), span)]


def _overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] - GAP_MIN_S <= other[1] and other[0] - GAP_MIN_S <= one[1]


def _apart(name: str, own: tuple[float, float], rest: tuple[float, float]) -> Diagnosis:
    later = own[0] - rest[0]
    says = (
        f"its measurements are from {utc(own[0])} to {utc(own[1])}, those of the others from "
        f"{utc(rest[0])} to {utc(rest[1])}"
    )
    if abs(own[0]) < DATELESS_MAX_S <= abs(rest[0]):
        cause, remedy = "its times probably lack the date", "add the date"
    elif abs(rest[0]) < DATELESS_MAX_S <= abs(own[0]):
        cause, remedy = "its times have a date, those of the others do not", "use one form of time"
    else:
        cause, remedy = _shift(later), "correct its times, or leave it out"
    return Diagnosis(name, "times_apart", f"{name}: {cause}: {says}; {remedy}")


def _shift(later_s: float) -> str:
    way = "ahead" if later_s > 0.0 else "behind"
    hours = later_s / 3600.0
    if abs(later_s - 3600.0 * round(hours)) > ZONE_WITHIN_S:
        return "its times are probably of another day or zone"
    if round(hours) % 24 == 0:
        return f"its times are probably of another day ({abs(round(hours)) // 24} d {way})"
    return f"its clock is probably {abs(round(hours))} h {way} (another time zone?)"
