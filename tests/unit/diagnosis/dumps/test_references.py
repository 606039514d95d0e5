"""Track rows that reference plots which are not in the dump."""

from typing import Any

import pytest

from multiradar.diagnosis.dumps.references import check_references

PLOTS, TRACKS = "plots.txt", "tracks.txt"


def report(missing: int, named: int = 1000, **figures: Any) -> dict[str, Any]:
    """Return a report of a conversion with so many missing plots."""
    return {
        "settings": {"multiradar_source": 240},
        "figures": {
            "files": {PLOTS: {"table": "plots"}, TRACKS: {"table": "tracks"}},
            "tracks_written": {"126_mr": 3, "135_mr": 3, "240_mr": 3, "26_r": 3},
            "track_rows_naming_a_plot": named,
            "track_rows_whose_plot_is_missing": missing,
            **figures,
        },
    }


@pytest.mark.parametrize("missing", [0, 10, 500])
def test_some_missing_plots_are_no_mistake(missing: int) -> None:
    assert check_references(report(missing), ["26", "35"]) == []


def test_sources_that_differ_are_named() -> None:
    (found,) = check_references(report(1000), ["26", "35"])
    assert found.severity == "error"
    assert found.sentence.startswith("tracks.txt: 100% of the plots that its 1 000 rows reference")
    assert "its sources are 126, 135, but the sources of plots.txt are 26, 35;" in found.sentence


def test_numbers_that_differ_are_named_where_the_sources_agree() -> None:
    (found,) = check_references(report(600), ["126", "135"])
    assert "60% of the plots" in found.sentence
    assert "the plot numbers or the times of the two files differ" in found.sentence


def test_a_sensor_of_tracks_without_plots_is_a_warning() -> None:
    found = check_references(report(0, sensors_without_plots=["26-110"]), ["26"])
    assert [(one.sensor_id, one.severity) for one in found] == [("26-110", "warning")]
    assert "plots.txt contains none of its plots" in found[0].sentence
