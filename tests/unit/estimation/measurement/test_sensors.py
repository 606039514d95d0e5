"""A table of sensors that cannot be used is refused by name when it is made."""

from dataclasses import replace
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
from multiradar.estimation.measurement.sensors import SensorTable
from support.scenes import sensor_table, three_radars


def table() -> SensorTable:
    return sensor_table(three_radars())


def changed(name: str, place: int, value: float) -> dict[str, Any]:
    column = getattr(table(), name).copy()
    column[place] = value
    return {name: column}


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        (changed("height_m", 1, np.nan), SensorPositionError, "radar B: expected a position"),
        (changed("latitude_rad", 0, np.inf), SensorPositionError, "radar A: expected a position"),
        (changed("range_sigma_m", 2, 0.0), PriorError, "range_sigma_m of sensor C: expected more"),
        (changed("azimuth_sigma_rad", 0, np.nan), PriorError, "azimuth_sigma_rad of sensor A"),
        (changed("prior_sigma", 0, 0.0), PriorError, "range_offset_m of sensor A: .* was 0.0 and"),
        (changed("prior_sigma", 3, -1.0), PriorError, "azimuth_offset_deg of sensor B: .* -1.0"),
        (changed("prior_sigma", 5, np.nan), PriorError, "sensor C: expected a prior sigma above 0"),
        (changed("drift", 2, -0.1), PriorError, "range_offset_m of sensor B: .* and -0.1"),
        (changed("drift", 2, np.inf), PriorError, "a drift of at least 0"),
        (changed("prior_mean", 4, np.nan), PriorError, "sensor C: expected a prior mean"),
        (changed("parameter_kind", 1, 4), UnknownParameterError, r"expected one of 0 \(range"),
        (changed("parameter_kind", 1, -1), UnknownParameterError, "was -1"),
        (changed("parameter_kind", 1, 0), ConfigurationError, "sensor A: expected range_offset_m"),
        (changed("parameter_sensor", 0, 2), ShapeError, "ascending"),
        (changed("parameter_sensor", 5, 3), ShapeError, "indices of 3 sensors"),
        (changed("kinds", 1, 1), ConfigurationError, "sensor B: expected no bias parameters"),
        ({"height_m": np.zeros(2)}, ShapeError, r"height_m of the sensors: expected \(3,\)"),
        ({"drift": np.zeros((6, 1))}, ShapeError, r"drift of the sensors: expected \(6,\)"),
    ],
)
def test_what_cannot_be_used_is_named(
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
