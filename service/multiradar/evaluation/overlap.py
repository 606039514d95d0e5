"""Checks that tracks and reference overlap in time and area, with advice if they do not."""

from dataclasses import dataclass

import numpy as np

from multiradar.errors import InputError
from multiradar.evaluation.trajectories import Flags, Floats, Indices, Reference, Tracks
from multiradar.geodesy.longitudes import median_longitude
from multiradar.report.times import is_dated, time_text

#: Fraction of the reference outside the time or area of the tracks that gives a warning.
OUTSIDE_MIN = 0.5
#: Fraction of the aircraft's time with a track below which there is a warning, too.
MATCHED_MIN = 0.5
#: ... and below which there is no evaluation: such matches are those of any other recording.
BARELY_MIN = 0.05
#: Time of the tracks without a reference at an end that gives a warning, as a fraction, and s.
CUT_MIN, CUT_MIN_S = 0.1, 60.0
#: Fewer tracks show no incomplete reference.
TRACKS_MIN = 5
#: Times this near to whole hours apart suggest another time zone, s.
_ZONE_WITHIN_S = 300.0
_HOUR_S, _DAY_S = 3600.0, 86_400.0


@dataclass(frozen=True, slots=True)
class _Span:
    first_s: float
    last_s: float

    def __str__(self) -> str:
        return f"{time_text(self.first_s)} to {time_text(self.last_s)}"

    def meets(self, other: "_Span", later_s: float = 0.0) -> bool:
        begins_before = self.first_s + later_s <= other.last_s
        return begins_before and other.first_s <= self.last_s + later_s


def check_times(tracks: Tracks, reference: Reference) -> None:
    """Reject a reference that does not overlap the tracks in time.

    Parameters
    ----------
    tracks : Tracks
        The tracks to evaluate.
    reference : Reference
        What is known.

    Raises
    ------
    InputError
        With both times and advice.
    """
    own, known = _span(tracks.time_s), _span(reference.time_s)
    if own.meets(known):
        return
    msg = (
        f"tracks and reference do not overlap in time: tracks {own}; reference {known}; "
        f"{_advice(own, known)}"
    )
    raise InputError(msg)


def check_matched(
    tracks: Tracks, reference: Reference, track_of: Indices, gate_m: float, why: str | None = None
) -> None:
    """Reject an evaluation in which no track ever matches an aircraft of the reference.

    Parameters
    ----------
    tracks, reference : Tracks, Reference
        Tracks and reference.
    track_of : (n,) int64
        Track assigned to each aircraft at each instant; −1 for none.
    gate_m : float
        Association radius, m.
    why : str, optional
        The cause, if it is known.

    Raises
    ------
    InputError
        With times and areas of both, or with the cause.
    """
    if np.any(track_of >= 0):
        return
    if why is not None:
        raise InputError(why)
    msg = (
        f"no track comes within {gate_m:.12g} m (--gate) of a reference aircraft at any time: "
        f"tracks {_span(tracks.time_s)}, {_area(tracks.position_m, reference)}; reference "
        f"{_span(reference.time_s)}, {_area(reference.position_m, reference)}; another recording, "
        "area or time zone?"
    )
    raise InputError(msg)


def outside(tracks: Tracks, reference: Reference, gate_m: float) -> list[str]:
    """Return warnings where most of a reference lies outside the tracks.

    Parameters
    ----------
    tracks, reference : Tracks, Reference
        Tracks and reference.
    gate_m : float
        Association radius, m.

    Returns
    -------
    list of str
        Empty where less than `OUTSIDE_MIN` of its positions lies outside.
    """
    own, known = _span(tracks.time_s), _span(reference.time_s)
    late = (reference.time_s < own.first_s) | (reference.time_s > own.last_s)
    low = tracks.position_m.min(axis=0) - gate_m
    high = tracks.position_m.max(axis=0) + gate_m
    place = reference.position_m
    away: Flags = np.any((place < low) | (place > high), axis=1) & ~late
    sentences = []
    if late.mean() >= OUTSIDE_MIN:
        sentences.append(
            f"{late.mean():.0%} of the reference lies outside the time span of the tracks: tracks "
            f"{own}; reference {known}; aircraft count as missed there"
        )
    if away.mean() >= OUTSIDE_MIN:
        sentences.append(
            f"{away.mean():.0%} of the reference lies outside the area of the tracks: tracks "
            f"{_area(tracks.position_m, reference)}; reference {_area(place, reference)}; "
            "aircraft count as missed there"
        )
    return sentences


def cut_short(tracks: Tracks, reference: Reference) -> list[str]:
    """Return a warning where the reference lacks a part of the time of the tracks.

    Parameters
    ----------
    tracks, reference : Tracks, Reference
        Tracks and reference.

    Returns
    -------
    list of str
        Empty where less than `CUT_MIN` and `CUT_MIN_S` of their time is missing at an end.
    """
    own, known = _span(tracks.time_s), _span(reference.time_s)
    least_s = max(CUT_MIN * (own.last_s - own.first_s), CUT_MIN_S)
    sentences = []
    for missing_s, what in (
        (own.last_s - known.last_s, f"ends at {time_text(known.last_s)}"),
        (known.first_s - own.first_s, f"starts at {time_text(known.first_s)}"),
    ):
        if missing_s > least_s:
            part = missing_s / (own.last_s - own.first_s)
            sentences.append(
                f"the reference {what}, but the tracks are from {own}: {part:.0%} of their time "
                "cannot be evaluated; is the reference truncated?"
            )
    return sentences


def rarely_matched(track_of: Indices, gate_m: float, least: float = MATCHED_MIN) -> list[str]:
    """Return a sentence where the aircraft of a reference have a track for little of their time.

    Parameters
    ----------
    track_of : (n,) int64
        Track assigned to each aircraft at each instant; −1 for none.
    gate_m : float
        Association radius, m.
    least : float
        The fraction of their time from which on there is none.

    Returns
    -------
    list of str
        Empty from `least` on.
    """
    fraction = float(np.mean(track_of >= 0))
    if fraction >= least:
        return []
    return [
        f"the reference aircraft have a track within {gate_m:.12g} m (--gate) for only "
        f"{fraction:.0%} of their time: another recording, or a gate that is too small?"
    ]


def mostly_unknown(track: Indices, aircraft_of: Indices, aircraft: int) -> list[str]:
    """Return a warning where most tracks follow no aircraft of the reference.

    Parameters
    ----------
    track, aircraft_of : (k,) int64
        Tracks alive at an instant, and the row of the aircraft assigned to each; −1 for none.
    aircraft : int
        Number of aircraft of the reference.

    Returns
    -------
    list of str
        Empty where at least `MATCHED_MIN` of the tracks follow one, and of fewer than
        `TRACKS_MIN` tracks.
    """
    tracks, matched = len(np.unique(track)), len(np.unique(track[aircraft_of >= 0]))
    if tracks < TRACKS_MIN or matched >= MATCHED_MIN * tracks:
        return []
    return [
        f"most tracks ({tracks - matched} of {tracks}) match none of the {aircraft} reference "
        "aircraft and count as false; use --partial if the reference is incomplete"
    ]


def _span(time_s: Floats) -> _Span:
    return _Span(float(time_s.min()), float(time_s.max()))


def _advice(own: _Span, known: _Span) -> str:
    dated = is_dated(own.last_s), is_dated(known.last_s)
    if dated[0] != dated[1]:
        which = "the reference" if dated[0] else "the tracked recording"
        return f"{which} contains only times of day: convert the recording with --date YYYY-MM-DD"
    later_s = known.first_s - own.first_s
    days = round(later_s / _DAY_S)
    if days and own.meets(known, days * _DAY_S):
        order = "after" if days > 0 else "before"
        count = f"{abs(days)} day{'' if abs(days) == 1 else 's'}"
        return f"the reference is {count} {order} the tracks: wrong day (--date of `convert`)?"
    hours = round(later_s / _HOUR_S)
    if abs(later_s - hours * _HOUR_S) <= _ZONE_WITHIN_S and 0 < abs(hours) <= 14:
        return f"the times differ by {abs(hours)} h: another time zone, or another recording?"
    return "another recording, or a wrong day (--date of `convert`)?"


def _area(position_m: Floats, reference: Reference) -> str:
    latitude, longitude = reference.plane.to_geodetic(position_m[:, 0], position_m[:, 1])
    south, north = np.degrees([latitude.min(), latitude.max()])
    middle = median_longitude(longitude)
    away = np.mod(longitude - middle + np.pi, 2.0 * np.pi) - np.pi
    # From -180° to 180°, also where they cross the antimeridian.
    ends = middle + np.array([away.min(), away.max()])
    west, east = np.degrees(np.mod(ends + np.pi, 2.0 * np.pi) - np.pi)
    return f"latitude {south:.2f}° to {north:.2f}°, longitude {west:.2f}° to {east:.2f}°"
