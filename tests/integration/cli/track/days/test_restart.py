"""Complete days are kept; changed ones are made again; what is wrong is named, the rest goes on."""

import json
import shutil
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.errors import ArgumentError, FindingsError, InputError, OutputExistsError
from multiradar.toolbox.tracking.reprocessing.reprocess import Reprocessed, reprocess
from support.fakes.fake_jobs import FakeJobs
from validation.tracker.archive_days import date_of, write_day

DATES = [date_of(day) for day in range(4)]
Archive = tuple[Path, Path]


@pytest.fixture
def days(archive: Archive, tmp_path: Path) -> Path:
    """Return a copy of two days, which the test may change."""
    for date in DATES[:2]:
        shutil.copytree(archive[0] / date, tmp_path / "days" / date)
    return tmp_path / "days"


def statuses(found: Reprocessed) -> list[str]:
    return [one["status"] for one in found.report["figures"]["days"]]


def failures(folder: Path, sensors: Path, out: Path, **options: Any) -> tuple[str, ...]:
    with pytest.raises(FindingsError) as raised:
        reprocess(folder, sensors, out=out, runner=FakeJobs(), **options)
    return raised.value.findings


@pytest.mark.parametrize("how", ["independent", "chained"])
def test_a_changed_day_is_made_again(
    how: str, days: Path, archive: Archive, tmp_path: Path
) -> None:
    sensors, out = archive[1], tmp_path / "out"
    first = reprocess(days, sensors, out=out, days=how, runner=FakeJobs())
    assert statuses(first) == ["made", "made"]
    jobs = FakeJobs()
    again = reprocess(days, sensors, out=out, days=how, runner=jobs)
    assert (statuses(again), jobs.started) == (["kept", "kept"], [])
    assert again.report["outputs"] == first.report["outputs"]
    assert again.report["figures"]["tests"] == first.report["figures"]["tests"]
    file = days / DATES[0] / "measurements.parquet"
    pl.read_parquet(file)[:-100].write_parquet(file)
    changed = reprocess(days, sensors, out=out, days=how, runner=FakeJobs())
    # A chained day depends on the day before.
    assert statuses(changed) == ["made", "made" if how == "chained" else "kept"]


def test_a_day_that_was_interrupted_is_made_again(
    days: Path, archive: Archive, tmp_path: Path
) -> None:
    """Its output is there, but not the record that is written last."""
    out = tmp_path / "out"
    first = reprocess(days, archive[1], out=out, runner=FakeJobs())
    (out / DATES[1] / "reprocess.json").unlink()
    (out / DATES[1] / "tracks.parquet").write_bytes(b"half")
    again = reprocess(days, archive[1], out=out, runner=FakeJobs())
    assert statuses(again) == ["kept", "made"]
    assert [one["output_sha256"] for one in again.report["figures"]["days"]] == [
        one["output_sha256"] for one in first.report["figures"]["days"]
    ]


def test_other_settings_need_another_output_or_again(
    days: Path, archive: Archive, tmp_path: Path
) -> None:
    sensors, out = archive[1], tmp_path / "out"
    reprocess(days, sensors, out=out, runner=FakeJobs())
    others: dict[str, dict[str, Any]] = {
        "filter_name": {"filter": "two-stage"},
        "chained": {"days": "chained"},
    }
    for name, options in others.items():
        with pytest.raises(OutputExistsError, match=rf"created with different settings \({name}\)"):
            reprocess(days, sensors, out=out, runner=FakeJobs(), **options)
    other = tmp_path / "other.toml"
    other.write_text(sensors.read_text().replace("range_sigma_m = 40.0", "range_sigma_m = 50.0"))
    with pytest.raises(OutputExistsError, match="created with different settings \\(sensors\\)"):
        reprocess(days, other, out=out, runner=FakeJobs())
    jobs = FakeJobs({DATES[1]: "killed"})
    with pytest.raises(FindingsError):
        reprocess(days, sensors, out=out, filter="two-stage", again=True, runner=jobs)
    # The output has the new settings; the day that was not made has not.
    found = reprocess(days, sensors, out=out, filter="two-stage", runner=FakeJobs())
    assert statuses(found) == ["kept", "made"]


def test_a_day_that_cannot_be_read_is_named_and_the_others_go_on(
    days: Path, archive: Archive, tmp_path: Path
) -> None:
    (days / "2026-11-22").mkdir()
    shutil.copytree(days / DATES[0], days / "2026-11-23")
    (days / "2026-11-23" / "measurements.parquet").write_bytes(b"PAR1 cut off")
    out = tmp_path / "out"
    found = failures(days, archive[1], out)
    assert [one.partition(": ")[0] for one in found] == ["2026-11-22", "2026-11-23"]
    assert "was an empty folder" in found[0]
    assert "the file cannot be read" in found[1]
    report = json.loads((out / "report.json").read_text())
    assert [one["status"] for one in report["figures"]["days"]] == ["made"] * 2 + ["failed"] * 2
    assert not (out / "2026-11-23").exists()
    assert pl.read_parquet(out / "drift.parquet")["day"].unique().to_list() == [DATES[1]]


@pytest.mark.parametrize("how", ["independent", "chained"])
def test_days_that_overlap_do_not_count_twice(
    how: str, days: Path, archive: Archive, tmp_path: Path
) -> None:
    shutil.copytree(days / DATES[1], days / "2026-11-22")
    found = failures(days, archive[1], tmp_path / "out", days=how)
    assert len(found) == 1
    assert found[0].startswith("2026-11-22: ")
    assert ("overlap with 2026-11-21 by 2" in found[0]) == (how == "independent")


def test_a_day_of_other_sensors_is_named(days: Path, archive: Archive, tmp_path: Path) -> None:
    file = days / DATES[1] / "measurements.parquet"
    rows = pl.read_parquet(file).with_columns(sensor_id=pl.lit("other-") + pl.col("sensor_id"))
    rows.write_parquet(file)
    found = failures(days, archive[1], tmp_path / "out")
    assert any("2026-11-21: " in one and "UNKNOWN_SENSOR" in one for one in found)
    again = FakeJobs()
    with pytest.raises(FindingsError):
        reprocess(days, archive[1], out=tmp_path / "out", runner=again)
    assert again.started == [DATES[1]]


@pytest.mark.parametrize(("shift_h", "wrong"), [(0.0, False), (-8.0, True), (-96.0, True)])
def test_a_day_under_another_date_is_reported(
    shift_h: float, archive: Archive, tmp_path: Path, *, wrong: bool
) -> None:
    """Dates of folders may be local, of zones up to UTC+14."""
    (tmp_path / "days").mkdir()
    write_day(tmp_path / "days" / "2026-11-21", 0)
    file = tmp_path / "days" / "2026-11-21" / "measurements.parquet"
    rows = pl.read_parquet(file).with_columns(pl.col("time_s") + shift_h * 3600.0)
    rows.write_parquet(file)
    words = "its measurements are not from 2026-11-21, but from 2026-11-"
    if wrong:
        (said,) = failures(tmp_path / "days", archive[1], tmp_path / "out")
    else:
        found = reprocess(tmp_path / "days", archive[1], out=tmp_path / "out", runner=FakeJobs())
        said = found.report["figures"]["days"][0]["warnings"][-1]
    assert words in said
    assert said.endswith("; is the folder named after the local date?") == (not wrong)


def test_times_of_day_cannot_be_compared(days: Path, archive: Archive, tmp_path: Path) -> None:
    file = days / DATES[1] / "measurements.parquet"
    pl.read_parquet(file).with_columns(pl.col("time_s") % 86_400.0).write_parquet(file)
    (found,) = failures(days, archive[1], tmp_path / "out")
    assert found.endswith("the recording has times of day only; convert it with --date 2026-11-21")


def test_a_folder_without_days_says_what_was_looked_for(archive: Archive, tmp_path: Path) -> None:
    (tmp_path / "days" / "monday").mkdir(parents=True)
    with (
        pytest.warns(UserWarning, match="monday: no day folders"),
        pytest.raises(
            InputError, match=r"no day folders found; expected folders such as .*2026-11-20 or"
        ),
    ):
        reprocess(tmp_path / "days", archive[1], out=tmp_path / "out", runner=FakeJobs())
    assert not (tmp_path / "out").exists()


def test_days_and_regions_side_by_side_are_not_guessed(
    days: Path, archive: Archive, tmp_path: Path
) -> None:
    shutil.copytree(days / DATES[0], days / "north" / DATES[0])
    with pytest.raises(InputError, match="expected either day or region folders"):
        reprocess(days, archive[1], out=tmp_path / "out", runner=FakeJobs())


def test_the_output_is_apart_from_the_days(days: Path, archive: Archive, tmp_path: Path) -> None:
    for out in (days / "out", days, tmp_path):
        with pytest.raises(
            ArgumentError, match="expected a directory neither inside nor containing"
        ):
            reprocess(days, archive[1], out=out, runner=FakeJobs())
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    with pytest.raises(OutputExistsError, match="is not the output of `reprocess`"):
        reprocess(days, archive[1], out=other, runner=FakeJobs())
    assert [path.name for path in other.iterdir()] == ["thesis.txt"]


def test_options_of_one_recording_are_not_of_days(
    days: Path, archive: Archive, tmp_path: Path
) -> None:
    wrong: dict[str, Any] = {"date": "2026-11-20", "report": "page.html", "workers": 2}
    for name, value in wrong.items():
        with pytest.raises(ArgumentError, match=f"`{name}` applies to one recording"):
            reprocess(days, archive[1], out=tmp_path / "out", runner=FakeJobs(), **{name: value})
    with pytest.raises(ArgumentError, match="days"):
        reprocess(days, archive[1], out=tmp_path / "out", days="merge", runner=FakeJobs())
