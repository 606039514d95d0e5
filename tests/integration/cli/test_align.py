"""`multiradar align` as a user calls it: biases of the sample, files and exit status."""

import json
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar_schemas.alignment import Alignment
from multiradar_schemas.sensors.sensor import load_sensors
from support.asterix.octets import block, plot_048
from support.pages import read_page
from support.paths import SAMPLE

SENSORS = SAMPLE.parent / "sensors-vid-sample.toml"
TRUTH = {
    ("26-10", "range_offset_m"): 185.0, ("26-10", "azimuth_offset_deg"): -0.19,
    ("35-10", "range_offset_m"): -120.0, ("35-10", "azimuth_offset_deg"): 0.17,
    ("41-1", "range_offset_m"): 60.0, ("41-1", "azimuth_offset_deg"): -0.08,
    ("41-10", "range_offset_m"): 60.0, ("41-10", "azimuth_offset_deg"): -0.08,
}  # fmt: skip


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("align") / "sample"
    assert run(["convert", "vid", str(SAMPLE), str(out), "--date", "2018-08-01"]) == EXIT_DONE
    return out


def align(*arguments: object) -> int:
    return run(["align", *map(str, arguments)])


def test_biases_of_the_sample(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    priors, page = tmp_path / "priors.toml", tmp_path / "page.html"
    capsys.readouterr()
    command = [sample, "--sensors", SENSORS, "--kinds", "radar", "--json"]
    assert align(*command, "--toml", priors, "--html", page) == EXIT_DONE
    text = capsys.readouterr().out
    found = Alignment.model_validate_json(text)
    assert found.counts.read == found.counts.accepted + found.counts.duplicate == 23_996
    for one in found.biases:
        error = one.estimate - TRUTH[one.sensor_id, one.parameter]
        assert abs(error) < 4.0 * one.sigma
        assert one.prior_ratio < 0.02
        assert not one.drifts
    whole = found.residuals
    assert whole.before is not None
    assert whole.after is not None
    assert whole.best is not None
    assert whole.after.median_m < 0.4 * whole.before.median_m
    assert whole.best.rms_m <= whole.after.rms_m < 1.03 * whole.best.rms_m
    assert sum(one.residuals.pairs for one in found.pairs) == whole.pairs
    assert sum(one.residuals.pairs for one in found.radars) == 2 * whole.pairs
    assert not found.unobservable
    assert not found.warnings
    assert len(found.trend) > 8
    _check_priors(priors, found)
    reader = read_page(page)
    for heading in ("Map of residuals", "Residuals by radar", "Range offset over time", "35-10"):
        assert heading in reader.headings


def _check_priors(priors: Path, found: Alignment) -> None:
    before = {one.id: one for one in load_sensors(SENSORS).sensor}
    after = {one.id: one for one in load_sensors(priors).sensor}
    assert list(after) == list(before)
    for one in found.biases:
        prior = getattr(after[one.sensor_id].bias, one.parameter)
        assert prior.estimate
        assert prior.prior == pytest.approx(one.estimate, abs=0.01 * one.sigma)
        assert prior.prior_sigma == pytest.approx(one.sigma, rel=0.01)
    for name, sensor in after.items():
        same = before[name].model_dump(exclude={"bias"})
        assert sensor.model_dump(exclude={"bias"}) == same


def test_priors_are_accepted_by_track(sample: Path, tmp_path: Path) -> None:
    rows = pl.read_parquet(sample / "measurements.parquet").head(6000)
    small, priors = tmp_path / "small.parquet", tmp_path / "priors.toml"
    rows.write_parquet(small)
    assert align(small, "--sensors", SENSORS, "--toml", priors) == EXIT_DONE
    command = ["track", str(small), "--sensors", str(priors), "--out", str(tmp_path / "tracks")]
    assert run(command) == EXIT_DONE
    report = json.loads((tmp_path / "tracks" / "report.json").read_text(encoding="utf-8"))
    bias = report["figures"]["final_biases"]["26-10"]["range_offset_m"]
    assert abs(bias["estimate"] - 185.0) < 15.0


def test_recordings_of_several_forms_are_one(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = pl.read_parquet(sample / "measurements.parquet").head(6000)
    halves = [tmp_path / "a.parquet", tmp_path / "b.parquet"]
    rows.filter(sensor_id="26-10").write_parquet(halves[0])
    rows.filter(pl.col("sensor_id") != "26-10").write_parquet(halves[1])
    found = []
    for given in (halves, [tmp_path / "whole.parquet"]):
        rows.write_parquet(tmp_path / "whole.parquet")
        capsys.readouterr()
        assert align(*given, "--sensors", SENSORS, "--json") == EXIT_DONE
        found.append(Alignment.model_validate_json(capsys.readouterr().out))
    apart, together = found
    assert len(apart.inputs) == 2
    assert apart.counts == together.counts
    few = [one for one in together.radars if one.residuals.aircraft < 10]
    assert few
    assert [line.partition(" aircraft in common")[0] for line in together.warnings] == [
        f"{one.sensor_id}: {one.residuals.aircraft}" for one in few
    ]
    # Rows of equal times are in another order.
    for one, other in zip(apart.biases, together.biases, strict=True):
        assert abs(one.estimate - other.estimate) < 0.1 * other.sigma


def test_a_radar_alone_cannot_be_aligned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, sensors = tmp_path / "radar.ast", tmp_path / "sensors.toml"
    plots = [plot_048(28_800.0 + 4 * k, azimuth_deg=90.0 + 0.1 * k) for k in range(40)]
    recording.write_bytes(b"".join(block(48, one) for one in plots))
    sensors.write_text(
        '[[sensor]]\nsac = 20\nsic = 130\nkind = "radar"\nlatitude_deg = 39.5\n'
        "longitude_deg = -0.5\nheight_m = 100\nrotation_period_s = 4.0\n", encoding="utf-8",
    )  # fmt: skip
    page = tmp_path / "page.html"
    assert align(recording, "--sensors", sensors, "--html", page) == EXIT_FAILED
    assert "no aircraft has plots from two sensors" in capsys.readouterr().err
    assert not page.exists()


def test_wrong_usage(sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert align(sample, "--sensors", SENSORS, "--folds", "1") == EXIT_USAGE
    assert align(tmp_path / "nothing", "--sensors", SENSORS) == EXIT_FAILED
    assert "no such file" in capsys.readouterr().err
    page = tmp_path / "page.html"
    page.write_text("mine")
    assert align(sample, "--sensors", SENSORS, "--html", page) == EXIT_FAILED
    assert page.read_text() == "mine"


def test_mistakes_are_named_by_sensor(
    sample: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = pl.read_parquet(sample / "measurements.parquet").filter(pl.col("kind") == "radar")
    frame = frame.filter(pl.col("time_s") < frame["time_s"].to_numpy().min() + 300.0)
    shorter = pl.when(sensor_id="26-10").then(pl.col("range_m") / 1e3).otherwise("range_m")
    frame.with_columns(range_m=shorter).write_parquet(tmp_path / "one.parquet")
    frame.with_columns(pl.col("range_m") / 1e3).write_parquet(tmp_path / "all.parquet")
    for name in ("one", "all"):
        assert align(tmp_path / f"{name}.parquet", "--sensors", SENSORS) == EXIT_FAILED
        assert "26-10: its ranges are probably in kilometres" in capsys.readouterr().err


def test_a_recording_given_twice_is_a_mistake(
    sample: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    same = sample / ".." / sample.name
    assert align(sample, same, "--sensors", SENSORS) == EXIT_FAILED
    assert f"{sample}: given 2 times, expected once" in capsys.readouterr().err
