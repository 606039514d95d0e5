"""Messages for a reference of another time or area than the tracks."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import InputError
from multiradar.evaluation.overlap import (
    check_matched,
    check_times,
    cut_short,
    mostly_unknown,
    outside,
    rarely_matched,
)
from multiradar.geodesy.system_plane import SystemPlane
from support.scenarios.skies import Row, reference_of, straight, tracks_of

DAY_S = 86_400.0
#: 2018-08-01 08:00:00 UTC.
BEGIN_S = 1_533_110_400.0


def _flight(begin_s: float, span_s: float = 600.0, east_m: float = 0.0) -> list[Row]:
    return straight(np.arange(begin_s, begin_s + span_s, 10.0).tolist(), east_m, 0.0, 0.0, 0.0)


def _times(own_s: float, known_s: float, span_s: float = 600.0) -> str:
    tracks = tracks_of({1: _flight(own_s, span_s)})
    reference = reference_of({"a": _flight(known_s, span_s)})
    with pytest.raises(InputError) as fault:
        check_times(tracks, reference)
    return str(fault.value)


def test_both_times_are_reported_in_utc() -> None:
    picture = _times(BEGIN_S, BEGIN_S + 4000.0)
    assert picture == (
        "tracks and reference do not overlap in time: tracks 2018-08-01 08:00:00 UTC to "
        "2018-08-01 08:09:50 UTC; reference 2018-08-01 09:06:40 UTC to 2018-08-01 09:16:30 UTC; "
        "another recording, or a wrong day (--date of `convert`)?"
    )


@pytest.mark.parametrize(
    ("own_s", "known_s", "advice"),
    [
        (BEGIN_S, BEGIN_S + DAY_S + 60.0, "the reference is 1 day after the tracks: wrong day"),
        (BEGIN_S, BEGIN_S - 3 * DAY_S, "the reference is 3 days before the tracks: wrong day"),
        (BEGIN_S, BEGIN_S + 2 * 3600.0, "the times differ by 2 h: another time zone"),
        (BEGIN_S, 28_800.0, "the reference contains only times of day: convert the recording with"),
        (28_800.0, BEGIN_S, "the tracked recording contains only times of day: convert"),
    ],
)
def test_advice_is_given(own_s: float, known_s: float, advice: str) -> None:
    assert advice in _times(own_s, known_s)


def test_adjacent_times_are_accepted() -> None:
    tracks = tracks_of({1: _flight(BEGIN_S, 610.0)})
    check_times(tracks, reference_of({"a": _flight(BEGIN_S + 600.0)}))


def test_tracks_without_any_match_are_reported_with_both_areas() -> None:
    tracks = tracks_of({1: _flight(BEGIN_S)})
    reference = reference_of({"a": _flight(BEGIN_S, east_m=90_000.0)})
    with pytest.raises(InputError) as fault:
        check_matched(tracks, reference, np.full(60, -1), 2000.0)
    assert str(fault.value) == (
        "no track comes within 2000 m (--gate) of a reference aircraft at any time: "
        "tracks 2018-08-01 08:00:00 UTC to 2018-08-01 08:09:50 UTC, latitude 45.84° to 45.84°, "
        "longitude 5.73° to 5.73°; reference 2018-08-01 08:00:00 UTC to 2018-08-01 08:09:50 UTC, "
        "latitude 45.83° to 45.83°, longitude 6.89° to 6.89°; another recording, area or time zone?"
    )
    check_matched(tracks, reference, np.array([-1, 3, -1]), 2000.0)


def test_an_area_across_the_antimeridian_is_narrow() -> None:
    """Regression: it reached from 179.9° W to 179.9° E."""
    plane = SystemPlane(np.radians(-17.0), np.pi)
    found = replace(reference_of({"a": _flight(BEGIN_S)}), plane=plane)
    moved = tracks_of({1: [(BEGIN_S, -10e3, 0.0, 0.0, 0.0), (BEGIN_S, 10e3, 0.0, 0.0, 0.0)]})
    with pytest.raises(InputError) as fault:
        check_matched(moved, found, np.full(60, -1), 2000.0)
    assert "longitude 179.91° to -179.91°; reference" in str(fault.value)
    assert "longitude -180.00° to -180.00°;" in str(fault.value)


@pytest.mark.parametrize(("part", "sentences"), [(0.49, 0), (0.5, 1)])
def test_most_of_a_reference_outside_the_time_of_the_tracks_is_reported(
    part: float, sentences: int
) -> None:
    reference = reference_of({"a": _flight(BEGIN_S, 1000.0)})
    tracks = tracks_of({1: _flight(BEGIN_S, 1000.0 * (1.0 - part))})
    picture = outside(tracks, reference, 2000.0)
    assert len(picture) == sentences
    assert all("lies outside the time span of the tracks" in one for one in picture)


@pytest.mark.parametrize(("east_m", "sentences"), [(1999.0, 0), (2001.0, 1)])
def test_most_of_a_reference_outside_the_area_of_the_tracks_is_reported(
    east_m: float, sentences: int
) -> None:
    flights = {"a": _flight(BEGIN_S), "b": _flight(BEGIN_S, east_m=east_m)}
    picture = outside(tracks_of({1: flights["a"]}), reference_of(flights), 2000.0)
    assert len(picture) == sentences
    assert all("50% of the reference lies outside the area" in one for one in picture)


def test_another_time_is_not_reported_as_another_area_too() -> None:
    reference = reference_of({"a": _flight(BEGIN_S), "b": _flight(BEGIN_S + 700.0, east_m=9e4)})
    (picture,) = outside(tracks_of({1: _flight(BEGIN_S)}), reference, 2000.0)
    assert "outside the time span of the tracks" in picture


def test_rarely_matched_aircraft_give_a_warning() -> None:
    assert rarely_matched(np.array([7, -1]), 2.0) == []
    (said,) = rarely_matched(np.array([7, -1, -1, -1]), 2.0)
    assert said == (
        "the reference aircraft have a track within 2 m (--gate) for only 25% of their time: "
        "another recording, or a gate that is too small?"
    )


@pytest.mark.parametrize(("followed", "sentences"), [(3, 1), (4, 0), (8, 0)])
def test_a_reference_without_most_of_the_aircraft_is_reported(
    followed: int, sentences: int
) -> None:
    track = np.repeat(np.arange(8), 10)
    aircraft_of = np.where(track < followed, 5, -1)
    found = mostly_unknown(track, aircraft_of, followed)
    assert len(found) == sentences
    assert all(f"most tracks ({8 - followed} of 8) match none of the" in one for one in found)
    assert all("use --partial if the reference is incomplete" in one for one in found)


def test_a_few_spurious_tracks_are_no_incomplete_reference() -> None:
    assert mostly_unknown(np.arange(4), np.array([1, -1, -1, -1]), 1) == []


@pytest.mark.parametrize(
    ("begin_s", "span_s", "words"),
    [
        (0.0, 300.0, "the reference ends at 2018-08-01 08:04:50 UTC, but the tracks are from"),
        (300.0, 300.0, "the reference starts at 2018-08-01 08:05:00 UTC, but the tracks are from"),
    ],
)
def test_the_mistake_of_a_reference_cut_short_is_reported(
    begin_s: float, span_s: float, words: str
) -> None:
    tracks = tracks_of({1: _flight(BEGIN_S)})
    (found,) = cut_short(tracks, reference_of({"a": _flight(BEGIN_S + begin_s, span_s)}))
    assert words in found
    assert "51% of their time cannot be evaluated" in found


def test_a_reference_that_nearly_spans_the_tracks_is_not_cut() -> None:
    tracks = tracks_of({1: _flight(BEGIN_S)})
    assert cut_short(tracks, reference_of({"a": _flight(BEGIN_S + 30.0, 540.0)})) == []


@pytest.mark.parametrize(
    ("tracks", "matched", "known"), [(5, 0, True), (4, 0, False), (10, 4, True), (10, 5, False)]
)
def test_a_reference_is_incomplete_for_most_of_five_tracks(
    tracks: int, matched: int, *, known: bool
) -> None:
    aircraft_of = np.where(np.arange(tracks) < matched, 0, -1)
    assert bool(mostly_unknown(np.arange(tracks), aircraft_of, 3)) is known


@pytest.mark.parametrize(
    ("span_s", "missing_s", "known"),
    [
        # A tenth of the time, and a minute.
        (1000.0, 100.0, False),
        (1000.0, 110.0, True),
        (300.0, 60.0, False),
        (300.0, 70.0, True),
    ],
)
@pytest.mark.parametrize("at_end", [True, False])
def test_a_reference_is_cut_from_a_minute_and_a_tenth_on(
    span_s: float, missing_s: float, *, at_end: bool, known: bool
) -> None:
    tracks = tracks_of({1: _flight(BEGIN_S, span_s + 10.0)})
    begin_s = BEGIN_S if at_end else BEGIN_S + missing_s
    reference = reference_of({"a": _flight(begin_s, span_s + 10.0 - missing_s)})
    assert bool(cut_short(tracks, reference)) is known
