"""`multiradar track` from the command line: all files on success, none on failure."""

import json
import re
import resource
import signal
import subprocess
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import run
from multiradar.tracking import pool
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA
from multiradar_schemas.report import Report
from support.paths import SAMPLE
from support.processes.commands import RUN
from support.processes.waiting import WAIT_TIMEOUT_S, run_to_end, wait_until
from support.scenarios.recorded_scene import environment, write_scene

FILES = [
    "bias_correlations.parquet", "biases.parquet", "health.parquet", "rejects.ndjson",
    "report.json", "sensors.toml", "tracks.parquet", "transitions.parquet",
]  # fmt: skip


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return write_scene(tmp_path_factory.mktemp("scene"), 2000)


def _track(*arguments: object) -> int:
    return run(["track", *map(str, arguments)])


def test_a_run_writes_its_files_and_prints_the_biases(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    out = tmp_path / "out"
    assert _track(measurements, "--sensors", sensors, "--out", out) == 0
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert out.stat().st_mode & 0o700 == 0o700
    shown = capsys.readouterr()
    assert "2000 measurements" in shown.out
    assert "range_offset_m" in shown.out
    # Outcomes that no measurement had are left out.
    (line,) = (one for one in shown.out.splitlines() if " updated" in one)
    numbers = [int(one) for one in re.findall(r"\d+", line)]
    assert (min(numbers) > 0, sum(numbers)) == (True, 2000)
    assert not shown.err
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_headline_counts_the_tracks_of_the_table(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # In addition some plots without identity: tracks that are never confirmed.
    rows = pl.read_parquet(scene[0])
    alone = rows.filter(pl.int_range(pl.len()) % 97 == 0).with_columns(
        range_m=pl.col("range_m") * 1.4, track_number=pl.lit(None, pl.Int64),
        mode_3a=pl.lit(None, pl.String),
    )  # fmt: skip
    cluttered, out = tmp_path / "cluttered.parquet", tmp_path / "out"
    pl.concat([rows, alone.select(rows.columns)]).sort("time_s").write_parquet(cluttered)
    assert _track(cluttered, "--sensors", scene[1], "--out", out) == 0
    tracks = pl.read_parquet(out / "tracks.parquet")
    initiated = tracks["track_id"].n_unique()
    confirmed = tracks.filter(pl.col("state") != "tentative")["track_id"].n_unique()
    assert 0 < confirmed < initiated
    said = capsys.readouterr().out
    assert said.startswith(f"{confirmed} confirmed tracks ({initiated} initiated) from ")
    figures = json.loads((out / "report.json").read_text())["figures"]
    assert (figures["tracks_confirmed"], figures["tracks"]) == (confirmed, initiated)


def test_the_time_by_stage_is_shown_but_not_written(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert _track(scene[0], "--sensors", scene[1], "--out", out, "--encounters", 60) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    stages = r"([a-zA-Z]+ [\d.]+ s(, )?)+"
    own, beside = last.split("; in parallel: ")
    assert re.fullmatch(rf"[\d.]+ s: {stages}", own), last
    assert re.fullmatch(stages, beside), last
    assert "tracking" in own
    assert "encounters" in beside
    assert "compiling" not in (out / "report.json").read_text()


def test_encounters_are_written_when_they_are_asked_for(
    scene: tuple[Path, Path], tmp_path: Path
) -> None:
    measurements, sensors = scene
    out = tmp_path / "out"
    asked = ("--encounters", 60, "--encounter-distance-m", 8000, "--encounter-height-m", 305)
    assert _track(measurements, "--sensors", sensors, "--out", out, *asked) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "encounters.parquet"])
    table = pl.read_parquet(out / "encounters.parquet")
    assert table.height > 0
    beyond = (pl.col("distance_m") > 8000.0) | (pl.col("time_to_closest_s") > 60.0)
    assert table.filter(beyond).is_empty()
    report = Report.model_validate_json((out / "report.json").read_text(encoding="utf-8"))
    assert {one.file: one.rows for one in report.outputs}["encounters.parquet"] == table.height


@pytest.mark.parametrize(
    "options",
    [
        ("--encounter-distance-m", 500),
        ("--encounter-height-m", 300),
        ("--trajectory-aircraft-max", 5),
    ],
)
def test_an_option_without_effect_is_rejected(
    scene: tuple[Path, Path],
    tmp_path: Path,
    options: tuple[str, int],
    capsys: pytest.CaptureFixture[str],
) -> None:
    measurements, sensors = scene
    asked = ("--sensors", sensors, "--out", tmp_path / "out", *options)
    assert _track(measurements, *asked) == 2
    assert f"{options[0]} requires --" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_biases_unobservable_with_one_radar_are_reported(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    rows = pl.read_parquet(measurements).filter(sensor_id="41-10")
    alone = tmp_path / "alone.parquet"
    rows.write_parquet(alone)
    out = tmp_path / "out"
    assert _track(alone, "--sensors", sensors, "--out", out) == 1
    shown, said = capsys.readouterr()
    assert said.startswith("multiradar: 41-20: no measurements in the recording; ")
    sentence = (
        "not observable: range offset of 41-10 (sigma still 100% of the prior): all aircraft were "
        "observed from one site; add a radar at another site"
    )
    assert sentence in shown
    assert "100.0%" in shown
    figures = json.loads((out / "report.json").read_text())["figures"]
    first = figures["unobservable_biases"][0]
    assert first["what"] == "range offset of 41-10"
    assert first["prior_ratio"] == pytest.approx(1.0)
    assert first["reason"].startswith("all aircraft were observed from one site; add ")
    assert first["weights"] == [
        {"sensor_id": "41-10", "parameter": "range_offset_m", "weight": 1.0}
    ]
    ratios = pl.read_parquet(out / "biases.parquet").filter(sensor_id="41-10")["prior_ratio"]
    assert ratios.min() == pytest.approx(1.0)


def test_trajectories_are_written_when_asked_for(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    out, few = tmp_path / "out", tmp_path / "few"
    given = (measurements, "--sensors", sensors, "--trajectories")
    assert _track(*given, "--out", out, "--json") == 0
    report = Report.model_validate_json(capsys.readouterr().out)
    table = pl.read_parquet(out / "trajectories.parquet")
    assert table.schema == TRAJECTORY_SCHEMA
    assert table.select("track_id").n_unique() > 1
    rows = {one.file: one.rows for one in report.outputs}
    assert rows["trajectories.parquet"] == len(table) > 0
    counts = report.figures["trajectories"]
    assert isinstance(counts, dict)
    assert counts["aircraft_waiting"] == 0
    # One row at most for each track and epoch, by epoch and track.
    keys = table.select((pl.col("time_s") // 4.0).alias("epoch"), "track_id")
    assert keys.is_unique().all()
    assert keys.equals(keys.sort("epoch", "track_id"))
    assert _track(*given, "--trajectory-aircraft-max", 1, "--out", few, "--json") == 0
    report = Report.model_validate_json(capsys.readouterr().out)
    counts = report.figures["trajectories"]
    assert isinstance(counts, dict)
    assert counts["aircraft_waiting"] != 0
    assert pl.read_parquet(few / "trajectories.parquet")["track_id"].n_unique() == 1


def test_json_is_the_report(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    out = tmp_path / "out"
    assert _track(measurements, "--sensors", sensors, "--out", out, "--json") == 0
    text = capsys.readouterr().out
    assert json.loads(text) == json.loads((out / "report.json").read_text())
    report = Report.model_validate_json(text)
    assert report.counts.read == 2000
    assert report.settings["filter_name"] == "imm"


def test_options_reach_the_tracker_and_override_the_file(
    scene: tuple[Path, Path], tmp_path: Path
) -> None:
    measurements, sensors = scene
    config = tmp_path / "settings.toml"
    config.write_text("[tracking]\nepoch_s = 2.0\nreorder_horizon_s = 7.0\n")
    out = tmp_path / "out"
    options = ("--config", config, "--filter", "ci", "--epoch-s", "8", "--kinds", "radar")
    assert _track(measurements, "--sensors", sensors, "--out", out, *options) == 0
    settings = json.loads((out / "report.json").read_text())["settings"]
    assert settings["filter_name"] == "ci"
    assert settings["epoch_s"] == 8.0
    assert settings["reorder_horizon_s"] == 7.0
    assert settings["kinds"] == ["radar"]


def test_hidden_identity_reaches_the_tables_and_the_report(
    scene: tuple[Path, Path], tmp_path: Path
) -> None:
    measurements, sensors = scene
    out = tmp_path / "out"
    options = ("--hide", "mode_3a,track_number,mode_s_address", "--kinds", "radar")
    assert _track(measurements, "--sensors", sensors, "--out", out, *options) == 0
    report = json.loads((out / "report.json").read_text())
    assert report["settings"]["hidden_fields"] == ["track_number", "mode_3a", "mode_s_address"]
    assert report["figures"]["track_transitions"]["started"] > 0
    tracks = pl.read_parquet(out / "tracks.parquet")
    assert tracks["track_number"].null_count() == 0


def test_exhausted_track_capacity_is_reported(
    scene: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    measurements, sensors = scene
    monkeypatch.setattr(pool, "CAPACITY_FIRST", 4)
    monkeypatch.setattr(pool, "CAPACITY_MAX", 4)
    out = tmp_path / "out"
    assert _track(measurements, "--sensors", sensors, "--out", out) == 1
    figures = json.loads((out / "report.json").read_text())["figures"]
    assert {one["code"] for one in figures["diagnoses"]} == {"measurements_lost"}
    untracked = figures["measurements_by_outcome"]["no_room"]
    assert untracked > 0
    sentence = f"imm tracks at most 4 aircraft; {untracked} measurements were not used"
    assert sentence in capsys.readouterr().err


def test_an_existing_output_is_not_touched(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine").write_text("mine")
    assert _track(measurements, "--sensors", sensors, "--out", out) == 1
    assert "already exists; choose another output directory" in capsys.readouterr().err
    assert [path.name for path in out.iterdir()] == ["mine"]


def _spoil(kind: str, measurements: Path, folder: Path) -> Path:
    path = folder / "spoilt.parquet"
    if kind == "missing file":
        return path
    if kind == "no parquet":
        path.write_text("time_s,range_m\n1,2\n")
    elif kind == "missing column":
        pl.read_parquet(measurements).drop("range_m").write_parquet(path)
    elif kind == "truncated":
        path.write_bytes(measurements.read_bytes()[:-100])
    else:
        path.mkdir()
    return path


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("missing file", "spoilt.parquet: no such file"),
        ("no parquet", "expected measurements in Parquet"),
        ("missing column", "missing column range_m; found: "),
        ("truncated", "expected measurements in Parquet"),
        (
            "empty folder",
            "expected a folder with measurements.parquet, or a dump, was an empty folder",
        ),
    ],
)
def test_unreadable_measurements_are_one_sentence_and_no_output(
    scene: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    kind: str,
    sentence: str,
) -> None:
    out = tmp_path / "out"
    spoilt = _spoil(kind, scene[0], tmp_path)
    before = sorted(tmp_path.iterdir())
    assert _track(spoilt, "--sensors", scene[1], "--out", out) == 1
    shown = capsys.readouterr().err
    assert shown.startswith(f"multiradar: {spoilt}")
    assert sentence in shown
    assert shown.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "sensors.toml: no such file"),
        ("[[sensor]\n", "not valid TOML"),
        ('[[sensor]]\nid = "a"\nkind = "sonar"\n', "sonar"),
        ('[[sensor]]\nid = "adsb"\nkind = "adsb"\n', "no sensor has a position"),
    ],
)
def test_unusable_sensors_are_one_sentence_and_no_output(
    scene: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    text: str | None,
    sentence: str,
) -> None:
    sensors = tmp_path / "sensors.toml"
    if text is not None:
        sensors.write_text(text)
    assert _track(scene[0], "--sensors", sensors, "--out", tmp_path / "out") == 1
    shown = capsys.readouterr().err
    assert sentence in shown
    assert shown.count("\n") == 1
    assert not [path for path in tmp_path.iterdir() if path != sensors]


@pytest.mark.parametrize(
    "options",
    [
        ("--epoch-s", "0"),
        ("--epoch-s", "nan"),
        ("--reorder-horizon-s", "-1"),
        ("--acceleration-density", "inf"),
    ],
)
def test_unusable_settings_are_a_usage_error_and_no_output(
    scene: tuple[Path, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, str],
) -> None:
    out = tmp_path / "out"
    assert _track(scene[0], "--sensors", scene[1], "--out", out, *options) == 2
    shown = capsys.readouterr().err
    assert shown.startswith(f"multiradar: {options[0]}: expected ")
    assert shown.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("order", ["radar after radar", "reversed", "shuffled"])
def test_a_recording_out_of_order_loses_nothing_with_a_warning(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], order: str
) -> None:
    frame = pl.read_parquet(scene[0])
    if order == "radar after radar":
        frame = frame.sort("sensor_id", maintain_order=True)
    else:
        frame = frame.reverse() if order == "reversed" else frame.sample(fraction=1.0, shuffle=True)
    measurements, out = tmp_path / "unsorted.parquet", tmp_path / "out"
    frame.write_parquet(measurements)
    assert _track(measurements, "--sensors", scene[1], "--out", out, "--json") == 0
    shown = capsys.readouterr()
    assert "s out of order; they were sorted by time" in shown.err
    assert shown.err.count("\n") == 1
    report = Report.model_validate_json(shown.out)
    assert (report.counts.read, report.counts.accepted) == (2000, 2000)
    assert report.figures["sorted"] is True
    assert report.inputs[0].file == "unsorted.parquet"
    assert report.inputs[0].bytes == measurements.stat().st_size


def test_a_run_that_accepts_nothing_fails_and_names_the_codes(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, out = tmp_path / "strangers.parquet", tmp_path / "out"
    strangers = pl.read_parquet(scene[0]).with_columns(sensor_id=pl.lit("77-7"))
    strangers.write_parquet(measurements)
    assert _track(measurements, "--sensors", scene[1], "--out", out) == 1
    shown = capsys.readouterr()
    assert "rejected: 2000 UNKNOWN_SENSOR" in shown.out
    assert "none of 2000 measurements were accepted: 2000 UNKNOWN_SENSOR" in shown.err
    assert len((out / "rejects.ndjson").read_text().splitlines()) == 2000


def test_nothing_to_track_is_one_sentence_and_no_output(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty, out = tmp_path / "empty.parquet", tmp_path / "out"
    pl.read_parquet(scene[0]).clear().write_parquet(empty)
    assert _track(empty, "--sensors", scene[1], "--out", out) == 1
    assert "no measurements" in capsys.readouterr().err
    assert _track(scene[0], "--sensors", scene[1], "--out", out, "--kinds", "mlat") == 1
    assert "no measurements of the kinds mlat" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [empty]


def test_a_value_too_large_for_its_column_is_reported(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements = tmp_path / "large.parquet"
    large = pl.lit(2**63, pl.UInt64).alias("track_number")
    pl.read_parquet(scene[0]).with_columns(large).write_parquet(measurements)
    assert _track(measurements, "--sensors", scene[1], "--out", tmp_path / "out") == 1
    shown = capsys.readouterr().err
    assert "values do not match their column types" in shown
    assert "Parquet" not in shown


def test_a_full_disk_is_reported_with_the_name_of_the_output(
    scene: tuple[Path, Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    line = [*RUN, "track", str(scene[0]), "--sensors", str(scene[1]), "--out", str(out)]

    # As on a full disk: writes fail beyond a size. Kernel caches exist already.
    def bound() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    done = run_to_end(line, env=environment(), preexec_fn=bound)
    assert done.returncode == 1
    assert str(out) in done.stderr
    assert "internal error" not in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_termination_removes_the_partial_output_and_the_converted_dump(tmp_path: Path) -> None:
    temporary, out = tmp_path / "tmp", tmp_path / "out"
    temporary.mkdir()
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    line = [*RUN, "track", str(SAMPLE), "--sensors", str(sensors), "--out", str(out)]
    own = {**environment(), "TMPDIR": str(temporary)}
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True, env=own) as process:
        wait_until(
            lambda: (
                process.poll() is not None or list(tmp_path.glob(".out.partial-*/rejects.ndjson"))
            ),
            "the output to begin",
        )
        assert process.poll() is None
        process.terminate()
        assert process.stderr is not None
        assert process.stderr.read() == "multiradar: stopped\n"
        assert process.wait(WAIT_TIMEOUT_S) == 143
    assert list(tmp_path.iterdir()) == [temporary]
    assert not list(temporary.iterdir())


def test_system_tracks_are_written_in_asterix_as_the_settings_say(
    scene: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measurements, sensors = scene
    config, written = tmp_path / "multiradar.toml", tmp_path / "tracks.ast"
    config.write_text("[[asterix.output]]\nport = 8662\nsac = 20\nsic = 250\nperiod_s = 8.0\n")
    given = measurements, "--sensors", sensors, "--config", config, "--asterix", written
    assert _track(*given, "--out", tmp_path / "out") == 0
    assert "062" in capsys.readouterr().out
    converted = tmp_path / "converted"
    assert run(["convert", "asterix", str(written), "--out", str(converted)]) == 0
    tracks = pl.read_parquet(converted / "system_tracks.parquet")
    assert set(tracks["sensor_id"]) == {"20-250"}
    assert set((tracks["time_s"] % 8.0).to_list()[:-20]) == {0.0}
    report = Report.model_validate_json((tmp_path / "out" / "report.json").read_bytes())
    records = report.figures["asterix_records"]
    assert isinstance(records, dict)
    assert records["062"] == len(tracks)
    assert set(records) == {"062", "063", "065"}
    # A second run reports that the file exists and does not touch it.
    octets = written.read_bytes()
    assert _track(*given, "--out", tmp_path / "other") == 1
    assert written.read_bytes() == octets
    assert not (tmp_path / "other").exists()


def test_asterix_changes_nothing_of_the_tracks(scene: tuple[Path, Path], tmp_path: Path) -> None:
    measurements, sensors = scene
    for name, more in (("plain", ()), ("both", ("--asterix", tmp_path / "tracks.ast"))):
        given = measurements, "--sensors", sensors, "--out", tmp_path / name
        assert _track(*given, *more) == 0
    for name in FILES:
        if name != "report.json":
            plain = (tmp_path / "plain" / name).read_bytes()
            assert (tmp_path / "both" / name).read_bytes() == plain
