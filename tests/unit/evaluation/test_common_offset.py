"""An offset that all tracks have in common from the reference, in position or in time."""

from collections.abc import Callable

import numpy as np
import pytest

from multiradar.evaluation.common_offset import common_offset, time_offset
from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.update_errors import UpdateErrors, errors_of_updates
from multiradar.evaluation.settings import EvaluationSettings
from support.scenarios.skies import reference_of, straight, tracks_of

TIMES_S = np.arange(0.0, 600.0, 10.0)
SETTINGS = EvaluationSettings(settling_s=0.0)
COURSES = ((200.0, 0.0), (0.0, 180.0), (-150.0, 100.0), (90.0, -170.0), (-200.0, -20.0))

Offset = Callable[[int], tuple[float, float]]


def errors(offset: Offset, aircraft: int = 5) -> UpdateErrors:
    """Return the errors of aircraft whose tracks are displaced, with 30 m of noise."""
    rng = np.random.default_rng(3)
    known, found = {}, {}
    for number in range(aircraft):
        east_m, north_m = 20_000.0 * number, -8000.0 * number
        flight = straight(TIMES_S.tolist(), east_m, north_m, *COURSES[number])
        known[f"a{number}"] = flight
        off = np.array(offset(number)) + rng.normal(0.0, 30.0, (len(flight), 2))
        found[number] = [
            (t, x + dx, y + dy, *rest)
            for (t, x, y, *rest), (dx, dy) in zip(flight, off.tolist(), strict=True)
        ]
    tracks = tracks_of(found)
    return errors_of_updates(tracks, reference_of(known), tracks.track, SETTINGS)


@pytest.mark.parametrize(
    ("east_m", "north_m", "words", "dominates"),
    [
        (300.0, 400.0, "m to the north-east of the reference (+", True),
        (-100.0, 0.0, "m to the west of the reference (-", False),
        (0.0, -300.0, "to the south of the reference", True),
    ],
)
def test_a_displaced_reference_is_named(
    east_m: float, north_m: float, words: str, *, dominates: bool
) -> None:
    found = common_offset(errors(lambda _: (east_m, north_m)))
    assert found is not None
    assert words in found.sentence
    assert found.dominates == dominates
    size_m = float(found.sentence.partition(" m to the")[0].rpartition(" ")[2])
    assert size_m == pytest.approx(np.hypot(east_m, north_m), abs=10.0)


@pytest.mark.parametrize(
    "offset",
    [
        lambda _: (0.0, 0.0),
        lambda _: (20.0, 20.0),
        # Along the course: a clock.
        lambda number: (3.0 * COURSES[number][0], 3.0 * COURSES[number][1]),
        # An azimuth offset displaces aircraft by their distance.
        lambda number: (0.0, 400.0 * (number - 1)),
    ],
)
def test_errors_that_differ_between_aircraft_are_no_common_offset(offset: Offset) -> None:
    assert common_offset(errors(offset)) is None


def test_few_aircraft_show_no_common_offset() -> None:
    assert common_offset(errors(lambda _: (500.0, 0.0), aircraft=3)) is None


# Courses apart, so that no track comes near another aircraft.
@pytest.mark.parametrize(
    ("late_s", "words"),
    [
        (18.0, "18.0 s ahead of those of the tracks (GPS time instead of UTC?)"),
        (-37.0, "37.0 s behind those of the tracks"),
        (3600.0, "3600.0 s (about 1 h) ahead of those of the tracks: another time zone?"),
        (1.0, None),
        (500.0, None),
    ],
)
def test_a_late_reference_is_named_with_its_offset(late_s: float, words: str | None) -> None:
    times_s, known, found = np.arange(0.0, 7200.0, 12.0), {}, {}
    for number, course in enumerate(COURSES):
        found[number] = straight(times_s.tolist(), 90_000.0 * number, 0.0, *course)
        known[f"a{number}"] = [(row[0] + late_s, *row[1:]) for row in found[number]]
    instants = assign_tracks(tracks_of(found), reference_of(known), SETTINGS)
    said = time_offset(instants, SETTINGS.gate_m)
    assert (said is not None) == (words is not None)
    if said is not None:
        assert f"the times of the reference are probably {words}" in said
        assert "have a track within 2000 m (--gate) for 100% of their time (" in said
