"""Missing ranges: bearings of direction finders and of jammed radars."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, true_biases_frame
from multiradar.simulation.scenario.file import builtin_scenario, load_scenario
from multiradar.simulation.scenario.sensors_text import sensors_text


def test_ranges_are_lost_in_time() -> None:
    scenario = builtin_scenario("jamming")
    observation = observe(scenario, np.random.default_rng(1))
    frame = measurements_frame(scenario, observation)
    finders = frame.filter(pl.col("sensor_id").str.starts_with("df-"))
    assert finders["kind"].unique().to_list() == ["bearing"]
    radars = frame.filter(~pl.col("sensor_id").str.starts_with("df-"))
    jammed = pl.col("time_s").is_between(300.0, 600.0, closed="left")
    assert radars.filter(jammed)["kind"].unique().to_list() == ["bearing"]
    assert radars.filter(~jammed)["kind"].unique().to_list() == ["radar"]
    bearings = frame.filter(pl.col("kind") == "bearing")
    assert bearings["range_m"].null_count() == len(bearings)
    assert bearings["azimuth_deg"].null_count() == 0
    biases = true_biases_frame(scenario, observation)
    parameters = biases.filter(pl.col("sensor_id") == "df-north")["parameter"].unique().to_list()
    assert parameters == ["azimuth_offset_deg"]
    assert 'kind = "direction-finder"' in sensors_text(scenario)


@pytest.mark.parametrize(
    "key", ["range_sigma_m = 30", "jammed_s = [[1, 2]]", "bias.range_offset_m = 5"]
)
def test_a_direction_finder_rejects_range_keys(key: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    text = f"""
        duration_s = 10
        [[aircraft]]
        latitude_deg = 50.2
        longitude_deg = 15
        height_m = 9000
        speed_mps = 200
        heading_deg = 90
        [[sensor]]
        id = "df"
        kind = "direction-finder"
        latitude_deg = 50
        longitude_deg = 15
        {key}
    """
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="direction-finder df"):
        load_scenario(path)
