"""The same recording in other forms gives the same bytes."""

import datetime as dt
from pathlib import Path

import polars as pl
import pytest

from support.inputs import dumps

DAY = dt.date(2018, 8, 1)
DAY_BEGINS = 1533081600


@pytest.fixture(scope="module")
def part() -> dict[str, list[list[str]]]:
    return dumps.part_of_sample(1500)


@pytest.fixture(scope="module")
def plain(
    tmp_path_factory: pytest.TempPathFactory, part: dict[str, list[list[str]]]
) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("plain")
    dumps.run(dumps.write_dump(folder / "dump", part, dumps.columns()), folder / "out")
    return dumps.contents(folder / "out")


@pytest.mark.parametrize(
    "encode",
    [
        pytest.param(dumps.columns(end="\n"), id="LF"),
        pytest.param(dumps.columns(end="\r"), id="CR"),
        pytest.param(dumps.columns(end="\r\r\n"), id="CR-CRLF"),
        pytest.param(dumps.columns(";"), id="semicolons"),
        pytest.param(dumps.columns(","), id="commas"),
        pytest.param(dumps.columns("  \t "), id="runs of blanks"),
        pytest.param(dumps.columns("   "), id="blanks"),
        pytest.param(dumps.columns(" \t"), id="tabs with blanks"),
        pytest.param(dumps.columns("\t", "\n", "utf-8-sig"), id="byte order mark"),
        pytest.param(dumps.pairs(), id="pairs"),
        pytest.param(dumps.pairs("\t", "\r\n"), id="pairs with tabs"),
        pytest.param(dumps.pairs("; "), id="pairs with semicolons"),
    ],
)
def test_every_form_of_the_layout_gives_the_same_bytes(
    tmp_path: Path, part: dict[str, list[list[str]]], plain: dict[str, bytes], encode: dumps.Encoder
) -> None:
    dump = dumps.write_dump(tmp_path / "dump", part, encode)
    report = dumps.run(dump, tmp_path / "out")
    assert report["counts"]["rejected"] == 0
    assert dumps.contents(tmp_path / "out") == plain


def test_columns_in_any_order_with_unknown_ones_in_windows_1251(
    tmp_path: Path, part: dict[str, list[list[str]]], plain: dict[str, bytes]
) -> None:
    def encode(name: str, rows: list[list[str]]) -> bytes:
        lines = [[*dumps.HEADERS[name], "примечание"], *([*row, "снег, «да»"] for row in rows)]
        return "".join("\t".join(reversed(line)) + "\n" for line in lines).encode("cp1251")

    dumps.run(dumps.write_dump(tmp_path / "dump", part, encode), tmp_path / "out")
    assert dumps.contents(tmp_path / "out") == plain


@pytest.mark.parametrize("form", ["unix", "iso8601", "iso8601 with an offset"])
def test_unix_and_iso_times_give_the_table_of_a_dated_dump(
    tmp_path: Path, part: dict[str, list[list[str]]], form: str
) -> None:
    def moved(text: str) -> str:
        milliseconds = DAY_BEGINS * 1000 + round(float(text) * 1000)
        if form == "unix":
            return f"{milliseconds / 1000:.3f}"
        zone = dt.UTC if form == "iso8601" else dt.timezone(dt.timedelta(hours=-3, minutes=-30))
        time = dt.datetime.fromtimestamp(milliseconds // 1000, tz=zone)
        text = f"{time:%Y-%m-%dT%H:%M:%S}.{milliseconds % 1000:03d}"
        return f"{text}Z" if form == "iso8601" else f"{text}-03:30"

    rows = {name: [[moved(row[0]), *row[1:]] for row in part[name]] for name in part}
    dumps.run(dumps.write_dump(tmp_path / "dump", rows, dumps.columns()), tmp_path / "out")
    dated = dumps.write_dump(tmp_path / "dated", part, dumps.columns())
    dumps.run(dated, tmp_path / "expected", date=DAY)
    found = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    expected = pl.read_parquet(tmp_path / "expected" / "measurements.parquet")
    # Two roundings of a Unix time differ by its last bit, 0.24 µs.
    assert (found["time_s"] - expected["time_s"]).abs().max() < 3e-7  # type: ignore[operator]
    assert found.drop("time_s").equals(expected.drop("time_s"))
    for path in (tmp_path / "expected").rglob("*.plt"):
        assert (
            tmp_path / "out" / path.relative_to(tmp_path / "expected")
        ).read_bytes() == path.read_bytes()


@pytest.mark.parametrize("falls_back", [True, False], ids=["times fall to zero", "times go on"])
def test_midnight_is_passed_in_every_file(
    tmp_path: Path, part: dict[str, list[list[str]]], plain: dict[str, bytes], falls_back: bool
) -> None:
    del plain
    # The recording begins a moment before midnight, and its files not at the same line.
    shift = 86400 - 28800 - 0.15

    def moved(text: str) -> str:
        time = float(text) + shift
        return f"{time - 86400 if falls_back and time >= 86400 else time:.3f}"

    rows = {name: [[moved(row[0]), *row[1:]] for row in part[name]] for name in part}
    assert {float(rows[name][0][0]) > 43200 for name in rows} == (
        {True, False} if falls_back else {True}
    )
    dumps.run(dumps.write_dump(tmp_path / "dump", rows, dumps.columns()), tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    expected = sorted(
        round(float(row[0]) + shift, 3)
        for name in ("plots.txt", "plots_ads.txt")
        for row in part[name]
    )
    assert table["time_s"].round(3).to_list() == expected
    # The join over midnight finds what it finds by day.
    by_day = dumps.write_dump(tmp_path / "day", part, dumps.columns())
    report = dumps.run(by_day, tmp_path / "by day")
    plots_named = report["figures"]["plots_named_by_no_track"]
    assert table.filter(kind="radar")["track_number"].null_count() == plots_named


def test_a_plot_number_that_wraps_names_the_plot_near_in_time(tmp_path: Path) -> None:
    plot = ["10", "5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
    track = ["46.7", "6.1", "11277.6", "6121"]
    rows = {
        "plots.txt": [["1000.0", "26", *plot], ["3000.0", "26", *plot], ["3000.1", "35", *plot]],
        "tracks.txt": [
            ["3000.3", "26", "10", "7", "5", *track],
            ["1000.2", "26", "10", "8", "5", *track],
            ["2000.0", "26", "10", "9", "5", *track],
            ["1000.3", "26", "10", "8", "5", *track],
        ],
        "plots_ads.txt": [["999.0", "7", "3c09df", "47.2", "8.3", ""]],
    }
    dump = dumps.write_dump(tmp_path / "dump", rows, dumps.columns())
    report = dumps.run(dump, tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    assert table["track_number"].to_list() == [7, 8, 7, None]
    assert table["height_m"].to_list()[0] is None
    assert [path.name for path in sorted((tmp_path / "out" / "9").glob("*.new4"))] == ["26_mr.new4"]
    assert len(dumps.read_new4(tmp_path / "out" / "8" / "26_r.new4")) == 1
    assert report["figures"]["track_rows_whose_plot_is_missing"] == 1


def test_of_two_plots_in_reach_the_nearer_is_named_whatever_their_order(tmp_path: Path) -> None:
    plot = ["10", "5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
    track = ["46.7", "6.1", "11277.6", "6121"]
    rows = {
        "plots.txt": [["1030.0", "26", *plot], ["1000.0", "26", *plot]],
        "tracks.txt": [
            ["1014.9", "26", "10", "7", "5", *track],
            ["1015.1", "26", "10", "8", "5", *track],
            ["1001.0", "26", "10", "9", "5", *track],
            ["1029.0", "26", "10", "6", "5", *track],
        ],
    }
    dumps.run(dumps.write_dump(tmp_path / "dump", rows, dumps.columns()), tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    # Each plot is referenced by a row one second away and by another one; the files have both.
    assert table.select("time_s", "track_number").rows() == [(1000.0, 9), (1030.0, 6)]
    assert dumps.read_new4(tmp_path / "out" / "7" / "26_r.new4")[0][0] == 1000.0
    assert dumps.read_new4(tmp_path / "out" / "9" / "26_r.new4")[0][0] == 1000.0
    assert dumps.read_new4(tmp_path / "out" / "8" / "26_r.new4")[0][0] == 1030.0


def test_of_two_sensors_with_the_same_numbers_the_stated_one_is_meant(tmp_path: Path) -> None:
    plot = ["5", "57014.6", "13.8440", "46.9128223", "6.2769624", "11582.4", "6430"]
    track = ["46.7", "6.1", "11277.6", "6121"]
    rows = {
        "plots.txt": [["1000.0", "26", "10", *plot], ["1000.9", "26", "1", *plot]],
        "tracks.txt": [
            ["1000.1", "26", "1", "7", "5", *track],
            ["1000.8", "26", "10", "8", "5", *track],
        ],
    }
    dump = dumps.write_dump(tmp_path / "dump", rows, dumps.columns())
    dumps.run(dump, tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    assert table.select("sensor_id", "track_number").rows() == [("26-10", 8), ("26-1", 7)]


def test_a_profile_of_another_dump_reads_it_unedited(
    tmp_path: Path, part: dict[str, list[list[str]]], plain: dict[str, bytes]
) -> None:
    from multiradar_converters.vid.profile import load_profile

    (tmp_path / "profile.toml").write_text(
        """
        separator = "semicolon"
        multiradar_source = 240
        [files]
        plots = "отметки.csv"
        [units]
        range = "km"
        [columns.plots]
        range = "дальность"
        time = "время"
        [headers]
        tracks = ["time", "source", "sensor", "global", "plot", "lat", "lon", "h", "code"]
        """,
        encoding="utf-8",
    )
    dump = dumps.write_dump(tmp_path / "dump", part, dumps.columns(";"))
    kilometres = [[*row[:4], f"{float(row[4]) / 1000:.4f}", *row[5:]] for row in part["plots.txt"]]
    header = [
        "время",
        *dumps.HEADERS["plots.txt"][1:4],
        "дальность",
        *dumps.HEADERS["plots.txt"][5:],
    ]
    text = "\n".join(";".join(row) for row in [header, *kilometres]) + "\n"
    (dump / "plots.txt").unlink()
    (dump / "отметки.csv").write_bytes(text.encode("cp1251"))
    tracks = (dump / "tracks.txt").read_bytes()
    (dump / "tracks.txt").write_bytes(tracks[tracks.index(b"\n") + 1 :])
    dumps.run(dump, tmp_path / "out", profile=load_profile(tmp_path / "profile.toml"))
    found = dumps.contents(tmp_path / "out")
    assert {name for name in found if found[name] != plain[name]} <= {"measurements.parquet"}
    ranges = pl.read_parquet(tmp_path / "out" / "measurements.parquet")["range_m"].drop_nulls()
    assert ranges.round(1).sort().to_list() == sorted(float(row[4]) for row in part["plots.txt"])
