"""Bearings in frames: lines from the sensor, of fixed and moving sensors, with and without bias."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from pyproj import Geod

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET, PARAMETER_NAMES
from multiradar.runtime.engine.plot_rows import PLOT_DTYPE
from multiradar.runtime.picture.bearing_lines import (
    LENGTH_ASSUMED_M,
    directions_to,
    mark_tables,
    marks,
)
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.picture.plot_columns import plot_columns
from multiradar.runtime.picture.selection import Area
from support.scenarios.live_scene import sensors

TABLE = sensors()
BIASES = np.zeros((len(TABLE), len(PARAMETER_NAMES)))
BIASES[0, PARAMETER_AZIMUTH_OFFSET] = np.radians(2.0)
WGS84 = Geod(ellps="WGS84")
SITE = np.degrees([TABLE.longitude_rad[0], TABLE.latitude_rad[0]])
NOWHERE = Area(-10.0, -10.0, -9.0, -9.0)


def rows(kind: int, azimuth_deg: float = 70.0, length_m: float = 150e3) -> NDArray[np.void]:
    """Return a measurement of the first sensor, of a track at a true azimuth of 68°."""
    one = np.zeros(1, PLOT_DTYPE)
    one["kind"], one["azimuth_rad"], one["range_m"] = kind, np.radians(azimuth_deg), length_m
    one["height_m"], one["directions"] = 10_000.0, np.nan
    longitude, latitude, _ = WGS84.fwd(SITE[0], SITE[1], 68.0, length_m)
    one["track_longitude_rad"], one["track_latitude_rad"] = np.radians([longitude, latitude])
    return one


def inverse(table: dict[str, NDArray[np.float64]], of: str) -> tuple[float, float]:
    """Return azimuth and length of a line."""
    source = (table[f"source_{name}_deg"][0] for name in ("longitude", "latitude"))
    end = (table[f"{of}{name}_deg"][0] for name in ("longitude", "latitude"))
    azimuth, _, length = WGS84.inv(*source, *end)
    return azimuth % 360.0, length


def test_a_bearing_goes_along_its_azimuth_as_far_as_its_track() -> None:
    tables = mark_tables(marks(rows(KIND_BEARING), BIASES, TABLE), None)
    assert len(tables["plots"]["time_s"]) == 0
    # The normal section differs from the geodesic by less than 0.01°.
    assert inverse(tables["bearings"], "") == pytest.approx((70.0, 150e3), rel=1e-3)
    assert inverse(tables["bearings"], "corrected_") == pytest.approx((68.0, 150e3), rel=1e-3)


@pytest.mark.parametrize(("range_max_m", "length_m"), [(80e3, 80e3), (np.inf, LENGTH_ASSUMED_M)])
def test_without_a_track_it_has_the_range_of_its_sensor(
    range_max_m: float, length_m: float
) -> None:
    one = rows(KIND_BEARING)
    one["track_latitude_rad"] = np.nan
    table = replace(TABLE, range_max_m=np.full(len(TABLE), range_max_m))
    tables = mark_tables(marks(one, BIASES, table), None)
    assert inverse(tables["bearings"], "") == pytest.approx((70.0, length_m), rel=1e-3)


def test_of_a_moving_sensor_it_starts_where_that_was() -> None:
    one = rows(KIND_BEARING)
    one["directions"][:, 1:3] = np.radians([SITE[1] + 0.5, SITE[0] - 0.5])
    bearing = mark_tables(marks(one, BIASES, TABLE), None)["bearings"]
    assert bearing["source_latitude_deg"][0] == pytest.approx(SITE[1] + 0.5)
    assert bearing["source_longitude_deg"][0] == pytest.approx(SITE[0] - 0.5)
    assert inverse(bearing, "")[0] == pytest.approx(70.0, abs=0.05)
    track = one["track_latitude_rad"], one["track_longitude_rad"]
    from_there, _, _ = WGS84.inv(SITE[0] - 0.5, SITE[1] + 0.5, *np.degrees(track[::-1])[:, 0])
    assert np.degrees(directions_to(one, TABLE, *track))[0] == pytest.approx(from_there, abs=0.05)


def test_plots_alone_have_the_columns_and_octets_as_before() -> None:
    plots = rows(KIND_RADAR)
    tables = mark_tables(marks(plots, BIASES, TABLE), None)
    assert encoded({}, tables) == encoded({}, {"plots": plot_columns(plots, BIASES, TABLE)})


def test_bearings_are_not_limited_to_an_area_that_they_may_cross() -> None:
    both = np.concatenate([rows(KIND_RADAR), rows(KIND_BEARING)])
    tables = mark_tables(marks(both, BIASES, TABLE), None)
    assert [len(one["time_s"]) for one in tables.values()] == [1, 1]
    assert "source_latitude_deg" not in tables["plots"]
    limited = mark_tables(marks(both, BIASES, TABLE), NOWHERE)
    assert [len(one["time_s"]) for one in limited.values()] == [0, 1]
