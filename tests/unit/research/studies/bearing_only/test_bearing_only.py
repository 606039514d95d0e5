"""The study of bearings only: gains over places made first, and honest covariances."""

import numpy as np
import pytest

from multiradar.research.studies.bearing_only import study as bearing_only
from multiradar.research.studies.bearing_only.runs import (
    SCENARIOS,
    Bearings,
    Filtered,
    Scenario,
    fused,
    simulate_bearings,
)
from multiradar.research.studies.result import StudyOptions, StudyResult

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return bearing_only.run(StudyOptions(runs=60, seed=3), lambda _done, _total: None)


@pytest.fixture
def without_position_fixes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the study report the tracks by bearings in place of those by position fixes.

    They take most of its time; the band of the tracks by bearings does not depend on them.
    """
    last: list[Filtered] = []

    def kept(bearings: Bearings) -> Filtered:
        last[:] = [fused(bearings)]
        return last[0]

    monkeypatch.setattr(bearing_only, "fused", kept)
    monkeypatch.setattr(bearing_only, "triangulated", lambda _bearings, **_: last[0])


def _value(result: StudyResult, scenario: str, scheme: str, quantity: str) -> float:
    wanted = {"scene": scenario, "scheme": scheme, "quantity": quantity, "time_s": None}
    (row,) = (row for row in result.rows if all(row[name] == one for name, one in wanted.items()))
    return float(row["value"] or 0.0)


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_all_scenarios_but_one_have_three_sources(scenario: Scenario) -> None:
    bearings = simulate_bearings(scenario, 2, 60.0, np.random.default_rng(1))
    expected = [0, 1] if scenario.name == "two" else [0, 1, 2]
    assert np.unique(bearings.source).tolist() == expected
    assert ("two sensors" in scenario.purpose) == (scenario.name == "two")


@pytest.mark.parametrize("scenario", ["turning", "two", "moving", "space"])
def test_errors_of_position_fixes_are_at_least_one_and_a_half_times_as_large(
    result: StudyResult, scenario: str
) -> None:
    assert _value(result, scenario, "places", "position_gain") >= 1.5
    assert _value(result, scenario, "places led on", "position_gain") > 0.95


def test_places_of_what_some_sources_miss_are_worse_in_both(result: StudyResult) -> None:
    """The paper reports 1.5 to 2 for both; here 1.2 to 2.8, depending on the missed detections."""
    for scheme in ("places", "places led on"):
        for name in ("position_gain", "velocity_gain"):
            assert _value(result, "missed", scheme, name) > 1.15
    assert _value(result, "missed", "places", "position_gain") > 1.5


def test_where_all_look_at_once_both_ways_say_the_same(result: StudyResult) -> None:
    """Three lines and their crossing hold the same information: within 10 %."""
    assert _value(result, "at once", "places", "position_gain") == pytest.approx(1.0, abs=0.1)


def test_velocities_are_found_sooner_from_bearings(result: StudyResult) -> None:
    """The paper reports 1.5 to 2 for velocities too: half a minute after the start there is some.

    From 60 s on there is less, 1.1 to 1.2, where no source misses the aircraft.
    """
    early = {
        row["scheme"]: float(row["value"] or 0.0)
        for row in result.rows
        if row["scene"] == "turning" and row["quantity"] == "velocity_rms_mps"
        and row["time_s"] is not None and 25.0 < float(row["time_s"]) < 30.0
    }  # fmt: skip
    assert early["places led on"] > 1.4 * early["bearings"]
    assert early["places"] > 1.2 * early["bearings"]
    for scheme in ("places", "places led on"):
        assert _value(result, "turning", scheme, "velocity_gain") > 1.0


def test_errors_and_geometry_are_drawn(result: StudyResult) -> None:
    named = {plot.name: plot for plot in result.plots}
    assert list(named) == ["position", "velocity", "nees", "geometry"]
    for name in ("position", "velocity"):
        labels = [one.label for one in named[name].series]
        assert labels == ["bearings", "position fixes", "extrapolated position fixes"]
    assert named["geometry"].equal_axes


@pytest.mark.parametrize("scenario", [scenario.name for scenario in SCENARIOS])
def test_the_filter_is_consistent(result: StudyResult, scenario: str) -> None:
    """The mean of one run has a sigma of 0.42, its times go together: of 60 runs four sigma."""
    assert _value(result, scenario, "bearings", "nees") == pytest.approx(1.0, abs=0.22)
    assert _value(result, scenario, "bearings", "nees_inside") > 0.6
    assert _value(result, scenario, "bearings", "crossing") > 3.0


@pytest.mark.usefixtures("without_position_fixes")
def test_the_band_over_all_times_counts_runs_and_holds_as_often_as_it_says() -> None:
    """Five seeds of twenty runs, seven scenes: 95 % of 35 less three sigma of the binomial.

    Times of a run are correlated: a scenario was inside the band of each time at 66 to 100 %.
    """
    held = []
    for seed in range(1, 6):
        rows = bearing_only.run(StudyOptions(runs=20, seed=seed), lambda _done, _total: None).rows
        for row in rows:
            if (row["scheme"], row["quantity"], row["time_s"]) == ("bearings", "nees", None):
                assert row["expected"] == 1.0
                low, value, high = (
                    float(row[name] or 0.0) for name in ("band_low", "value", "band_high")
                )
                assert high - low < 0.8
                held.append(low <= value <= high)
    assert len(held) == 5 * len(SCENARIOS)
    assert np.mean(held) >= 0.84


@pytest.mark.usefixtures("without_position_fixes")
def test_one_run_alone_has_no_band() -> None:
    rows = bearing_only.run(StudyOptions(runs=1, seed=1), lambda _done, _total: None).rows
    (row,) = (
        one for one in rows
        if (one["scene"], one["scheme"], one["quantity"], one["time_s"])
        == ("turning", "bearings", "nees", None)
    )  # fmt: skip
    assert (row["expected"], row["band_low"], row["band_high"]) == (1.0, None, None)


def test_every_row_has_the_same_columns(result: StudyResult) -> None:
    assert {tuple(row) for row in result.rows} == {tuple(result.rows[0])}
    assert result.json_object()["options"] == {"runs": 60}
