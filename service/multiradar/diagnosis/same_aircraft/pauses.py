"""Pauses of the recording, and jumps of the times, by the aircraft before and after them.

An aircraft that flies on in the time without measurements shows that they are missing; if it is
near the place where it was, the times have jumped.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.evidence import BEFORE_S, Source
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import KEYS, Floats, Plots, plots_of, reported
from multiradar.diagnosis.times import TIMES_JUMP, utc

#: Time without measurements of any source that is reported, s; shorter ones from the second on
#: where aircraft fly on.
PAUSE_MIN_S, FLOWN_MIN_S = 300.0, 90.0
#: Time before and after, s, in which so many aircraft, and this fraction of those before, are seen.
_BESIDE_S, _SAME_AIRCRAFT_MIN, _SAME_MIN = 60.0, 3, 0.5
#: So few aircraft may all have left, and others come later.
_MINIMUM_MAX = 8
#: Measurements in a second, just before a gap, of traffic that does not end at once.
_RATE_MIN = 5.0
#: The times have jumped if aircraft have flown for less than this fraction of the gap.
_FLOWN_MAX = 0.1
#: Time in which a speed is measured, s, and slower aircraft, m/s.
_SPEED_S, _SPEED_MIN_MPS = 8.0, 40.0
_HOUR_S, _WITHIN_S = 3600.0, 60.0
#: Time between the plots of an aircraft on both sides of a jump, s.
_JOINT_S = 15.0


class _Gap(NamedTuple):
    from_s: float
    to_s: float


#: A gap; the time for which aircraft have flown in it, s; NaN. Where the times go back: a gap, the
#: time from which on aircraft fly on, s, and the time at which they are before it, s.
_Jump = tuple[_Gap, float, float]


def check_pauses(sources: Mapping[str, Source]) -> list[Diagnosis]:
    """Return pauses of all sources, and jumps of the times of some or all.

    Parameters
    ----------
    sources : mapping of str to Source
        The sources, by name.
    """
    timed = {name: one for name, one in sources.items() if one.last_s > one.first_s}
    if not timed:
        return []
    jumped = {name: jumps for name, one in timed.items() if (jumps := _jumps(one))}
    if jumped:
        return _of_jumps(jumped, of_all=_are_all(timed, jumped))
    return [one for gap in _common(timed) if (one := _pause(timed, gap)) is not None]


# Whether the others pause at the jumps of some, and have no aircraft to show it.
def _are_all(timed: Mapping[str, Source], jumped: Mapping[str, list[_Jump]]) -> bool:
    gaps = [gap for jumps in jumped.values() for gap, _, _ in jumps]
    return all(
        name in jumped
        or any(
            own.from_s < gap.to_s and gap.from_s < own.to_s for own in _gaps(one) for gap in gaps
        )
        for name, one in timed.items()
    )


def _of_jumps(
    jumped: Mapping[str, list[_Jump]], *, of_all: bool
) -> list[Diagnosis]:  # fmt: skip
    if of_all:
        longest = max(jumped.values(), key=lambda one: (len(one), bool(np.isfinite(one[0][2]))))
        return [_jump("", *one) for one in longest]
    return [_jump(name, *one) for name, jumps in jumped.items() for one in jumps[:1]]


def _jump(name: str, gap: _Gap, flown_s: float, back_from_s: float) -> Diagnosis:
    if np.isfinite(back_from_s):
        return _jump_back(name, gap, back_from_s, flown_s)
    by, why = _amount(gap.to_s - gap.from_s - flown_s)
    return Diagnosis(
        name,
        TIMES_JUMP,
        f"{f'{name}: its' if name else 'the'} times probably jump by {by}, from "
        f"{utc(gap.from_s)} to {utc(gap.to_s)}: in between, aircraft have flown for about "
        f"{max(flown_s, 0.0):.0f} s only ({why}); convert the times to UTC, or correct those after "
        "the jump",
    )


# Amount and cause of a jump of the times.
def _amount(later_s: float) -> tuple[str, str]:
    hours = round(later_s / _HOUR_S)
    if hours and abs(later_s - hours * _HOUR_S) <= _WITHIN_S:
        return f"{hours} h", "local times at a change of daylight saving time?"
    return f"{later_s:.0f} s", "a clock that was set, or wrong times in a part of the recording"


def _jump_back(name: str, gap: _Gap, from_s: float, to_s: float) -> Diagnosis:
    by, why = _amount(from_s - to_s)
    return Diagnosis(
        name,
        TIMES_JUMP,
        f"{f'{name}: its' if name else 'the'} times probably go back by {by}, from {utc(from_s)} "
        f"to {utc(to_s)}: aircraft fly on from the end of the part from {utc(gap.to_s)} to the "
        f"start of that until {utc(gap.from_s)} ({why}); convert the times to UTC, or correct "
        "those after the jump",
    )


def _gaps(source: Source) -> list[_Gap]:
    return [_Gap(from_s, from_s + length_s) for from_s, length_s in sorted(source.gaps.items())]


# Gaps after which aircraft are where they were, with the time for which they have flown, s.
def _jumps(source: Source) -> list[_Jump]:
    gaps = [one for one in _gaps(source) if one.to_s - one.from_s >= PAUSE_MIN_S]
    if not gaps:
        return []
    plots = plots_of(source.plots())
    found = []
    for gap in gaps:
        flown_s = _flown_s(plots, gap)
        if len(flown_s) < _SAME_AIRCRAFT_MIN:
            continue
        middle_s = float(np.median(flown_s))
        back = _back(plots, gap)
        if back is not None:
            found.append((gap, *back))
        elif middle_s <= _FLOWN_MAX * (gap.to_s - gap.from_s):
            found.append((gap, middle_s, np.nan))
    return found


# The first time before a gap and the last one after it, where aircraft fly on from the last to the
# first: the clock was set back, and the rows were sorted.
def _back(plots: Plots, gap: _Gap) -> tuple[float, float] | None:
    first_s, last_s = float(plots.time_s[0]), float(plots.time_s[-1])
    earlier = plots.time_s <= gap.from_s
    turned = np.where(earlier, plots.time_s + last_s - first_s, plots.time_s)
    order = np.argsort(turned, kind="stable")
    joined = replace(plots.select(order), time_s=turned[order])
    # Those of the last and the first scan.
    flown_s = _flown_s(joined, _Gap(last_s - _JOINT_S, last_s))
    flown_s = [one for one in flown_s if np.isfinite(one)]
    if len(flown_s) < _SAME_AIRCRAFT_MIN or not float(np.median(flown_s)) <= 3.0 * _JOINT_S:
        return None
    return first_s, last_s


# How long aircraft must have flown to be where they are after a gap, s, for each that is known.
def _flown_s(plots: Plots, gap: _Gap) -> list[float]:
    east, north = _level(plots)
    found = []
    for before, after in _beside(plots, gap).values():
        last = before[-1]
        first = next(
            (one for one in before if plots.time_s[last] - plots.time_s[one] <= 30.0), last
        )
        apart_s = plots.time_s[last] - plots.time_s[first]
        if apart_s < _SPEED_S:
            continue
        moved = np.hypot(east[last] - east[first], north[last] - north[first])
        across = np.hypot(east[after[0]] - east[last], north[after[0]] - north[last])
        if moved >= _SPEED_MIN_MPS * apart_s:
            found.append(float(across / moved * apart_s))
    return found


# Rows of each aircraft before and after a gap, by time.
def _beside(plots: Plots, gap: _Gap) -> dict[int, tuple[list[int], list[int]]]:
    key = next((one for one in range(len(KEYS)) if (plots.keys[:, one] >= 0).any()), 0)
    before = (plots.time_s >= gap.from_s - _BESIDE_S) & (plots.time_s <= gap.from_s)
    after = (plots.time_s >= gap.to_s) & (plots.time_s <= gap.to_s + _BESIDE_S)
    found: dict[int, tuple[list[int], list[int]]] = {}
    for side, chosen in enumerate((before, after)):
        for row in np.flatnonzero(chosen).tolist():
            name = int(plots.keys[row, key])
            if name >= 0:
                found.setdefault(name, ([], []))[side].append(row)
    return {name: one for name, one in found.items() if one[0] and one[1]}


# Positions on a plane: about the radar without its site, or of the columns.
def _level(plots: Plots) -> tuple[Floats, Floats]:
    if np.isfinite(plots.range_m).any():
        azimuth = np.radians(plots.azimuth_deg)
        return plots.range_m * np.sin(azimuth), plots.range_m * np.cos(azimuth)
    where = reported(plots)
    middle = where[np.flatnonzero(np.isfinite(where).all(axis=1))[:1]]
    up = middle[0] / np.linalg.norm(middle[0]) if len(middle) else np.array([0.0, 0.0, 1.0])
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= max(float(np.linalg.norm(east)), 1e-9)
    return where @ east, where @ np.cross(up, east)


# Times in which no source has measurements.
def _common(timed: Mapping[str, Source]) -> Sequence[_Gap]:
    common: list[_Gap] = []
    for number, one in enumerate(timed.values()):
        own = [_Gap(-np.inf, one.first_s), *_gaps(one), _Gap(one.last_s, np.inf)]
        both = own if number == 0 else [
            _Gap(max(first.from_s, other.from_s), min(first.to_s, other.to_s))
            for first in common
            for other in own
        ]  # fmt: skip
        common = [gap for gap in both if gap.to_s - gap.from_s >= FLOWN_MIN_S]
    return [gap for gap in common if np.isfinite([gap.from_s, gap.to_s]).all()]


def _pause(timed: Mapping[str, Source], gap: _Gap) -> Diagnosis | None:
    flown = _is_flown(timed, gap)
    if not flown and (
        gap.to_s - gap.from_s < PAUSE_MIN_S or len(timed) < 2 or _is_minimum(timed, gap)
    ):
        return None
    cause = "probably a missing file, or a recorder that was stopped"
    if flown:
        cause = f"{flown}: a part of the recording is missing"
    who = "no sensor has" if len(timed) > 1 else f"{listed([*timed])} has no"
    return Diagnosis(
        "",
        "pause",
        f"{who} measurements from {utc(gap.from_s)} to {utc(gap.to_s)}: {cause}; check that the "
        "recording is complete",
        "error" if flown else "warning",
    )


# Whether the traffic before or after a gap is so small that it may have ended: all plots are those
# of few aircraft, and none is clutter, which never ends.
def _is_minimum(timed: Mapping[str, Source], gap: _Gap) -> bool:
    few = []
    for side in (_Gap(gap.from_s - _BESIDE_S, gap.from_s), _Gap(gap.to_s, gap.to_s + _BESIDE_S)):
        most, unnamed = 0, 0
        for source in timed.values():
            plots = plots_of(source.plots())
            chosen = (plots.time_s >= side.from_s) & (plots.time_s <= side.to_s)
            names = plots.keys[chosen].max(axis=1)
            most = max(most, len(np.unique(names[names >= 0])))
            unnamed += int(np.count_nonzero(names < 0))
        few.append(0 < most <= _MINIMUM_MAX and unnamed == 0)
    return any(few)


# Why aircraft flew in a gap; empty where this is not certain.
def _is_flown(timed: Mapping[str, Source], gap: _Gap) -> str:
    most, seen = 0, 0
    for source in timed.values():
        plots = plots_of(source.plots())
        beside = _beside(plots, gap)
        seen = max(seen, _aircraft_before(plots, gap))
        most = max(most, len(beside))
    if most >= _SAME_AIRCRAFT_MIN and most >= _SAME_MIN * seen:
        return f"{most} aircraft fly before and after it"
    ends = [float(one.plots()["time_s"].to_numpy().max(initial=-np.inf)) for one in timed.values()]
    rate = sum(_before(one, gap) for one in timed.values()) / BEFORE_S
    # The plots of later times are not retained.
    if max(ends) < gap.from_s and rate >= _RATE_MIN:
        return f"there are at least {rate:.0f} measurements per second just before it"
    return ""


# Measurements of a source just before a gap.
def _before(source: Source, gap: _Gap) -> int:
    return sum(
        count for from_s, count in source.before.items()
        if gap.from_s - BEFORE_S <= from_s <= gap.from_s
    )  # fmt: skip


def _aircraft_before(plots: Plots, gap: _Gap) -> int:
    key = next((one for one in range(len(KEYS)) if (plots.keys[:, one] >= 0).any()), 0)
    chosen = (plots.time_s >= gap.from_s - _BESIDE_S) & (plots.time_s <= gap.from_s)
    names = np.unique(plots.keys[chosen, key])
    return int(np.count_nonzero(names >= 0))
