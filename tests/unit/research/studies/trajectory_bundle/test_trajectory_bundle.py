"""The trajectory-bundle study: each step, the defect of the report's search, and its remedy."""

import numpy as np
import pytest

from multiradar.research.studies.result import StudyOptions, StudyResult
from multiradar.research.studies.trajectory_bundle import study as trajectory_bundle
from multiradar.research.studies.trajectory_bundle.plots import DRAWN
from multiradar.research.studies.trajectory_bundle.runs import Run, one_run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    return []


@pytest.fixture(scope="module")
def result(runs: list[Run]) -> StudyResult:
    def kept(rng: np.random.Generator) -> Run:
        runs.append(one_run(rng))
        return runs[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trajectory_bundle, "one_run", kept)
        return trajectory_bundle.run(StudyOptions(runs=2, seed=1), lambda _done, _total: None)


def number(result: StudyResult, step: str, name: str) -> float:
    (row,) = [row for row in result.rows if step in str(row["step"])]
    value = row[name]
    assert isinstance(value, float)
    return value


def test_figures_of_the_report_are_drawn(result: StudyResult) -> None:
    named = {plot.name: plot for plot in result.plots}
    assert {"figure-2-1", "figure-2-2", "figure-2-3", "figure-2-4"} <= set(named)
    assert len(named) == len(result.plots) == 2 * len(DRAWN) + 2
    for _, name, _ in DRAWN:
        for plot in (named[name], named[f"{name}-flight"]):
            assert plot.equal_axes
            labels = {one.label for one in plot.series}
            assert {"tracks", "best track", "true path", "plots"} <= labels


def test_the_whole_s_is_seen_and_every_end_about_the_last_plot(result: StudyResult) -> None:
    named = {plot.name: plot for plot in result.plots}
    (flown,) = [one for one in named["service-flight"].series if one.label == "true path"]
    # 120 s at 180 m/s, from 10 km west on, 40 km north; initial and final course: east.
    assert flown.x[0] == pytest.approx(-10.0)
    assert 20.0 < flown.x[-1] - flown.x[0] < 21.6
    assert flown.y[-1] - flown.y[0] > 2.0
    assert flown.y[-1] == pytest.approx(flown.y[-2], abs=1e-6)
    for name in ("figure-2-3", "figure-2-4"):
        plots = next(one for one in named[name].series if one.label == "plots")
        assert (plots.x[-1], plots.y[-1]) == (0.0, 0.0)


def test_a_branch_leaves_its_track_and_leads_to_the_plot(result: StudyResult) -> None:
    """Figure 2.1: identical before the branch point, closer to the plot at the end."""
    plot = next(one for one in result.plots if one.name == "figure-2-1")
    track, branch = plot.series[:2]
    assert (track.label, branch.label) == ("track", "branch")
    assert [branch.x[0], branch.y[0]] == pytest.approx([track.x[0], track.y[0]], abs=1e-6)
    assert np.hypot(branch.x[-1], branch.y[-1]) < np.hypot(track.x[-1], track.y[-1])


def test_accelerations_are_drawn_beside_those_flown(result: StudyResult) -> None:
    plot = next(one for one in result.plots if one.name == "lateral-acceleration")
    *found, flown = plot.series
    assert [one.label for one in found] == [
        "best track after the search", "best track of the service", "mean track of the service",
    ]  # fmt: skip
    assert flown.label == "true"
    assert set(flown.y.tolist()) == {0.0, -2.0, 2.0}
    for one in found:
        assert np.nanmax(np.abs(one.y)) <= 4.0


def test_branching_adds_tracks_and_thinning_leaves_the_best(result: StudyResult) -> None:
    assert number(result, "after branching", "tracks") > number(result, "before the last", "tracks")
    assert number(result, "after thinning", "tracks") <= 16.0
    assert number(result, "after thinning", "misfit") == number(result, "branching", "misfit")


def test_the_search_fits_better_and_ends_at_the_plot(result: StudyResult) -> None:
    published = "as printed"
    assert number(result, published, "misfit") < number(result, "after branching", "misfit")
    assert number(result, published, "evaluations") > 100.0
    searched = number(result, published, "end_from_plot_sigma")
    assert searched < number(result, "after branching", "end_from_plot_sigma")


def test_by_weight_alone_tracks_become_the_same(result: StudyResult) -> None:
    """Section 2.2.3: the reason for groups, which are 20 m apart by construction."""
    assert number(result, "weight alone", "tracks") > 10.0
    assert number(result, "weight alone", "scatter_m") < 10.0
    assert number(result, "before the last", "scatter_m") > 20.0


def test_the_scatter_of_the_initial_window_goes_with_the_search(result: StudyResult) -> None:
    """Section 2.7.1."""
    after = number(result, "as printed", "scatter_m")
    assert after < 0.5 * number(result, "arcs through triples", "scatter_m")


def test_all_variants_of_the_report_are_run(result: StudyResult) -> None:
    """Section 2.7.2: none of the three brings the best track as close as the bundle."""
    ours = number(result, "the bundle:", "best_apart_m")
    for step in ("segment of 20 s", "weighs a quarter", "a dimple"):
        assert number(result, step, "evaluations") > 100.0
        assert number(result, step, "best_apart_m") > ours


def test_the_bundle_is_closer_to_the_truth(result: StudyResult) -> None:
    ours, published = (
        number(result, step, "best_apart_m") for step in ("the bundle:", "as printed")
    )
    assert ours < published


@pytest.mark.usefixtures("result")
def test_the_same_seed_gives_the_same(runs: list[Run]) -> None:
    again = one_run(np.random.Generator(np.random.PCG64([1, 1])))
    other, expected = runs
    np.testing.assert_array_equal(again.plots.position_m, expected.plots.position_m)
    assert not np.array_equal(other.plots.position_m, expected.plots.position_m)
    for one, before in zip(again.pictures, expected.pictures, strict=True):
        np.testing.assert_array_equal(one.positions_m, before.positions_m)
        assert (one.misfit, one.evaluations) == (before.misfit, before.evaluations)
