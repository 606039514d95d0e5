"""Invalid tables of sensors are rejected on creation, with the name of the sensor."""

from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from multiradar.errors import (
    ConfigurationError,
    MultiradarError,
    PriorError,
    SensorPositionError,
    ShapeError,
    UnknownParameterError,
)
from multiradar.estimation.measurement import sensor_bounds
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar_schemas import bounds as file_bounds
from support.scenarios.scenes import sensor_table, three_radars

# Suffixes of the names of bounds.
UNITS = ("_M", "_S", "_DEG", "_GAIN", "_FACTOR")


def table() -> SensorTable:
    return sensor_table(three_radars())


def changed(name: str, place: int, value: float) -> dict[str, Any]:
    column = getattr(table(), name).copy()
    column[place] = value
    return {name: column}


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        (changed("height_m", 1, np.nan), SensorPositionError, "radar B: missing position"),
        (changed("latitude_rad", 0, np.inf), SensorPositionError, "radar A: missing position"),
        (
            changed("range_sigma_m", 2, 0.0),
            PriorError,
            "range_sigma_m of sensor C: expected 0.1 to 10000, was 0",
        ),
        (changed("azimuth_sigma_rad", 0, np.nan), PriorError, "azimuth_sigma_rad of sensor A"),
        (
            changed("earth_radius_factor", 1, 0.9),
            ConfigurationError,
            "earth_radius_factor of sensor B: expected 1 to 4, was 0.9",
        ),
        (
            changed("prior_sigma", 0, 0.0),
            PriorError,
            "prior_sigma of range_offset_m of sensor A: .* was 0",
        ),
        (changed("prior_sigma", 3, -1.0), PriorError, "azimuth_offset_deg of sensor B: .* was -1"),
        (
            changed("prior_sigma", 5, np.nan),
            PriorError,
            "prior_sigma of .* of sensor C: .* was nan",
        ),
        (changed("drift", 2, -0.1), PriorError, "drift of range_offset_m of sensor B: .* was -0.1"),
        (changed("drift", 2, np.inf), PriorError, "drift of .*: expected 0 to 100, was inf"),
        (
            changed("prior_mean", 4, np.nan),
            PriorError,
            "prior_mean of .* of sensor C: expected -20000 to 20000, was nan",
        ),
        (changed("parameter_kind", 1, 9), UnknownParameterError, r"known: 0 \(range"),
        (changed("parameter_kind", 1, -1), UnknownParameterError, "parameter -1; known"),
        (changed("parameter_kind", 1, 0), ConfigurationError, "sensor A: range_offset_m occurs 2"),
        (changed("parameter_sensor", 0, 2), ShapeError, "ascending"),
        (changed("parameter_sensor", 5, 3), ShapeError, "indices of 3 sensors"),
        (
            changed("kinds", 1, 1),
            ConfigurationError,
            "sensor B: range_offset_m is not supported for reported positions",
        ),
        (
            changed("kinds", 1, 2),
            ConfigurationError,
            "range_offset_m is not supported for bearings",
        ),
        (changed("kinds", 1, 9), ConfigurationError, r"sensor B: kind: expected .*, was 9"),
        (changed("latitude_rad", 0, 10.0), ConfigurationError, "latitude_rad of sensor A: .* 10"),
        (changed("longitude_rad", 0, -4.0), ConfigurationError, "longitude_rad of sensor A: .* -4"),
        (
            changed("height_m", 2, 2e4),
            ConfigurationError,
            "height_m of sensor C: expected -1000 to",
        ),
        (changed("range_max_m", 1, -1.0), ConfigurationError, "range_max_m of sensor B: .* was -1"),
        (changed("range_max_m", 1, np.nan), ConfigurationError, "range_max_m of sensor B: .* nan"),
        (changed("rotation_period_s", 0, 0.0), ConfigurationError, "rotation_period_s of sensor A"),
        (changed("range_sigma_m", 0, 2e4), PriorError, "range_sigma_m of sensor A: .* was 20000"),
        (changed("prior_sigma", 1, 2.0), PriorError, "azimuth_offset_deg of sensor A: .* was 2"),
        ({"ids": ("A", "B", "A")}, ConfigurationError, "sensor A: id occurs 2 times"),
        ({"known_bias": np.zeros((2, 4))}, ShapeError, r"known_bias of the sensors: .* \(3, 9\)"),
        ({"known_bias": np.full((3, 4), 0.01)}, ConfigurationError, "both estimated and known"),
        ({"known_bias": np.eye(3, 4, 2)}, PriorError, "known range_gain of sensor A: .* was 1"),
        ({"height_m": np.zeros(2)}, ShapeError, r"height_m of the sensors: expected \(3,\)"),
        ({"drift": np.zeros((6, 1))}, ShapeError, r"drift of the sensors: expected \(6,\)"),
    ],
)
def test_invalid_tables_are_rejected(
    changes: dict[str, Any], error: type[MultiradarError], sentence: str
) -> None:
    with pytest.raises(error, match=sentence):
        replace(table(), **changes)


def test_a_reporter_of_positions_needs_no_site() -> None:
    one = SensorTable(
        ids=("adsb",),
        kinds=np.array([1], np.int8),
        latitude_rad=np.array([np.nan]),
        longitude_rad=np.array([np.nan]),
        height_m=np.array([np.nan]),
        range_sigma_m=np.array([np.nan]),
        azimuth_sigma_rad=np.array([np.nan]),
        position_sigma_m=np.array([30.0]),
        range_max_m=np.array([np.inf]),
        rotation_period_s=np.array([np.nan]),
        parameter_sensor=np.zeros(0, np.int32),
        parameter_kind=np.zeros(0, np.int8),
        prior_mean=np.zeros(0),
        prior_sigma=np.zeros(0),
        drift=np.zeros(0),
    )
    assert len(one) == 1
    with pytest.raises(PriorError, match="position_sigma_m of sensor adsb"):
        replace(one, position_sigma_m=np.array([-1.0]))


def test_bounds_are_inclusive_in_radians() -> None:
    edges = replace(
        table(),
        latitude_rad=np.radians([90.0, -90.0, 0.0]),
        longitude_rad=np.radians([180.0, -180.0, 0.0]),
        azimuth_sigma_rad=np.radians([1e-4, 10.0, 1.0]),
    )
    assert len(edges) == 3


def test_the_core_and_the_files_have_the_same_bounds() -> None:
    def numbers(module: ModuleType) -> dict[str, tuple[Any, ...]]:
        found = {name: getattr(module, name) for name in dir(module) if name.endswith(UNITS)}
        return {name: tuple(value) for name, value in found.items()}

    assert numbers(sensor_bounds) == numbers(file_bounds)
    names = [name.upper() for name in PARAMETER_NAMES]
    assert [getattr(sensor_bounds, name) for name in names] == list(sensor_bounds.PARAMETERS)


def test_defaults_of_a_table() -> None:
    assert table().known_bias.tolist() == [[0.0] * len(PARAMETER_NAMES)] * 3
