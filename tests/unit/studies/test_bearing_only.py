"""The study of bearings only: gains over places made first, and honest covariances."""

import pytest

from multiradar.studies import bearing_only
from multiradar.studies.bearing_only_runs import SCENES
from multiradar.studies.result import StudyOptions, StudyResult


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return bearing_only.run(StudyOptions(runs=60, seed=3), lambda _done, _total: None)


def _value(result: StudyResult, scene: str, scheme: str, quantity: str) -> float:
    wanted = {"scene": scene, "scheme": scheme, "quantity": quantity, "time_s": None}
    (row,) = (row for row in result.rows if all(row[name] == one for name, one in wanted.items()))
    return float(row["value"] or 0.0)


@pytest.mark.parametrize("scene", ["turning", "two", "moving", "space"])
def test_places_of_a_turn_are_at_least_one_and_a_half_times_worse(
    result: StudyResult, scene: str
) -> None:
    assert _value(result, scene, "places", "position_gain") >= 1.5
    assert _value(result, scene, "places led on", "position_gain") > 0.95


def test_where_all_look_at_once_both_ways_say_the_same(result: StudyResult) -> None:
    """Three lines and their crossing hold the same information: within 10 %."""
    assert _value(result, "at once", "places", "position_gain") == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("scene", [scene.name for scene in SCENES])
def test_the_filter_is_as_good_as_it_says(result: StudyResult, scene: str) -> None:
    """The mean of one run has a sigma of 0.42, its times go together: of 60 runs four sigma."""
    assert _value(result, scene, "bearings", "nees") == pytest.approx(1.0, abs=0.22)
    assert _value(result, scene, "bearings", "nees_inside") > 0.6
    assert _value(result, scene, "bearings", "crossing") > 3.0


def test_every_row_has_the_same_columns(result: StudyResult) -> None:
    assert {tuple(row) for row in result.rows} == {tuple(result.rows[0])}
    assert result.json_object()["options"] == {"runs": 60}
