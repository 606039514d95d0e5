"""Gaps of half a day or more: jumps of the times, recordings of several days, and outages."""

from collections.abc import Mapping

import numpy as np

from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.times import (
    DATELESS_MAX_S,
    DAY_S,
    GAP_MIN_S,
    HOUR_S,
    TIMES_JUMP,
    UNIX_MAX_S,
    kind_of,
    utc,
)

#: Gaps of a recording are reported from this on, s: some airports close for the night.
GAP_MAX_S = 12.0 * HOUR_S
#: Tolerance of a jump by whole days: time without measurements about it, s.
JUMP_WITHIN_S = 120.0
#: Times of day are recorded until and from midnight, s.
MIDNIGHT_WITHIN_S = 60.0
#: Number of measurements that show how far they are apart.
_APART_MIN = 100
#: Fraction of a gap in which others may have none, either.
_SHARED_MAX = 0.5


def check_outages(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return the sources with a gap in which others continue: a sensor that was switched off.

    Parameters
    ----------
    sources : mapping of str to Source
        The sources, by name.
    """
    off = _off(sources, _with_gap(sources))
    return [_outage(sources[name], name, others) for name, others in sorted(off.items())]


def _outage(source: Source, name: str, others: list[str]) -> Diagnosis:
    return Diagnosis(
        name,
        "pause",
        f"{name} has no measurements from {utc(source.gap_from_s)} to "
        f"{utc(source.gap_from_s + source.gap_s)} ({source.gap_s / HOUR_S:.1f} h), in which "
        f"{listed(others)} continue{'s' if len(others) == 1 else ''}: switched off, or a file is "
        "missing; check that the recording is complete",
        "warning",
    )


# Sources that were switched off, with those that continue. Beside others of the same period, one
# whose times jump starts or ends at another time.
def _off(sources: Mapping[str, Source], gaps: Mapping[str, Source]) -> dict[str, list[str]]:
    found = {}
    for name, one in gaps.items():
        others = [other for other in sources if other != name and _continues(sources[other], one)]
        if others and (
            one.first_s >= min(sources[other].first_s for other in others) - HOUR_S
            and one.last_s <= max(sources[other].last_s for other in others) + HOUR_S
        ):
            found[name] = sorted(others)
    return found


# Whether another source has measurements before, in most of and after the gap of one.
def _continues(other: Source, one: Source) -> bool:
    to_s = one.gap_from_s + one.gap_s
    if not other.first_s <= one.gap_from_s < to_s <= other.last_s:
        return False
    if not other.gap_s:
        return True
    end_s = min(to_s, other.gap_from_s + other.gap_s)
    shared_s = end_s - max(one.gap_from_s, other.gap_from_s)
    return shared_s <= _SHARED_MAX * one.gap_s


def _with_gap(sources: Mapping[str, Source]) -> dict[str, Source]:
    return {
        name: source
        for name, source in sources.items()
        if source.gap_s >= GAP_MAX_S and source.first_s < UNIX_MAX_S and not _are_apart(source)
    }


def check_gaps(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return jumps of the times of a recording by whole days, and gaps of half a day or more.

    Parameters
    ----------
    sources : mapping of str to Source
        The sources, by name; of those of `check_outages`, none.
    """
    gaps = _with_gap(sources)
    off = _off(sources, gaps)
    jumped = {name: one for name, one in gaps.items() if name not in off}
    if not jumped:
        return []
    wrapped = sorted(name for name, one in jumped.items() if _wraps(one))
    if wrapped:
        return [_wrap(name) for name in ([""] if len(wrapped) == len(sources) else wrapped)]
    of_all = len(jumped) == len(sources)
    names = [""] if of_all else sorted(jumped)
    positions = all(kind_of(one) in ("adsb", "mlat") for one in sources.values() if one.read)
    return [
        _jump(name, jumped[name] if name else _longest(jumped), positions=positions)
        for name in names
    ]


# Whether all measurements are far apart, as times in another unit are.
def _are_apart(source: Source) -> bool:
    times = np.sort(source.plots()["time_s"].drop_nulls().to_numpy())
    return len(times) > _APART_MIN and float(np.median(np.diff(times))) >= GAP_MIN_S


# Whether times of day begin again at midnight.
def _wraps(source: Source) -> bool:
    to_s = source.gap_from_s + source.gap_s
    return 0.0 <= source.first_s < MIDNIGHT_WITHIN_S and (
        source.gap_from_s < to_s <= source.last_s < DAY_S < source.last_s + MIDNIGHT_WITHIN_S
    )


def _wrap(name: str) -> Diagnosis:
    return Diagnosis(
        name,
        TIMES_JUMP,
        f"{f'{name}: its' if name else 'the'} times probably start again from 0 at midnight: they "
        "are times of day without a date, before and after midnight; add the date, or 86 400 s to "
        "the times after midnight",
    )


def _longest(sources: Mapping[str, Source]) -> Source:
    return max(sources.values(), key=lambda one: one.gap_s)


# Archives of reported positions often contain parts of several days.
def _jump(name: str, source: Source, *, positions: bool) -> Diagnosis:
    head = f"{name}: its" if name else "the"
    spans = f"from {utc(source.gap_from_s)} to {utc(source.gap_from_s + source.gap_s)}"
    days = round(source.gap_s / DAY_S)
    if days and abs(source.gap_s - days * DAY_S) <= JUMP_WITHIN_S:
        many = "a day" if days == 1 else f"{days} days"
        return Diagnosis(
            name,
            TIMES_JUMP,
            f"{head} times probably jump by {many}, {spans}: a wrong date, or a day counted twice; "
            "correct the times after the jump",
        )
    gap = f"{head} measurements have a gap of {source.gap_s / HOUR_S:.1f} h, {spans}"
    if positions and source.first_s >= DATELESS_MAX_S:
        return Diagnosis(
            name,
            TIMES_JUMP,
            f"{gap}: each day has tracks of its own; track each day separately where they are to "
            "be evaluated separately",
            "warning",
        )
    return Diagnosis(
        name,
        TIMES_JUMP,
        f"{gap}: probably recordings of different days, or wrong dates; convert and track each day "
        "separately",
    )
