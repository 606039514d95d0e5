"""Whether measurements say where a track is: ranges, or lines from two places that cross."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET, PARAMETER_NAMES
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.restoration.observability import observability
from multiradar.restoration.plot_positions import Plots
from support import bearing_scene

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
        nothing, np.array(azimuth) + offset_rad, nothing, nothing, nothing,
    )  # fmt: skip


def test_lines_from_two_places_cross() -> None:
    """Two lines at an angle γ: the least eigenvalue of Σ n nᵀ/σ² is (1 − |cos γ|)/σ²."""
    found = observability(bearings("df-1", "df-2"), SENSORS, NONE, PLACE)
    assert (found.ranges, found.bearings, found.places) == (0, 2, 2)
    north, south = bearings("df-1", "df-2").azimuth_rad
    sigma = SENSORS.azimuth_sigma_rad[SENSORS.ids.index("df-1")]
    expected = np.sqrt(1.0 - abs(np.cos(north - south))) / sigma
    # The meridians of the sites lean by 0.8° against each other, the lines cross at 24°.
    assert found.crossing == pytest.approx(expected, rel=0.05)
    assert found.lines_cross
    assert found.is_observable


def test_one_place_tells_no_distance() -> None:
    """However often it looks, and however its line turns."""
    looks = [bearings("df-1", offset_rad=turn) for turn in np.linspace(-0.5, 0.5, 20)]
    many = Plots(*(np.concatenate(columns) for columns in zip(*looks, strict=True)))
    found = observability(many, SENSORS, NONE, PLACE)
    assert (found.bearings, found.places, found.crossing) == (20, 1, 0.0)
    assert not found.is_observable


def test_a_range_is_enough() -> None:
    plots = bearings("41-10", kind=0)
    found = observability(plots, SENSORS, NONE, PLACE)
    assert (found.ranges, found.bearings, found.places) == (1, 0, 0)
    assert found.is_observable
    assert not found.lines_cross


def test_biases_turn_the_lines() -> None:
    """A bias that the line from `df-1` is turned by, until both lines are parallel."""
    plots = bearings("df-1", "df-2")
    north, south = plots.azimuth_rad
    biases = NONE.copy()
    biases[SENSORS.ids.index("df-1"), PARAMETER_AZIMUTH_OFFSET] = north - south
    assert observability(plots, SENSORS, biases, PLACE).crossing < 10.0
    assert observability(plots, SENSORS, NONE, PLACE).crossing > 50.0


def test_nothing_is_not_observable() -> None:
    found = observability(bearings(), SENSORS, NONE, PLACE)
    assert tuple(found) == (0, 0, 0, 0.0)
    assert not found.is_observable
