"""`multiradar track --report` and `multiradar export` as a user calls them."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar.toolbox.inputs import SENSORS_FILE, load_sensor_table
from multiradar.toolbox.pages import track_page
from multiradar.toolbox.pages.track_page import TrackRun
from multiradar.toolbox.tracking.track import track
from multiradar_schemas.report import Report
from support.pages import read_page
from support.scenarios.recorded_scene import write_scene

KML = "{http://www.opengis.net/kml/2.2}"


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("export")
    measurements, sensors = write_scene(folder, 3000)
    out, page = folder / "tracks", folder / "page.html"
    command = ["track", str(measurements), "--sensors", str(sensors), "--out", str(out)]
    assert run([*command, "--report", str(page)]) == EXIT_DONE
    return out, page


def export(*arguments: object) -> int:
    return run(["export", *map(str, arguments)])


def test_the_report_has_the_counts_of_the_run(tracked: tuple[Path, Path]) -> None:
    out, page = tracked
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    reader = read_page(page)
    for heading in ("Map of tracks", "Final radar health", "Live tracks over time", "Sensors"):
        assert heading in reader.headings
    text = page.read_text(encoding="utf-8")
    assert f"{report['figures']['tracks_confirmed']:,} confirmed tracks" in text
    assert f"accepted {report['counts']['accepted']:,}" in text
    assert report["output_sha256"] in text


def test_the_report_has_the_command_and_the_filter_of_the_run(
    tracked: tuple[Path, Path], tmp_path: Path
) -> None:
    folder, page = tracked[0].parent, tmp_path / "page.html"
    settings = tmp_path / "settings.toml"
    settings.write_text('[tracking]\nfilter_name = "two-stage"\n')
    command = [
        "track", str(folder / "measurements.parquet"), "--sensors", str(folder / "sensors.toml"),
        "--kinds", "radar", "--out", str(tmp_path / "out"), "--config", str(settings),
    ]  # fmt: skip
    assert run([*command, "--report", str(page)]) == EXIT_DONE
    text = page.read_text(encoding="utf-8")
    assert "filter two-stage" in text
    for given in ("--filter two-stage", "--kinds radar", f"--config {settings}"):
        assert given in text


def test_a_report_that_cannot_be_made_does_not_cost_the_run(
    tracked: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_memory(*_: object) -> str:
        raise MemoryError

    monkeypatch.setattr(track_page, "track_page", no_memory)
    folder, out, page = tracked[0].parent, tmp_path / "out", tmp_path / "page.html"
    with pytest.raises(MemoryError):
        track(folder / "measurements.parquet", folder / "sensors.toml", out=out, report=page)
    assert not page.exists()
    for name in ("report.json", "tracks.parquet", "sensors.toml"):
        assert (out / name).read_bytes() == (tracked[0] / name).read_bytes()


def test_counts_of_a_long_run_have_no_decimals(tracked: tuple[Path, Path], tmp_path: Path) -> None:
    out = tracked[0]
    report = Report.model_validate_json((out / "report.json").read_text(encoding="utf-8"))
    arrivals = report.figures["arrivals"]
    assert isinstance(arrivals, dict)
    for counts, received in zip(arrivals.values(), (123_456, 57), strict=False):
        assert isinstance(counts, dict)
        counts["received"] = received
    table = load_sensor_table(out / SENSORS_FILE)
    page = tmp_path / "page.html"
    page.write_text(track_page.track_page(TrackRun(out, report, table, "m", "c")), encoding="utf-8")
    text = page.read_text(encoding="utf-8")
    assert ">123456<" in text
    assert ">57<" in text


def test_a_run_without_confirmed_tracks_has_a_report_without_a_map(
    tracked: tuple[Path, Path], tmp_path: Path
) -> None:
    folder, page = tracked[0].parent, tmp_path / "page.html"
    rows, few = pl.read_parquet(folder / "measurements.parquet"), tmp_path / "few.parquet"
    rows.unique("sensor_id", keep="first", maintain_order=True).write_parquet(few)
    command = ["track", str(few), "--sensors", str(folder / "sensors.toml")]
    assert run([*command, "--out", str(tmp_path / "out"), "--report", str(page)]) == EXIT_DONE
    assert "Map of tracks" not in read_page(page).headings


def test_the_report_is_not_written_over_another(tracked: tuple[Path, Path], tmp_path: Path) -> None:
    out, page = tracked
    measurements, sensors = out.parent / "measurements.parquet", out.parent / "sensors.toml"
    other = tmp_path / "other"
    command = ["track", str(measurements), "--sensors", str(sensors), "--out", str(other)]
    assert run([*command, "--report", str(page)]) == EXIT_FAILED
    assert not other.exists()


def test_exported_tracks_are_the_confirmed_ones(tracked: tuple[Path, Path], tmp_path: Path) -> None:
    out, _ = tracked
    geojson, kml = tmp_path / "tracks.geojson", tmp_path / "tracks.kml"
    assert export(out, "--geojson", geojson, "--kml", kml) == EXIT_DONE
    table = pl.read_parquet(out / "tracks.parquet")
    confirmed = table.filter((pl.col("state") != "tentative").any().over("track_id"))
    found = json.loads(geojson.read_text(encoding="utf-8"))["features"]
    assert [one["id"] for one in found] == sorted(confirmed["track_id"].unique().to_list())
    positions = sum(len(one["geometry"]["coordinates"]) for one in found)
    assert positions == sum(len(one["properties"]["times"]) for one in found) == confirmed.height
    placemarks = list(ET.parse(kml).iter(f"{KML}Placemark"))
    assert len(placemarks) == len(found)
    names = [one.findtext(f"{KML}name") for one in placemarks]
    assert names == [one["properties"]["name"] for one in found]


def test_a_date_gives_times_of_day_one(tracked: tuple[Path, Path], tmp_path: Path) -> None:
    table = pl.read_parquet(tracked[0] / "tracks.parquet")
    undated = table.with_columns(pl.col("time_s") - pl.col("time_s").min() + 100.0)
    path = tmp_path / "tracks.parquet"
    undated.write_parquet(path)
    assert export(path, "--kml", tmp_path / "a.kml") == EXIT_DONE
    assert "<when>" not in (tmp_path / "a.kml").read_text(encoding="utf-8")
    assert export(path, "--kml", tmp_path / "b.kml", "--date", "2018-08-01") == EXIT_DONE
    text = (tmp_path / "b.kml").read_text(encoding="utf-8")
    assert "<when>2018-08-01T00:01:40.000Z</when>" in text
    assert export(tracked[0], "--kml", tmp_path / "c.kml", "--date", "2018-08-01") == EXIT_USAGE


def test_wrong_usage(
    tracked: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(tracked[0]) == EXIT_USAGE
    assert export(tmp_path, "--kml", tmp_path / "a.kml") == EXIT_FAILED
    assert not (tmp_path / "a.kml").exists()
    table = pl.read_parquet(tracked[0] / "tracks.parquet").drop("callsign")
    table.write_parquet(tmp_path / "old.parquet")
    assert export(tmp_path / "old.parquet", "--kml", tmp_path / "a.kml") == EXIT_FAILED
    assert "missing column callsign" in capsys.readouterr().err
