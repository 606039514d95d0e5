"""Bias jumps, silent radars and wrong configurations raise alarms; healthy radars do not."""

from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from validation.tracker import check_health

#: An offset is right again so long after its jump, to so much: s, m, degrees.
RIGHT_AGAIN = ((30.0, 25.0, 0.012), (60.0, 10.0, 0.006))


def simulated(name: str, duration_s: float | None = None) -> tuple[MeasurementBatch, SensorTable]:
    scene = builtin_scenario(name)
    return check_health.simulated(replace(scene, duration_s=duration_s or scene.duration_s))


def tracked(batch: MeasurementBatch, table: SensorTable, **more: Any) -> Any:
    settings = TrackingSettings(filter_name=more.pop("filter_name", "two-stage"))
    return check_health.tracked(batch, table, settings, **more)


@pytest.mark.parametrize("filter_name", ["two-stage", "imm", "joint"])
@pytest.mark.fault(15)
def test_jumps_are_detected_in_three_scans_the_biases_follow_and_no_track_is_broken(
    filter_name: str,
) -> None:
    scene = builtin_scenario("radar-jump")
    run = tracked(*simulated("radar-jump"), filter_name=filter_name)
    west, north, _ = scene.sensors
    jumps = [(west, west.biases[0]), (north, north.biases[1])]
    alarms = run.alarms()
    assert [(name, alarm) for _, name, alarm in alarms] == [
        ("west", "bias_jump"), ("north", "bias_jump"),
    ]  # fmt: skip
    for (found_s, _, _), (sensor, bias) in zip(alarms, jumps, strict=True):
        assert sensor.rotation_period_s is not None
        assert 0.0 <= found_s - bias.jump_s <= 3.0 * sensor.rotation_period_s
    for after_s, range_m, azimuth_deg in RIGHT_AGAIN:
        found, _ = run.bias("west", "range_offset_m", jumps[0][1].jump_s + after_s)
        assert found == pytest.approx(270.0, abs=range_m)
        found, _ = run.bias("north", "azimuth_offset_deg", jumps[1][1].jump_s + after_s)
        assert found == pytest.approx(0.18, abs=azimuth_deg)
    # One track for each aircraft, from its first plot to its last.
    assert len(np.unique(run.updates.track_id)) == len(np.unique(run.updates.track_number)) == 30
    assert run.counts["RESTARTED"] == run.counts["REFUSED"] == 0


def test_health_does_not_depend_on_batches_or_workers() -> None:
    batch, table = simulated("radar-jump", 340.0)
    whole = tracked(batch, table)
    assert [name for _, name, _ in whole.alarms()] == ["west"]
    for more in ({"rows": 1}, {"rows": 7}, {"workers": 2}):
        other = tracked(batch, table, **more)
        assert other.health.equals(whole.health), more
        assert other.biases.equals(whole.biases), more
        np.testing.assert_array_equal(
            other.updates.latitude_rad, whole.updates.latitude_rad, err_msg=str(more)
        )


@pytest.mark.parametrize(
    ("name", "filter_name"),
    [
        ("manoeuvring-traffic", "two-stage"),
        ("manoeuvring-traffic", "ci"),
        ("report-1-6", "blom"),
        ("two-radars-one-site", "two-stage"),
        ("drifting-biases", "imm"),
        ("clutter", "two-stage"),
    ],
)
def test_radars_that_are_well_raise_no_alarm(name: str, filter_name: str) -> None:
    assert tracked(*simulated(name), filter_name=filter_name).alarms() == []


@pytest.mark.fault(14)
def test_silence_is_reported_within_the_gaps_and_detection_matches_the_scenario() -> None:
    run = tracked(*simulated("rotating-gaps"))
    sensors = {one.identifier: one for one in builtin_scenario("rotating-gaps").sensors}
    alarms = run.alarms()
    assert {alarm for _, _, alarm in alarms} == {"silent"}
    for time_s, name, _ in alarms:
        turn_s = sensors[name].rotation_period_s
        assert turn_s is not None
        gaps = [(start, end) for start, end in sensors[name].gaps_s if start < time_s <= end + 4.0]
        assert len(gaps) == 1, (time_s, name)
        assert time_s - gaps[0][0] <= 7.0 * turn_s + 4.0
    last = run.health.group_by("sensor_id").last()
    for name, found, alarm in last.select(
        "sensor_id", "detection_probability", "alarms"
    ).iter_rows():
        assert found == pytest.approx(sensors[name].detection_probability, abs=0.03)
        assert alarm == ""


def test_noise_configured_too_small_is_measured() -> None:
    batch, table = simulated("crossing")
    north = table.ids.index("north")
    configured = table.range_sigma_m.copy()
    configured[north] = 12.0
    run = tracked(batch, replace(table, range_sigma_m=configured), filter_name="imm")
    assert {(name, alarm) for _, name, alarm in run.alarms()} == {("north", "noise")}
    ratio = run.health.filter(pl.col("sensor_id") == "north")["range_sigma_ratio"][-1]
    # The tracks overweight the radar, and their published sigma is too small.
    assert ratio == pytest.approx(40.0 / 12.0, rel=0.3)


@pytest.mark.fault(13)
def test_a_site_configured_a_kilometre_off_raises_an_alarm() -> None:
    batch, table = simulated("crossing")
    west = table.ids.index("west")
    latitude = table.latitude_rad.copy()
    latitude[west] += 1000.0 / 6.37e6
    run = tracked(batch, replace(table, latitude_rad=latitude))
    assert "site" in {alarm for _, _, alarm in run.alarms()}
    assert tracked(batch, table).alarms() == []


def test_silence_is_reported_an_epoch_after_five_scans_if_one_radar_remains() -> None:
    batch, table = simulated("crossing", 200.0)
    remaining, *others = (table.ids.index(name) for name in ("north", "west", "east"))
    end_s = batch.time_s.min() + 100.0
    batch = batch.select((batch.sensor == remaining) | (batch.time_s < end_s))
    alarms = [(time_s, name) for time_s, name, alarm in tracked(batch, table).alarms()]
    assert {name for _, name in alarms} == {table.ids[one] for one in others}
    for time_s, name in alarms:
        own = table.ids.index(name)
        late_s = time_s - batch.time_s[batch.sensor == own].max()
        late_s -= 5.0 * table.rotation_period_s[own]
        assert 0.0 <= late_s <= TrackingSettings().epoch_s, name
