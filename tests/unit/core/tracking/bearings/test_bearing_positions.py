"""Positions by bearings of biased sensors: state at the biases, and sensitivity to them."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.bias.store import prior
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.tracking.bearings.bearing_positions import Bounds, locate
from multiradar.tracking.bearings.waiting_bearings import WaitingBearing
from multiradar.tracking.model import filter_model
from multiradar.tracking.pool import Start
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.scenarios.moving_scene import PLANE, Path

SITES = ((49.6, 15.2, 300.0), (50.0, 14.4, 400.0))
TARGET = Path((-20e3, 30e3), (200.0, 40.0), height_m=8000.0)
#: Value and prior sigma, in the units of the sensors file.
BIASES = {
    "azimuth_offset_deg": (0.4, 0.2),
    "azimuth_sine_deg": (1.0, 0.5),
    "azimuth_cosine_deg": (-0.8, 0.5),
    "time_offset_s": (2.0, 1.0),
}
BOUNDS = Bounds(speed_sigma_mps=300.0, speed_max_mps=700.0, distance_share_max=0.5)
#: So accurate that the priors of heights and speeds have no effect.
SIGMA_DEG = 1e-3


def _located(
    named: dict[str, tuple[float, float]], *, elevations: bool = False, shift: float = 0.0,
    kind: str = "direction-finder",
) -> tuple[Start, np.ndarray]:  # fmt: skip
    """Return the start by bearings with biases, found at estimates `shift` sigmas off, and them."""
    bias = {
        name: {"estimate": True, "prior": value, "prior_sigma": sigma}
        for name, (value, sigma) in named.items()
    }
    every = [
        Sensor.model_validate(
            {
                "id": f"df-{number}", "kind": kind, "latitude_deg": latitude,
                "longitude_deg": longitude, "height_m": height, "azimuth_sigma_deg": SIGMA_DEG,
                "elevation_sigma_deg": SIGMA_DEG, "bias": bias,
            }
        )
        for number, (latitude, longitude, height) in enumerate(SITES)
    ]  # fmt: skip
    table = sensor_table(SensorsFile(sensor=tuple(every)))
    biases = prior(table)
    off = shift * biases.sigma
    model = filter_model(table, TrackingSettings(), PLANE, biases)
    own = np.flatnonzero(table.parameter_sensor == 0).tolist()
    value = {PARAMETER_NAMES[table.parameter_kind[at]]: biases.estimate[at] for at in own}
    seen = []
    for time_s in np.arange(0.0, 30.0, 3.0):
        for number, site in enumerate(SITES):
            flown_s = np.array([time_s - value.get("time_offset_s", 0.0)])
            place = [float(one[0]) for one in TARGET.geodetic(flown_s)]
            at = np.radians(site[0]), np.radians(site[1]), site[2]
            _, true, elevation = slant_range_azimuth(at, *place)
            azimuth = (
                true
                + value.get("azimuth_offset_deg", 0.0)
                + value.get("azimuth_sine_deg", 0.0) * np.sin(true)
                + value.get("azimuth_cosine_deg", 0.0) * np.cos(true)
            )
            seen.append(
                WaitingBearing(
                    time_s, number, float(azimuth), float(elevation) if elevations else np.nan,
                    TARGET.height_m, model.sites[number], moving=False,
                )
            )  # fmt: skip
    found = locate(seen, table, BOUNDS, model, replace(biases, estimate=biases.estimate + off))
    assert found is not None
    return found, biases.estimate + off


@pytest.mark.parametrize("elevations", [False, True])
@pytest.mark.parametrize("name", BIASES)
def test_the_position_is_that_without_the_bias(name: str, elevations: bool) -> None:
    found, estimate = _located({name: BIASES[name]}, elevations=elevations)
    true = np.append(TARGET.at(np.array([27.0]))[0], TARGET.velocity_mps)
    state = found.mean + found.sensitivity @ estimate
    # The height matters to bearings by metres, the plane to velocities.
    np.testing.assert_allclose(state[:2], true[:2], rtol=0, atol=30.0)
    np.testing.assert_allclose(state[2:], true[2:], rtol=0, atol=3.0)


@pytest.mark.parametrize("elevations", [False, True])
def test_the_sensitivity_is_the_change_with_the_biases(elevations: bool) -> None:
    states = []
    for shift in (-0.01, 0.01):
        found, estimate = _located(BIASES, elevations=elevations, shift=shift)
        states.append((found.mean + found.sensitivity @ estimate, estimate))
    (before, low), (after, high) = states
    expected = found.sensitivity @ (high - low)
    assert np.hypot(*expected[:2]) > 5.0
    np.testing.assert_allclose(after - before, expected, rtol=0.05, atol=0.2)


def test_the_shift_of_a_frame_is_neglected_as_in_the_filter() -> None:
    """Regression: the start depended on a shift that no later bearing is corrected for."""
    plain, _ = _located({"azimuth_offset_deg": BIASES["azimuth_offset_deg"]}, kind="radar")
    shifts = {"frame_east_m": (500.0, 200.0), "frame_north_m": (-300.0, 200.0)}
    named = {"azimuth_offset_deg": BIASES["azimuth_offset_deg"]} | shifts
    found, estimate = _located(named, kind="radar")
    of_shift = np.abs(estimate) > 100.0
    assert of_shift.sum() == 4
    assert (found.sensitivity[:, of_shift] == 0.0).all()
    np.testing.assert_allclose(found.mean, plain.mean, rtol=1e-12)
