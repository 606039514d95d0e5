"""Position observability of tracks: ranges, or bearings intersecting from two sites."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_NAMES,
)
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.restoration.geometry.observability import Observability, observability
from multiradar.restoration.geometry.plot_positions import Plots
from multiradar.restoration.geometry.straight_flight import Sightings
from multiradar.wire import measurement_batch
from support.scenarios import bearing_scene, moving_scene

Floats = NDArray[np.float64]

SENSORS = bearing_scene.sensors()
NONE = np.zeros((len(SENSORS), len(PARAMETER_NAMES)))
PLACE = float(np.radians(49.9)), float(np.radians(15.2)), 9000.0


def bearings(*names: str, kind: int = 2, offset_rad: float = 0.0) -> Plots:
    """A bearing of each of the sensors, of an aircraft at `PLACE`."""
    sensor = np.array([SENSORS.ids.index(name) for name in names], np.int64)
    azimuth = []
    for one in sensor.tolist():
        site = (
            float(SENSORS.latitude_rad[one]), float(SENSORS.longitude_rad[one]),
            float(SENSORS.height_m[one]),
        )  # fmt: skip
        azimuth.append(float(slant_range_azimuth(site, *PLACE)[1]))
    nothing = np.full(len(sensor), np.nan)
    return Plots(
        np.arange(len(sensor), dtype=np.float64), sensor, np.full(len(sensor), kind, np.int8),
        nothing, np.array(azimuth) + offset_rad, nothing, nothing, nothing, nothing,
    )  # fmt: skip


def test_lines_from_two_sites_intersect() -> None:
    """Two lines at an angle γ: the least eigenvalue of Σ n nᵀ/σ² is (1 − |cos γ|)/σ²."""
    found = observability(bearings("df-1", "df-2"), SENSORS, NONE, PLACE)
    assert (found.ranges, found.bearings, found.places) == (0, 2, 2)
    north, south = bearings("df-1", "df-2").azimuth_rad
    sigma = SENSORS.azimuth_sigma_rad[SENSORS.ids.index("df-1")]
    expected = np.sqrt(1.0 - abs(np.cos(north - south))) / sigma
    # The meridians of the sites converge by 0.8°, the lines intersect at 24°.
    assert found.crossing == pytest.approx(expected, rel=0.05)
    assert found.lines_cross
    assert found.is_observable


def test_one_site_does_not_observe_the_distance() -> None:
    """For any number of bearings and any rotation of the line."""
    scans = [bearings("df-1", offset_rad=turn) for turn in np.linspace(-0.5, 0.5, 20)]
    many = Plots(*(np.concatenate(columns) for columns in zip(*scans, strict=True)))
    found = observability(many, SENSORS, NONE, PLACE)
    assert (found.bearings, found.places, found.crossing) == (20, 1, 0.0)
    assert not found.is_observable


def test_a_range_is_enough() -> None:
    plots = bearings("41-10", kind=0)
    found = observability(plots, SENSORS, NONE, PLACE)
    assert (found.ranges, found.bearings, found.places) == (1, 0, 0)
    assert found.is_observable
    assert not found.lines_cross


def test_biases_rotate_the_lines() -> None:
    """A bias rotates the line from `df-1` until both lines are parallel."""
    plots = bearings("df-1", "df-2")
    north, south = plots.azimuth_rad
    biases = NONE.copy()
    biases[SENSORS.ids.index("df-1"), PARAMETER_AZIMUTH_OFFSET] = north - south
    assert observability(plots, SENSORS, biases, PLACE).crossing < 10.0
    assert observability(plots, SENSORS, NONE, PLACE).crossing > 50.0


def test_eccentricity_rotates_the_lines_as_far_as_an_offset_there() -> None:
    plots = bearings("df-1", "df-2")
    own = SENSORS.ids.index("df-1")
    turned, waved = NONE.copy(), NONE.copy()
    waved[own, PARAMETER_AZIMUTH_SINE] = np.radians(9.0)
    waved[own, PARAMETER_AZIMUTH_COSINE] = np.radians(7.0)
    true = plots.azimuth_rad[0]
    for _ in range(9):
        turned[own, PARAMETER_AZIMUTH_OFFSET] = waved[own, [4, 5]] @ [np.sin(true), np.cos(true)]
        true = plots.azimuth_rad[0] - turned[own, PARAMETER_AZIMUTH_OFFSET]
    expected = observability(plots, SENSORS, turned, PLACE).crossing
    assert observability(plots, SENSORS, waved, PLACE).crossing == pytest.approx(expected, rel=1e-3)
    assert observability(plots, SENSORS, NONE, PLACE).crossing != pytest.approx(expected, rel=0.05)


def test_bias_uncertainty_limits_many_bearings() -> None:
    """Lines intersecting at 3°, a thousand of 0.2° each, with unknown biases of 1°."""
    north, south = bearings("df-1", "df-2").azimuth_rad
    many = Plots(*(np.tile(column, 1000) for column in bearings("df-1", "df-2")))
    biases = NONE.copy()
    # `df-1` is rotated so that the lines intersect at 3° only.
    biases[SENSORS.ids.index("df-1"), PARAMETER_AZIMUTH_OFFSET] = north - south - np.radians(3.0)
    known = observability(many, SENSORS, biases, PLACE)
    assert known.crossing > 100.0
    unknown = observability(many, SENSORS, biases, PLACE, bias_sigma_rad=np.radians(1.0))
    assert not unknown.is_observable
    # Two lines, each with 1° of error: the convergence of the meridians is 0.8°.
    apart_deg = 3.0 + np.array([-0.8, 0.8])
    least, most = np.sqrt(1.0 - np.cos(np.radians(apart_deg))) / np.radians(1.0)
    assert least < unknown.crossing < most
    wide = observability(many, SENSORS, NONE, PLACE, bias_sigma_rad=np.radians(1.0))
    assert wide.is_observable


def test_bias_uncertainty_reduces_the_crossing_strength() -> None:
    """Σ n nᵀ/σ² with the common covariance of all bearings of a source, as a whole matrix."""
    scans = [bearings("df-1", "df-2", offset_rad=turn) for turn in np.linspace(-0.2, 0.2, 9)]
    many = Plots(*(np.concatenate(columns) for columns in zip(*scans, strict=True)))
    bias = np.radians(0.7)
    information = np.zeros((2, 2))
    for name in ("df-1", "df-2"):
        one = SENSORS.ids.index(name)
        azimuth = many.azimuth_rad[many.sensor == one]
        # The convergence of the meridians, up to 1.5°, has little effect here.
        normals = np.stack([np.cos(azimuth), -np.sin(azimuth)])
        sigma = SENSORS.azimuth_sigma_rad[one]
        covariance = sigma**2 * np.eye(len(azimuth)) + bias**2
        information += normals @ np.linalg.solve(covariance, normals.T)
    expected = np.sqrt(np.linalg.eigvalsh(information)[0])
    found = observability(many, SENSORS, NONE, PLACE, bias_sigma_rad=bias)
    assert found.crossing == pytest.approx(expected, rel=0.1)
    assert found.crossing < 0.9 * observability(many, SENSORS, NONE, PLACE).crossing


def test_without_measurements_nothing_is_observable() -> None:
    found = observability(bearings(), SENSORS, NONE, PLACE)
    assert tuple(found) == (0, 0, 0, 0.0)
    assert not found.is_observable


MOVERS = moving_scene.sensors()
NO_BIAS = np.zeros((len(MOVERS), len(PARAMETER_NAMES)))
TARGET = moving_scene.Path((40e3, 30e3), (-150.0, -120.0))
CIRCLING = moving_scene.Path((0.0, 0.0), height_m=3e3, radius_m=8e3, turn_rad_per_s=0.025)
STRAIGHT = moving_scene.Path((0.0, 0.0), (200.0, 0.0), height_m=3000.0)


def evaluated(
    sensor: str, target: moving_scene.Path, source: moving_scene.Path | None, *,
    elevations: bool = False, heights: bool = False, until_s: float = 120.0, bias_deg: float = 0.0,
) -> Observability:  # fmt: skip
    """Observability by two minutes of one sensor, linearised at the truth."""
    time_s = np.arange(0.0, until_s, 2.0)
    frame = moving_scene.seen(
        sensor, target, 1, time_s, np.random.default_rng(1), source=source,
        elevations=elevations, heights=heights,
    )  # fmt: skip
    batch, rejected = measurement_batch(frame, MOVERS)
    assert not len(rejected)
    measured = batch.directions
    plots = Plots(
        batch.time_s, batch.sensor, batch.kind, batch.range_m, batch.azimuth_rad,
        batch.latitude_rad, batch.longitude_rad, batch.height_m, batch.accuracies(),
    )  # fmt: skip
    positions = np.column_stack(target.geodetic(time_s))
    last = positions[-1].tolist()
    directions = None
    if measured is not None:
        directions = Sightings(measured.elevation_rad, np.column_stack(measured[1:]), positions)
    place = last[0], last[1], last[2]
    unknown = np.radians(bias_deg)
    return observability(plots, MOVERS, NO_BIAS, place, directions, bias_sigma_rad=unknown)


def test_a_manoeuvring_source_observes_the_distance() -> None:
    """In straight flight the lines of a source intersect, without observing the distance."""
    found = evaluated(moving_scene.FLYING, TARGET, CIRCLING)
    assert (found.ranges, found.places) == (0, 1)
    assert found.is_observable
    # The circle of 16 km at 25 to 50 km, at 0.2°: tens of sigmas.
    assert 5.0 < found.crossing < 100.0
    straight = evaluated(moving_scene.FLYING, TARGET, STRAIGHT)
    assert not straight.is_observable
    assert 0.0 < straight.crossing < 3.0


def test_an_elevation_observes_the_distance_at_a_known_height() -> None:
    near = moving_scene.Path((10e3, 20e3), (-100.0, 50.0))
    with_height = evaluated(moving_scene.FIXED, near, None, elevations=True, heights=True)
    assert with_height.is_observable
    assert with_height.places == 1
    without = evaluated(moving_scene.FIXED, near, None, elevations=True)
    assert not without.is_observable
    azimuths = evaluated(moving_scene.FIXED, near, None, heights=True)
    assert azimuths.crossing == 0.0


@pytest.mark.parametrize("bias_deg", [0.0, 1.0])
def test_the_crossing_strength_of_a_moving_source_is_consistent(bias_deg: float) -> None:
    """On a flat plane, by least squares over simulated angles and biases."""
    found = evaluated(moving_scene.FLYING, TARGET, CIRCLING, until_s=300.0, bias_deg=bias_deg)
    rng = np.random.default_rng(7)
    time_s = np.arange(0.0, 300.0, 2.0)
    ago = time_s - time_s[-1]
    source, true = CIRCLING.at(time_s), TARGET.at(time_s)
    line = true - source
    squared = (line**2).sum(axis=1)
    slopes = np.column_stack([line[:, 1], -line[:, 0]]) / squared[:, None]
    turned = np.full(len(time_s), np.radians(bias_deg))
    whole = np.column_stack([slopes, ago[:, None] * slopes, turned]) / np.radians(0.2)
    prior = np.diag([0.0, 0.0, 300.0**-2, 300.0**-2, 1.0])
    gain = np.linalg.solve(whole.T @ whole + prior, whole.T)
    noise = rng.standard_normal((len(time_s), 4000))
    errors = gain @ (noise + np.outer(turned, rng.standard_normal(4000)) / np.radians(0.2))
    worst = np.sqrt(np.linalg.eigvalsh(np.cov(errors[:2]))[-1])
    nearest = np.hypot(*(source - true[-1]).T).min()
    assert found.crossing == pytest.approx(nearest / worst, rel=0.05)
