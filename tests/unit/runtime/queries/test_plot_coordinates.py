"""Positions of retained plots: each sensor from its own site, whatever the others measure."""

import numpy as np
import pytest
from pyproj import Geod

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.runtime.engine.plot_rows import PLOT_DTYPE
from multiradar.runtime.queries.plot_coordinates import plot_coordinates
from support.scenarios.live_scene import sensors

TABLE = sensors()
WITHOUT_BIASES = np.zeros((len(TABLE), len(PARAMETER_NAMES)))


@pytest.mark.parametrize("first", [KIND_POSITION, KIND_BEARING])
def test_plots_follow_sensors_that_measure_no_range(first: int) -> None:
    """The first sensor reports a position or a bearing, the second one a plot."""
    rows = np.zeros(2, PLOT_DTYPE)
    rows["sensor"], rows["kind"] = [0, 1], [first, KIND_RADAR]
    rows["latitude_rad"], rows["longitude_rad"] = 0.9, 0.2
    rows["range_m"], rows["azimuth_rad"], rows["height_m"] = 60e3, np.radians(70.0), 9000.0
    latitude, longitude = np.degrees(plot_coordinates(rows, WITHOUT_BIASES, TABLE))
    site = np.degrees([TABLE.longitude_rad[1], TABLE.latitude_rad[1]])
    azimuth, _, length_m = Geod(ellps="WGS84").inv(site[0], site[1], longitude[1], latitude[1])
    assert azimuth == pytest.approx(70.0, abs=0.01)
    assert length_m == pytest.approx(np.hypot(60e3, 9000.0 - TABLE.height_m[1]), rel=0.03)
    expected = [0.9, 0.2] if first == KIND_POSITION else [np.nan, np.nan]
    assert np.radians([latitude[0], longitude[0]]) == pytest.approx(expected, nan_ok=True)
