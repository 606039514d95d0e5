"""The study of bundles shows each step, the defect of the report's search, and that it is gone."""

import pytest

from multiradar.studies import trajectory_bundle
from multiradar.studies.result import StudyOptions, StudyResult
from multiradar.studies.trajectory_bundle_plots import DRAWN


@pytest.fixture(scope="module")
def result() -> StudyResult:
    return trajectory_bundle.run(StudyOptions(runs=2, seed=1), lambda _done, _total: None)


def number(result: StudyResult, step: str, name: str) -> float:
    (row,) = [row for row in result.rows if step in str(row["step"])]
    value = row[name]
    assert isinstance(value, float)
    return value


def test_figures_of_the_report_are_drawn(result: StudyResult) -> None:
    names = [plot.name for plot in result.plots]
    assert {"figure-2-2", "figure-2-3", "figure-2-4"} <= set(names)
    assert len(names) == len(DRAWN)
    for plot in result.plots:
        assert plot.equal_axes
        assert {one.label for one in plot.series} == {"tracks", "best track", "true path", "plots"}


def test_branching_adds_tracks_and_thinning_leaves_the_best(result: StudyResult) -> None:
    assert number(result, "after branching", "tracks") > number(result, "before the last", "tracks")
    assert number(result, "after thinning", "tracks") <= 16.0
    assert number(result, "after thinning", "misfit") == number(result, "branching", "misfit")


def test_the_search_fits_better_and_ends_at_the_plot(result: StudyResult) -> None:
    printed = "as printed"
    assert number(result, printed, "misfit") < number(result, "after branching", "misfit")
    assert number(result, printed, "evaluations") > 100.0
    searched = number(result, printed, "end_from_plot_sigma")
    assert searched < number(result, "after branching", "end_from_plot_sigma")


def test_the_bundle_is_closer_to_the_truth(result: StudyResult) -> None:
    ours, printed = (number(result, step, "best_apart_m") for step in ("the bundle:", "as printed"))
    assert ours < printed


def test_the_same_seed_gives_the_same(result: StudyResult) -> None:
    again = trajectory_bundle.run(StudyOptions(runs=2, seed=1), lambda _done, _total: None)
    assert again.rows == result.rows
