"""Output tables of a simulation: degrees and names on disk, and no truth in sensor data."""

import tomllib
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.simulation.observation.counts import counts_by_sensor
from multiradar.simulation.observation.observe import Observation, observe
from multiradar.simulation.output import measurements_frame, true_biases_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Bias, Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return replace(builtin_scenario("range-gain"), duration_s=120.0, start_time_s=1000.0)


@pytest.fixture(scope="module")
def observation(scenario: Scenario) -> Observation:
    return observe(scenario, np.random.default_rng(1))


def test_measurements_are_accepted_by_the_tracker(
    scenario: Scenario, observation: Observation
) -> None:
    frame = measurements_frame(scenario, observation)
    assert frame.schema == PLAIN_SCHEMA
    assert frame["time_s"].is_sorted()
    batch, rejected = wire.measurement_batch(
        frame, wire.sensor_table(parse_sensors(sensors_text(scenario)))
    )
    assert (len(batch), len(rejected)) == (len(frame), 0)
    assert np.min(frame["time_s"].to_numpy()) > 1000.0
    assert set(frame["kind"]) == {"radar", "adsb", "mlat"}
    radar = frame.filter(kind="radar")
    assert np.max(radar["azimuth_deg"].to_numpy()) > 300.0
    assert radar["latitude_deg"].is_null().all()
    assert frame.filter(kind="adsb")["range_m"].is_null().all()


def test_identities_are_reported_by_the_configured_sensors(
    scenario: Scenario, observation: Observation
) -> None:
    frame = measurements_frame(scenario, observation)
    assert frame.filter(kind="mlat")["mode_3a"].is_null().all()
    assert frame.filter(kind="mlat")["mode_s_address"].str.contains("^4000[0-9a-f]{2}$").all()
    south = frame.filter(sensor_id="south")
    assert south["mode_3a"].str.contains("^10[0-7]{2}$").all()
    assert south["track_number"].null_count() == 0
    clutter = frame.filter(pl.col("track_number").is_null())
    assert set(clutter["sensor_id"]) == {"north"}
    assert clutter["height_m"].is_null().all()


def test_row_i_of_the_truth_is_that_of_measurement_i(
    scenario: Scenario, observation: Observation
) -> None:
    frame, truth = measurements_frame(scenario, observation), truth_frame(scenario, observation)
    assert frame["time_s"].equals(truth["time_s"])
    assert frame["sensor_id"].equals(truth["sensor_id"])
    known = truth["track_number"].is_not_null()
    assert frame["track_number"].equals(truth["track_number"])
    assert truth.filter(known)["latitude_deg"].null_count() == 0
    assert truth.filter(~known)["latitude_deg"].null_count() == (~known).sum()
    adsb = (frame["kind"] == "adsb").to_numpy()
    north = (frame["latitude_deg"] - truth["latitude_deg"]).to_numpy()[adsb]
    assert np.std(north) * 111e3 == pytest.approx(30.0, rel=0.15)


def test_true_biases_have_the_names_and_units_of_biases_parquet(
    scenario: Scenario, observation: Observation
) -> None:
    frame = true_biases_frame(scenario, observation)
    assert frame.columns == ["time_s", "sensor_id", "parameter", "value"]
    last = frame.filter(time_s=1120.0)
    assert last.drop("time_s").rows() == [
        ("north", "range_offset_m", -220.0),
        ("north", "azimuth_offset_deg", pytest.approx(0.1)),
        ("north", "range_gain", -0.0008),
        ("south", "range_offset_m", 150.0),
        ("south", "azimuth_offset_deg", pytest.approx(-0.15)),
        ("south", "range_gain", 0.0012),
    ]
    assert len(frame) == 121 * 6


def test_sensors_file_has_priors_and_drift_but_not_the_truth(scenario: Scenario) -> None:
    offset = Bias(777.0, drift=0.5, prior=20.0, prior_sigma=300.0)
    fixed = Bias(0.009, estimate=False)
    azimuth = Bias(0.0123, drift=0.01, assumed_drift=0.02)
    late = Bias(0.75)
    south = replace(
        scenario.sensors[0],
        biases=(offset, azimuth, fixed, late),
        specified_biases=frozenset(range(4)),
    )
    text = sensors_text(replace(scenario, sensors=(south,)))
    assert "777" not in text
    assert "0.0123" not in text
    assert str(round(float(np.degrees(0.0123)), 12)) not in text
    known = tomllib.loads(text)["sensor"][0]["bias"]
    assert known["range_offset_m"] == {
        "estimate": True, "prior": 20.0, "prior_sigma": 300.0, "drift": 0.5
    }  # fmt: skip
    assert known["azimuth_offset_deg"]["drift"] == pytest.approx(np.degrees(0.02))
    assert known["range_gain"] == {"estimate": False}
    assert known["time_offset_s"] == {"estimate": True}


def test_sites_are_written_as_they_were_given(scenario: Scenario) -> None:
    south = tomllib.loads(sensors_text(scenario))["sensor"][0]
    assert (south["latitude_deg"], south["longitude_deg"]) == (56.2, 60.6)
    assert (south["azimuth_sigma_deg"], south["rotation_period_s"]) == (0.07, 5.0)


def test_opportunities_are_measurements_or_missed(
    scenario: Scenario, observation: Observation
) -> None:
    counts = counts_by_sensor(scenario, observation)
    assert list(counts) == ["adsb", "mlat", "north", "south"]
    assert all(one["looks"] == one["measurements"] + one["missed"] for one in counts.values())
    made = sum(one["measurements"] + one["clutter"] for one in counts.values())
    assert made == len(observation.measurements)
    assert counts["mlat"]["missed"] == pytest.approx(counts["mlat"]["looks"] / 2, rel=0.2)


def test_a_code_changes_at_the_configured_time() -> None:
    scenario = builtin_scenario("code-change")
    seen = observe(scenario, np.random.default_rng(3))
    frame = measurements_frame(scenario, seen)
    for one in scenario.aircraft:
        own = frame.filter(track_number=one.track_number)
        before = own.filter(pl.col("time_s") < one.code_change_s)["mode_3a"]
        after = own.filter(pl.col("time_s") >= one.code_change_s)["mode_3a"]
        assert before.unique().to_list() == [f"{one.mode_3a:04o}"]
        assert after.unique().to_list() == [f"{one.later_mode_3a:04o}"]
