"""`track --biases-from`: a recording that starts from the biases at the end of an earlier run."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, run
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.offline.offline_job import OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.bias import BIAS_CORRELATION_SCHEMA
from support.scenarios import live_scene
from support.scenarios.recorded_scene import write_scene

ROWS = 3000
KEY = ["sensor_id", "parameter"]


@pytest.fixture(scope="module")
def halves(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """Return a folder with the runs `whole` and `first`, the second half, and the sensors."""
    folder = tmp_path_factory.mktemp("halves")
    measurements, sensors = write_scene(folder, ROWS)
    rows = pl.read_parquet(measurements)
    parts = {"whole": rows, "first": rows[: ROWS // 2], "second": rows[ROWS // 2 :]}
    for name, part in parts.items():
        part.write_parquet(folder / f"{name}.parquet")
        if name != "second":
            assert track(folder / f"{name}.parquet", sensors, folder / name) == EXIT_DONE
    return folder, folder / "second.parquet", sensors


def track(measurements: Path, sensors: Path, out: Path, *more: object) -> int:
    command = ["track", measurements, "--sensors", sensors, "--out", out, *more]
    return run([*map(str, command)])


def last(run_folder: Path) -> pl.DataFrame:
    rows = pl.read_parquet(run_folder / "biases.parquet")
    return rows.unique(KEY, keep="last", maintain_order=True)


def test_the_correlations_of_a_run_are_those_of_its_covariance(tmp_path: Path) -> None:
    table = live_scene.sensors()
    live_scene.recording(ROWS).write_parquet(tmp_path / "measurements.parquet")
    out = tmp_path / "out"
    out.mkdir()
    track_recording(
        OfflineJob(Recording(tmp_path / "measurements.parquet"), table, TrackingSettings()), out
    )
    correlations = pl.read_parquet(out / "bias_correlations.parquet")
    count = len(table.parameter_kind)
    assert correlations.schema == BIAS_CORRELATION_SCHEMA
    assert len(correlations) == count * (count - 1) // 2
    assert float(np.abs(correlations["correlation"].to_numpy()).max()) > 0.1
    state, time_s = wire.final_biases(pl.read_parquet(out / "biases.parquet"), correlations, table)
    engine = Engine(table, TrackingSettings())
    block = next(Recording(tmp_path / "measurements.parquet").blocks())
    engine.push(wire.measurement_batch(block.drop("index"), table)[0])
    engine.flush()
    scale = np.outer(engine.biases.sigma, engine.biases.sigma)
    np.testing.assert_allclose(
        state.covariance / scale, engine.biases.covariance / scale, atol=1e-9
    )
    np.testing.assert_allclose(state.estimate, engine.biases.estimate, rtol=1e-12)
    assert time_s == pl.read_parquet(out / "biases.parquet")["time_s"].max()


def test_a_run_starts_from_the_biases_of_an_earlier_one(
    halves: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    folder, second, sensors = halves
    out, alone = tmp_path / "out", tmp_path / "alone"
    assert track(second, sensors, out, "--biases-from", folder / "first") == EXIT_DONE
    assert track(second, sensors, alone) == EXIT_DONE
    before, after, other = last(folder / "first"), last(out), last(alone)
    whole = last(folder / "whole")
    assert (after["sigma"] <= before["sigma"] * (1 + 1e-9)).all()
    assert (after["sigma"] < other["sigma"]).all()
    # Only tracks are initiated again.
    assert ((after["estimate"] - whole["estimate"]).abs() < 2.0 * whole["sigma"]).all()
    first = pl.read_parquet(out / "biases.parquet").unique(KEY, keep="first", maintain_order=True)
    assert ((first["estimate"] - before["estimate"]).abs() < 2.0 * before["sigma"]).all()
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    earlier = json.loads((folder / "first" / "report.json").read_text(encoding="utf-8"))
    assert report["settings"]["biases_from"] == earlier["output_sha256"]


def test_an_earlier_run_must_end_before_the_recording_starts(
    halves: tuple[Path, Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _, sensors = halves
    later = pl.read_parquet(folder / "second.parquet").with_columns(pl.col("time_s") + 7200.0)
    later.write_parquet(tmp_path / "later.parquet")
    assert track(tmp_path / "later.parquet", sensors, tmp_path / "later") == EXIT_DONE
    capsys.readouterr()
    out = tmp_path / "out"
    status = track(folder / "first.parquet", sensors, out, "--biases-from", tmp_path / "later")
    assert status == EXIT_FAILED
    assert "after the start of this recording" in capsys.readouterr().err
    assert not out.exists()


def test_biases_of_other_sensors_cannot_be_used(
    halves: tuple[Path, Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, second, sensors = halves
    renamed = tmp_path / "sensors.toml"
    text = sensors.read_text(encoding="utf-8").replace('id = "', 'id = "other-')
    renamed.write_text(text, encoding="utf-8")
    out = tmp_path / "out"
    assert track(second, renamed, out, "--biases-from", folder / "first") == EXIT_FAILED
    assert "the run contains biases of " in capsys.readouterr().err
