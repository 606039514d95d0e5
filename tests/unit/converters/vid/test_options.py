"""The options of the conversion against manual counts of the sample."""

import collections
from pathlib import Path

import polars as pl
import pytest

from multiradar_converters.vid.profile import load_profile
from support.inputs import dumps

PART = 6000


@pytest.fixture(scope="module")
def rows() -> dict[str, list[dumps.Row]]:
    part = dumps.part_of_sample(PART)
    return {
        name: [dict(zip(dumps.HEADERS[name], row, strict=True)) for row in part[name]]
        for name in part
    }


@pytest.fixture(scope="module")
def dump(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("options") / "dump"
    return dumps.write_dump(folder, dumps.part_of_sample(PART), dumps.columns())


def written(out: Path) -> dict[str, int]:
    return {
        str(path.relative_to(out))[: -len(".new4")]: len(path.read_text().splitlines())
        for path in out.rglob("*.new4")
    }


def lengths(rows: dict[str, list[dumps.Row]]) -> dict[str, int]:
    return {name: len(points) for name, points in dumps.expected_tracks(rows).items()}


def test_the_aircraft_with_most_ads_reports_are_chosen(
    tmp_path: Path, dump: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    reports = collections.Counter(row["global"] for row in rows["plots_ads.txt"])
    chosen = sorted(reports, key=lambda aircraft: (-reports[aircraft], int(aircraft)))[:5]
    report = dumps.run(dump, tmp_path / "out", aircraft_max=5)
    expected = {k: n for k, n in lengths(rows).items() if k.split("/")[0] in chosen}
    assert written(tmp_path / "out") == expected
    seen = {row["global"] for name in ("tracks.txt", "plots_ads.txt") for row in rows[name]}
    assert report["figures"]["aircraft_not_chosen"] == len(seen) - 5


def test_aircraft_with_too_few_ads_reports_are_left_out(
    tmp_path: Path, dump: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    reports = collections.Counter(row["global"] for row in rows["plots_ads.txt"])
    dumps.run(dump, tmp_path / "out", ads_measurements_min=60)
    expected = {k: n for k, n in lengths(rows).items() if reports[k.split("/")[0]] >= 60}
    assert 0 < len(expected) < len(lengths(rows))
    assert written(tmp_path / "out") == expected


def test_one_kind_of_sensor_leaves_multiradar_and_ads_alone(
    tmp_path: Path, dump: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    dumps.run(dump, tmp_path / "out", sensor_only=1)
    own = {
        "tracks.txt": [r for r in rows["tracks.txt"] if r["source"] == "240" or r["sensor"] == "1"],
        "plots.txt": [r for r in rows["plots.txt"] if r["sensor"] == "1"],
        "plots_ads.txt": rows["plots_ads.txt"],
    }
    assert written(tmp_path / "out") == lengths(own)
    table = pl.read_parquet(tmp_path / "out" / "measurements.parquet")
    assert len(table) == len(rows["plots.txt"]) + len(rows["plots_ads.txt"])


def test_short_tracks_are_not_written_but_counted(
    tmp_path: Path, dump: Path, rows: dict[str, list[dumps.Row]]
) -> None:
    report = dumps.run(dump, tmp_path / "out", track_measurements_min=40)
    all_lengths = lengths(rows)
    assert written(tmp_path / "out") == {k: n for k, n in all_lengths.items() if n >= 40}
    skipped = report["figures"]["tracks_too_short"]
    assert sum(each["tracks"] for each in skipped.values()) == sum(
        n < 40 for n in all_lengths.values()
    )
    assert sum(each["points"] for each in skipped.values()) == sum(
        n for n in all_lengths.values() if n < 40
    )


@pytest.mark.parametrize(
    ("kind", "ending"),
    [("ads", "ads"), ("multiradar", "240_mr"), ("monoradar", "_mr"), ("plots", "_r")],
)
def test_each_kind_of_file_can_be_written_alone(
    tmp_path: Path, dump: Path, rows: dict[str, list[dumps.Row]], kind: str, ending: str
) -> None:
    dumps.run(dump, tmp_path / "out", kinds=(kind,))
    expected = {
        name: n
        for name, n in lengths(rows).items()
        if name.endswith(ending) and not (kind == "monoradar" and name.endswith("/240_mr"))
    }
    assert written(tmp_path / "out") == expected


def test_the_number_of_the_multiradar_system_may_be_0(tmp_path: Path) -> None:
    profile = tmp_path / "profile.toml"
    profile.write_text("multiradar_source = 0\n")
    assert load_profile(profile).multiradar_source == 0
