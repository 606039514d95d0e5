"""Correction for a known bias equals estimation with a very small prior sigma."""

import re
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import scenario_of, scenario_table
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors

BIASES = (
    {"range_offset_m": 250.0, "azimuth_offset_deg": -0.21, "range_gain": 0.002},
    {"range_offset_m": -90.0, "azimuth_offset_deg": 0.3, "time_offset_s": 0.8},
)


@pytest.fixture(scope="module")
def scene() -> tuple[pl.DataFrame, str]:
    radars = [
        {
            "id": f"radar-{number}",
            "east_m": 12e4 * number,
            "north_m": -5e4,
            "interval_s": 4.0,
            "bias": {
                name: {"value": value, "prior": value, "prior_sigma": 1e-9}
                for name, value in known.items()
            },
        }
        for number, known in enumerate(BIASES)
    ]
    traffic = {"count": 8, "east_m": [-8e4, 2e5], "north_m": [-1e5, 1e5]}
    place = {"latitude_deg": 50.0, "longitude_deg": 10.0}
    values = {"duration_s": 200.0, "plane": place, "traffic": [traffic], "sensor": radars}
    described = scenario_of(scenario_table(values, source="the test"))
    seen = observe(described, np.random.Generator(np.random.PCG64(1)))
    return measurements_frame(described, seen), sensors_text(described)


def positions(rows: pl.DataFrame, table: SensorTable) -> pl.DataFrame:
    engine = Engine(table, TrackingSettings())
    batch, _ = measurement_batch(rows, table)
    outputs = [engine.push(batch), engine.flush()]
    engine.close()
    metres = 6.37e6
    return pl.concat(
        pl.DataFrame(
            {
                "time_s": one.updates.time_s.round(6),
                "sensor": one.updates.sensor,
                "number": one.updates.track_number,
                "north_m": one.updates.latitude_rad * metres,
                "east_m": one.updates.longitude_rad * metres * np.cos(np.radians(50.0)),
            }
        )
        for one in outputs
    )


def apart_m(first: pl.DataFrame, second: pl.DataFrame) -> float:
    """Return the root mean square between tracks from a minute on."""
    both = first.join(second, on=["time_s", "sensor", "number"]).filter(pl.col("time_s") > 60.0)
    assert len(both) > 0.9 * len(first.filter(pl.col("time_s") > 60.0))
    off = both.select(
        pl.col("east_m") - pl.col("east_m_right"), pl.col("north_m") - pl.col("north_m_right")
    ).to_numpy()
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def known(text: str) -> SensorTable:
    return sensor_table(parse_sensors(text.replace("estimate = true", "estimate = false")))


def without_clocks(text: str) -> str:
    """Return the sensors with a known time offset: time stamps are then corrected in both."""
    head, clock, tail = text.partition("time_offset_s")
    assert clock
    return head + clock + tail.replace("estimate = true", "estimate = false", 1)


def test_tracks_equal_those_with_a_very_small_sigma(scene: tuple[pl.DataFrame, str]) -> None:
    rows, text = scene
    corrected = positions(rows, known(text))
    tight = positions(rows, sensor_table(parse_sensors(without_clocks(text))))
    assert apart_m(corrected, tight) < 1.0


@pytest.mark.parametrize("name", ["range_offset_m", "azimuth_offset_deg", "range_gain"])
def test_sign_and_magnitude_of_a_known_bias_matter(
    scene: tuple[pl.DataFrame, str], name: str
) -> None:
    rows, text = scene
    right = positions(rows, known(text))
    turned = re.sub(rf"(bias.{name}\][^\[]*prior = )", r"\g<1>-", text).replace("--", "")
    assert turned != text
    assert apart_m(right, positions(rows, known(turned))) > 20.0


def test_a_known_time_offset_moves_the_time_of_its_measurements(
    scene: tuple[pl.DataFrame, str],
) -> None:
    rows, text = scene
    table = known(text)
    batch, rejected = measurement_batch(rows, table)
    assert not len(rejected)
    late = np.where(batch.sensor == 1, 0.8, 0.0)
    np.testing.assert_allclose(batch.time_s, rows["time_s"].to_numpy() - late)


def test_clock_offsets_beyond_the_reorder_horizon_are_rejected(
    scene: tuple[pl.DataFrame, str],
) -> None:
    table = known(scene[1])
    with pytest.raises(ConfigurationError, match=r"reorder_horizon_s: expected at least 0.8 s"):
        Engine(table, TrackingSettings(reorder_horizon_s=0.5))
    nothing = replace(table, known_bias=np.zeros((2, 4)))
    Engine(nothing, TrackingSettings(reorder_horizon_s=0.5)).close()
