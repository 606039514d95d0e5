"""Dumps with one truncated file."""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.dumps.cut_files import check_last_lines, check_truncation

START_S, LAST_S = 28_800.0, 30_600.0


def said_of(
    folder: Path, plots_end_s: float, tracks_end_s: float, *, missing: int = 0, late: int = 1000,
    named: int = 1000,
) -> list[str]:  # fmt: skip
    """Return the diagnoses of a dump with 1000 plots until the earlier of both ends.

    Parameters
    ----------
    folder : Path
        For the table.
    plots_end_s, tracks_end_s : float
        Last times.
    missing : int
        Track rows that name a missing plot, of 1000.
    late : int
        Plots after the end of the tracks, a half hour.
    named : int
        Plots that tracks reference, of 1000.
    """
    early = np.linspace(START_S, min(plots_end_s, tracks_end_s), 1000)
    count = round(late * max(plots_end_s - tracks_end_s, 0.0) / (LAST_S - START_S))
    after = np.linspace(tracks_end_s, plots_end_s, count + 2)[1:] if count else np.empty(0)
    file = folder / "measurements.parquet"
    times = np.concatenate([early, after])
    numbers = [7] * named + [None] * (len(times) - named)
    pl.DataFrame(
        {"time_s": times, "kind": ["radar"] * len(times), "track_number": numbers}
    ).write_parquet(file)
    figures: dict[str, Any] = {
        "files": {
            "p.txt": {"table": "plots", "last_s": plots_end_s},
            "t.txt": {"table": "tracks", "last_s": tracks_end_s},
        },
        "first_s": START_S,
        "track_rows_naming_a_plot": 1000,
        "track_rows_whose_plot_is_missing": missing,
    }
    return [one.sentence for one in check_truncation(file, {"figures": figures})]


def test_plots_that_end_before_the_tracks_that_name_them_are_cut(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, LAST_S - 900.0, LAST_S, missing=500)
    assert said == (
        "p.txt: probably truncated: it ends at 8:15:00 (no date), but t.txt continues until "
        "8:30:00 (no date), with rows that refer to missing plots (50%); copy the file again"
    )


def test_tracks_that_end_before_plots_like_those_they_name_are_cut(tmp_path: Path) -> None:
    (said,) = said_of(tmp_path, LAST_S, LAST_S - 900.0)
    assert said.startswith("t.txt: probably truncated: it ends at 8:15:00 (no date), but p.txt ")


@pytest.mark.parametrize(
    ("earlier_s", "given"),
    [
        # Tracks coast after the last plot.
        ((60.0, 0.0), {"missing": 1000}),
        # Tracks that reference no plots, or existing ones.
        ((900.0, 0.0), {"missing": 0}),
        # The last plots form no track.
        ((0.0, 60.0), {}),
        # The last aircraft has left, clutter continues.
        ((0.0, 900.0), {"late": 100}),
        # Most of it was clutter before, too.
        ((0.0, 900.0), {"named": 400}),
    ],
)
def test_files_that_end_apart_for_other_reasons_are_not_cut(
    tmp_path: Path, earlier_s: tuple[float, float], given: dict[str, int]
) -> None:
    assert said_of(tmp_path, LAST_S - earlier_s[0], LAST_S - earlier_s[1], **given) == []


def test_an_empty_file_of_plots_beside_tracks_is_reported() -> None:
    files: dict[str, dict[str, Any]] = {
        "p.txt": {"table": "plots", "last_s": None, "rejected": 0},
        "t.txt": {"table": "tracks", "last_s": LAST_S},
    }
    (said,) = check_truncation(Path("none"), {"figures": {"files": files}})
    assert (
        said.sentence
        == "p.txt: contains no plots, although the recording has tracks; copy the file again"
    )
    files["p.txt"]["rejected"] = 1
    assert check_truncation(Path("none"), {"figures": {"files": files}}) == []


def test_a_file_that_ends_within_a_line_is_truncated() -> None:
    files: dict[str, dict[str, Any]] = {
        "p.txt": {"table": "plots", "last_s": LAST_S, "rejected_by_code": {"NON_FINITE": 3}},
        "a.txt": {"table": "plots_ads", "last_s": LAST_S, "rejected_by_code": {"TRUNCATED": 1}},
    }
    (said,) = check_last_lines({"figures": {"files": files}})
    assert said.sentence == (
        "a.txt: truncated: it ends in the middle of a line, after 8:30:00 (no date); copy the file "
        "again"
    )
