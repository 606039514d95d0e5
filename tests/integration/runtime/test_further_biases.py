"""Clocks of reports, eccentric antennas and local frames are estimated where observable."""

import functools
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import multiradar as mr
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, PARAMETER_UNITS
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Bias, Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors

FILTERS = pytest.mark.parametrize("name", ["imm", "two-stage"])
FURTHER = {
    "late-reports": ("time_offset_s",),
    "eccentric-antenna": ("azimuth_sine_deg", "azimuth_cosine_deg"),
    "turned-frame": ("frame_east_m", "frame_north_m", "frame_rotation_deg"),
}
SCENES = pytest.mark.parametrize("scene", sorted(FURTHER))
EARTH_M = 6.37e6


def shorter(scene: str, duration_s: float = 600.0) -> Scenario:
    return replace(builtin_scenario(scene), duration_s=duration_s)


def without_errors(scenario: Scenario, parameters: tuple[str, ...]) -> Scenario:
    kinds = [PARAMETER_NAMES.index(name) for name in parameters]
    sensors = [
        replace(
            one, biases=tuple(Bias() if i in kinds else bias for i, bias in enumerate(one.biases))
        )
        for one in scenario.sensors
    ]
    return replace(scenario, sensors=tuple(sensors))


# The same for both filters, with and without the estimate.
@functools.cache
def observed(scenario: Scenario) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Return the measurements of a scenario, and their true positions."""
    observation = observe(scenario, np.random.default_rng(scenario.seed))
    return measurements_frame(scenario, observation), truth_frame(scenario, observation)


class Tracked:
    """A scenario, tracked with the further biases or without."""

    def __init__(
        self, scenario: Scenario, name: str, *, off: tuple[str, ...] = (), kinds: str = ""
    ) -> None:
        rows, true = observed(scenario)
        if kinds:
            own = rows["kind"].is_in(kinds.split())
            rows, true = rows.filter(own), true.filter(own)
        text = sensors_text(scenario)
        for parameter in off:
            text = text.replace(
                f"bias.{parameter}]\nestimate = true", f"bias.{parameter}]\nestimate = false"
            )
        table = sensor_table(parse_sensors(text))
        engine = Engine(table, TrackingSettings(filter_name=name))
        batch, _ = measurement_batch(rows, table)
        outputs = [engine.push(batch), engine.flush()]
        self.state, self.table = engine.biases, table
        self.unobservable = engine.unobservable_biases()
        engine.close()
        values = {one.identifier: one.biases for one in scenario.sensors}
        self.true = np.array(
            [
                values[table.ids[sensor]][kind].value
                for sensor, kind in zip(table.parameter_sensor, table.parameter_kind, strict=True)
            ]
        )
        updates = pl.concat(
            pl.DataFrame(
                {
                    "time_s": one.updates.time_s,
                    "sensor_id": np.array(table.ids)[one.updates.sensor],
                    "track_number": one.updates.track_number.astype(np.int64),
                    "north": np.degrees(one.updates.latitude_rad),
                    "east": np.degrees(one.updates.longitude_rad),
                }
            )
            for one in outputs
        )
        both = updates.join(true, on=["time_s", "sensor_id", "track_number"])
        assert len(both) > 0.8 * len(rows)
        late = both.filter(pl.col("time_s") > 120.0)
        south = np.radians((late["latitude_deg"] - late["north"]).to_numpy())
        west = np.radians((late["longitude_deg"] - late["east"]).to_numpy())
        west *= np.cos(np.radians(late["latitude_deg"].to_numpy()))
        self.rms_m = EARTH_M * float(np.sqrt(np.mean(south**2 + west**2)))

    def of(self, parameters: tuple[str, ...]) -> np.ndarray:
        kinds = [PARAMETER_NAMES.index(name) for name in parameters]
        return np.asarray(np.isin(self.table.parameter_kind, kinds))

    @property
    def sigmas_off(self) -> np.ndarray:
        return np.asarray(np.abs(self.state.estimate - self.true) / self.state.sigma)


@FILTERS
@SCENES
def test_an_error_is_recovered_within_three_sigma(scene: str, name: str) -> None:
    tracked = Tracked(shorter(scene), name)
    own = tracked.of(FURTHER[scene])
    assert own.any()
    assert tracked.sigmas_off.max() < 3.0
    # Known to a twentieth of its value, and of what was known of it.
    assert (tracked.state.sigma / np.abs(tracked.true))[own].max() < 0.05
    assert (tracked.state.sigma / tracked.table.prior_sigma)[own].max() < 0.05
    neglected = Tracked(shorter(scene), name, off=FURTHER[scene])
    assert tracked.rms_m < 0.95 * neglected.rms_m


@FILTERS
@SCENES
def test_without_the_error_its_estimate_does_no_harm(scene: str, name: str) -> None:
    right = without_errors(shorter(scene), FURTHER[scene])
    tracked = Tracked(right, name)
    assert tracked.sigmas_off.max() < 3.0
    assert tracked.rms_m < 1.01 * Tracked(right, name, off=FURTHER[scene]).rms_m


@FILTERS
@pytest.mark.parametrize(
    ("scene", "kinds", "expected"),
    [
        (
            "late-reports",
            "adsb mlat",
            "time offsets of multilateration and reports together",
        ),
        ("turned-frame", "radar mlat", "frame rotation of multilateration"),
        ("eccentric-antenna", "adsb", "azimuth sine of west"),
    ],
)
def test_what_is_unobservable_is_reported_and_not_applied(
    scene: str, kinds: str, expected: str, name: str
) -> None:
    tracked = Tracked(shorter(scene, 300.0), name, kinds=kinds)
    found = [one for one in tracked.unobservable if one.name == expected]
    assert [one.prior_ratio for one in found] == pytest.approx([1.0], abs=0.02)
    weights = np.array(found[0].weights) / tracked.table.prior_sigma
    # The estimate of the combination is that of its prior, 0.
    assert abs(weights @ tracked.state.estimate) < 0.05 * np.abs(weights).sum() * np.max(
        tracked.table.prior_sigma[weights != 0.0]
    )


def test_an_estimated_eccentricity_is_not_diagnosed_as_a_wrong_site() -> None:
    """Over the part of the circle with traffic, the site of `west` seemed 0.23 km off."""
    scene = mr.simulate("eccentric-antenna", seed=1002)
    run = mr.track(scene.folder, scene.sensors, filter="two-stage")
    assert run.report["figures"]["diagnoses"] == []


def test_angles_have_the_unit_of_their_name() -> None:
    for name, unit in zip(PARAMETER_NAMES, PARAMETER_UNITS, strict=True):
        assert unit == (np.radians(1.0) if name.endswith("_deg") else 1.0)
