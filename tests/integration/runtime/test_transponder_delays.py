"""Delays of transponders: estimated beside the biases, whose sigmas are too small without them."""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from multiradar_schemas.products.aircraft_delay import AIRCRAFT_DELAY_SCHEMA

KEY = "transponder_delay_sigma_m"
SIGMA_M = 30.0
DURATION_S = 500
OFFSET_M = {"west": 120.0, "north": -260.0}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("delays") / "scene"
    command = ["simulate", "transponder-delays", "--duration", str(DURATION_S)]
    assert run([*command, "--out", str(folder)]) == EXIT_DONE
    text = (folder / "sensors.toml").read_text(encoding="utf-8")
    without = "\n".join(line for line in text.splitlines() if not line.startswith(KEY))
    (folder / "without.toml").write_text(without, encoding="utf-8")
    return folder


def tracked(scene: Path, sensors: str, out: Path, *more: str) -> dict[str, dict[str, float]]:
    command = ["track", str(scene), "--sensors", str(scene / sensors), "--out", str(out), *more]
    assert run(command) == EXIT_DONE
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    of_radars = {name: report["figures"]["final_biases"][name] for name in OFFSET_M}
    return {name: one["range_offset_m"] for name, one in of_radars.items()}


def sigmas_off(found: dict[str, dict[str, float]]) -> float:
    return max(
        abs(found[name]["estimate"] - true) / found[name]["sigma"]
        for name, true in OFFSET_M.items()
    )


@pytest.mark.parametrize("name", ["imm", "two-stage"])
def test_delays_are_recovered_and_make_the_sigmas_of_the_offsets_right(
    scene: Path, tmp_path: Path, name: str
) -> None:
    """Without them the offsets are many sigmas off: they follow the mean delay of the aircraft."""
    filters = ("--filter", name, "--kinds", "radar,adsb")
    without = tracked(scene, "without.toml", tmp_path / "without", *filters)
    assert not (tmp_path / "without" / "aircraft_delays.parquet").exists()
    found = tracked(scene, "sensors.toml", tmp_path / "with", *filters)
    assert sigmas_off(without) > 5.0
    assert sigmas_off(found) < 3.0
    truth = pl.read_parquet(scene / "truth_delays.parquet")
    rows = pl.read_parquet(tmp_path / "with" / "aircraft_delays.parquet")
    assert rows.schema == AIRCRAFT_DELAY_SCHEMA
    assert set(rows["mode_s_address"]) <= set(truth["mode_s_address"])
    both = rows.join(truth, "track_number", suffix="_true")
    assert len(both) == len(rows) == len(truth)
    error = (both["delay_m"] - both["delay_m_true"]).to_numpy()
    assert np.std(both["delay_m_true"].to_numpy()) > 20.0
    assert np.std(error) < 10.0
    assert np.mean((error / both["sigma_m"].to_numpy()) ** 2) < 4.0
    np.testing.assert_allclose(both["prior_ratio"], both["sigma_m"] / SIGMA_M)
    figures = json.loads((tmp_path / "with" / "report.json").read_text(encoding="utf-8"))["figures"]
    assert figures["aircraft_delays"]["tracks"] == len(rows)


def test_another_filter_is_a_clear_error(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["track", str(scene), "--sensors", str(scene / "sensors.toml"), "--filter", "blom"]
    assert run([*command, "--out", str(tmp_path / "none")]) != EXIT_DONE
    said = capsys.readouterr().err
    assert "filter: expected two-stage or imm if transponder_delay_sigma_m is configured" in said
    assert not (tmp_path / "none").exists()
