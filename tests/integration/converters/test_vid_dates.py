"""Forms of times: found by most of the rows, the same in all files, not against the date."""

import datetime as dt
from pathlib import Path

import polars as pl
import pytest

from multiradar_converters.errors import LayoutError
from support.inputs import dumps

DAY = dt.date(2018, 8, 1)
BEGIN = dt.datetime(2018, 8, 1)  # noqa: DTZ001  # dumps state no zone


def moved(text: str, form: str) -> str:
    time = BEGIN + dt.timedelta(seconds=float(text))
    if form == "iso":
        return time.isoformat(timespec="milliseconds")
    return f"{time.replace(tzinfo=dt.UTC).timestamp():.3f}" if form == "unix" else text


def dump_of(folder: Path, form: str) -> Path:
    part = dumps.part_of_sample(30)
    rows = {name: [[moved(row[0], form), *row[1:]] for row in part[name]] for name in part}
    return dumps.write_dump(folder, rows, dumps.columns())


@pytest.mark.parametrize("form", ["iso", "unix", "of day"])
def test_a_file_of_a_header_alone_does_not_hinder_the_others(tmp_path: Path, form: str) -> None:
    dump = dump_of(tmp_path / "dump", form)
    (dump / "plots_ads.txt").write_text("\t".join(dumps.HEADERS["plots_ads.txt"]) + "\n")
    report = dumps.run(dump, tmp_path / "out")
    assert report["counts"]["accepted"] == 60
    assert ("note" in report["figures"]) == (form == "of day")


@pytest.mark.parametrize("form", ["iso", "unix", "of day"])
@pytest.mark.parametrize("first", ["iso", "unix", "of day"])
def test_one_first_row_in_another_form_is_one_reject(tmp_path: Path, form: str, first: str) -> None:
    dump = dump_of(tmp_path / "dump", form)
    path = dump / "plots.txt"
    lines = path.read_bytes().decode().split("\r\n")
    time, rest = dumps.part_of_sample(1)["plots.txt"][0][0], lines[1].split("\t")[1:]
    lines[1] = "\t".join([moved(time, first), *rest])
    path.write_bytes("\r\n".join(lines).encode())
    report = dumps.run(dump, tmp_path / "out")
    found = [(each["file"], each["line"]) for each in dumps.rejects(tmp_path / "out")]
    assert found == ([] if form == first else [("plots.txt", 2)])
    assert report["counts"]["accepted"] == 90 - len(found)
    times = pl.read_parquet(tmp_path / "out" / "measurements.parquet")["time_s"]
    assert times.max() - times.min() < 60  # type: ignore[operator]


@pytest.mark.parametrize("form", ["iso", "unix"])
def test_a_date_that_contradicts_the_dump_is_rejected_with_both(tmp_path: Path, form: str) -> None:
    dump = dump_of(tmp_path / "dump", form)
    with pytest.raises(LayoutError, match="recording is dated 2018-08-01, expected 2018-08-03"):
        dumps.run(dump, tmp_path / "out", date=DAY + dt.timedelta(days=2))
    report = dumps.run(dump, tmp_path / "out", date=DAY)
    assert report["counts"]["accepted"] == 90
