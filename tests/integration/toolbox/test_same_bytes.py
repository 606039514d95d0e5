"""Functions and commands write the same bytes, and a tracker yields the same rows."""

import json
from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest

import multiradar as mr
from multiradar.cli.main import EXIT_DONE, run
from multiradar.errors import DataWarning
from multiradar.toolbox.conversion.convert import Conversion
from multiradar.toolbox.simulation import Simulation
from support.paths import SAMPLE


def _bytes(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def _frame(made: Path) -> pl.DataFrame:
    return pl.read_parquet(made / "scene" / "measurements.parquet")


def test_a_simulation_has_the_bytes_of_the_command(made: Path) -> None:
    scene = mr.simulate("one-radar-adsb", duration_s=120.0)
    assert _bytes(scene.folder) == _bytes(made / "scene")
    assert scene.truth.height > 0
    assert scene.report["counts"]["read"] == scene.measurements.height


def test_tracks_of_a_folder_have_the_bytes_of_the_command(made: Path, tmp_path: Path) -> None:
    out = tmp_path / "tracks"
    done = mr.track(made / "scene", made / "scene" / "sensors.toml", out=out)
    assert _bytes(out) == _bytes(made / "tracks")
    assert done.report == json.loads((made / "tracks" / "report.json").read_text())


def test_tracks_of_a_table_are_those_of_its_file(made: Path, tracked: mr.Run) -> None:
    sensors = mr.load_sensors(made / "scene" / "sensors.toml")
    done = mr.track(_frame(made).to_arrow(), sensors)
    assert done.report["output_sha256"] == tracked.report["output_sha256"]
    assert done.tracks.equals(tracked.tracks)
    assert done.biases.equals(tracked.biases)
    # The sensors were given as an object; their file reads the same.
    assert done.sensors == sensors


@pytest.mark.parametrize("name", ["simulate", "track", "convert"])
def test_only_a_temporary_folder_goes_with_its_result(
    made: Path, tmp_path: Path, name: str
) -> None:
    reports = tmp_path / "reports.csv"
    rows = [f"{1_533_110_400 + k},3c6444,{47.0 + 0.002 * k},8.5,35000\n" for k in range(3)]
    reports.write_text("timestamp,icao24,latitude,longitude,altitude\n" + "".join(rows))
    frame = _frame(made).head(200)
    made_by: dict[str, Callable[[Path | None], mr.Run | Simulation | Conversion]] = {
        "simulate": lambda out: mr.simulate("one-radar-adsb", duration_s=5.0, out=out),
        "track": lambda out: mr.track(frame, made / "scene" / "sensors.toml", out=out),
        "convert": lambda out: mr.convert(reports, out=out),
    }
    done = made_by[name](None)
    folder = done.folder
    del done
    # The path alone keeps it: `track(convert(…).folder, …)`.
    assert (folder / "report.json").is_file()
    assert repr(folder) == repr(Path(folder))
    path = str(folder)
    del folder
    assert not Path(path).exists()
    done = made_by[name](tmp_path / "kept")
    del done
    assert (tmp_path / "kept" / "report.json").is_file()


@pytest.mark.parametrize("rows", [137, 100_000])
def test_a_tracker_yields_the_rows_of_a_recording(made: Path, tracked: mr.Run, rows: int) -> None:
    frame = _frame(made)
    with mr.Tracker(made / "scene" / "sensors.toml") as tracker:
        parts = [tracker.push(frame[at : at + rows]) for at in range(0, len(frame), rows)]
        parts.append(tracker.flush())
        counts = tracker.counts
    assert pl.concat([part.tracks for part in parts]).equals(tracked.tracks)
    assert pl.concat([part.biases for part in parts]).equals(tracked.biases)
    assert pl.concat([part.transitions for part in parts]).equals(tracked.table("transitions"))
    expected = tracked.report["counts"]
    assert counts == {name: expected[name] for name in counts}


def test_a_tracker_says_which_rows_it_rejects(made: Path) -> None:
    frame = _frame(made)[:50].with_columns(
        azimuth_deg=pl.when(pl.int_range(pl.len()) == 3).then(400.0).otherwise("azimuth_deg"),
        kind=pl.when(pl.int_range(pl.len()) == 3).then(pl.lit("radar")).otherwise("kind"),
        sensor_id=pl.when(pl.int_range(pl.len()) == 7).then(pl.lit("x")).otherwise("sensor_id"),
    )
    with mr.Tracker(made / "scene" / "sensors.toml") as tracker:
        rejected = tracker.push(frame).rejected
        with pytest.warns(DataWarning, match=r"x \(1 \w+\) is not in the sensors file"):
            tracker.flush()
        counts = tracker.counts
    assert rejected["index"].to_list() == [3, 7]
    assert rejected["code"][1] == "UNKNOWN_SENSOR"
    assert counts["read"] == 50 == counts["accepted"] + counts["rejected"] + counts["duplicate"]
    assert counts["rejected"] == 2


def test_a_scorecard_has_the_figures_of_the_command(
    made: Path, tracked: mr.Run, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(made / "tracks"), "--truth", str(made / "scene"), "--gate", "900", "--json"]
    assert run(["evaluate", *arguments]) == EXIT_DONE
    shown = json.loads(capsys.readouterr().out)
    card = mr.evaluate(tracked, truth=made / "scene", gate_m=900.0)
    assert card.figures == shown
    from_table = mr.evaluate(tracked.tracks, truth=mr.simulate("one-radar-adsb", duration_s=120.0))
    assert (
        from_table.figures["errors"] == mr.evaluate(tracked, truth=made / "scene").figures["errors"]
    )


def test_a_conversion_has_the_bytes_of_the_command(tmp_path: Path) -> None:
    dump = tmp_path / "dump"
    dump.mkdir()
    for name, count in (("tracks.txt", 1500), ("plots.txt", 1500), ("plots_ads.txt", 250)):
        lines = (SAMPLE / name).read_bytes().splitlines(keepends=True)
        (dump / name).write_bytes(b"".join(lines[:count]))
    assert run(["convert", "vid", str(dump), str(tmp_path / "a"), "--date", "2018-08-01"]) == 0
    done = mr.convert(dump, date="2018-08-01", out=tmp_path / "b")
    assert _bytes(tmp_path / "a") == _bytes(tmp_path / "b")
    assert done.measurements.height == done.report["outputs"][0]["rows"]


def test_a_scenario_may_be_a_table() -> None:
    plane = {"latitude_deg": 50.0, "longitude_deg": 10.0}
    aircraft = {"track_number": 7, "east_m": 3e4, "north_m": 3e4, "speed_mps": 200.0,
                "heading_deg": 10.0}  # fmt: skip
    sensor = {"id": "a", "east_m": 0.0, "north_m": 0.0}
    scene = {"duration_s": 40.0, "plane": plane, "aircraft": [aircraft], "sensor": [sensor]}
    done = mr.simulate(scene)
    assert isinstance(done, Simulation)
    assert done.sensors.sensor[0].id == "a"
    assert done.measurements["track_number"].unique().to_list() == [7]
