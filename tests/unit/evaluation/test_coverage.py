"""Coverage of sensors: range, horizon and time, with the neighbours of what is covered."""

import numpy as np
import polars as pl
import pytest

from multiradar.evaluation.coverage import CoveredRegion, covered_regions, covered_rows
from multiradar.evaluation.trajectories import Floats, Uncovered
from multiradar_schemas.sensors.sensor import Sensor

RADAR = Sensor(
    id="r", kind="radar", latitude_deg=47.0, longitude_deg=8.0, height_m=500.0, range_max_m=2e5
)
REGION = CoveredRegion(np.radians(47.0), np.radians(8.0), 500.0, 2e5, 100.0, 200.0)
#: A degree of latitude, m.
DEGREE_M = 111_200.0


def covered(
    north_m: list[float], time_s: list[float], height_m: float = 10_000.0, *, alone: bool = True
) -> tuple[list[bool], Uncovered]:
    count = len(north_m)
    aircraft = np.arange(count) if alone else np.zeros(count, np.int64)
    latitude = np.radians(47.0 + np.array(north_m) / DEGREE_M)
    place = latitude, np.full(count, np.radians(8.0))
    found, counts = covered_rows(
        [REGION], aircraft, np.array(time_s), place, np.full(count, height_m)
    )
    return found.tolist(), counts


def test_positions_are_outside_by_time_range_or_horizon() -> None:
    assert covered([1e5, 1e5, 1e5, 2.2e5], [99.0, 150.0, 201.0, 150.0]) == (
        [False, True, False, False], Uncovered(time=2, range=1, horizon=0),
    )  # fmt: skip
    # From 500 m and from 300 m the horizons are 92 km and 71 km away.
    assert covered([150e3, 175e3], [150.0] * 2, 300.0) == ([True, False], Uncovered(horizon=1))
    assert covered([175e3], [150.0], np.nan)[0] == [True]


def test_a_plot_at_the_instrumented_range_with_a_bias_is_inside() -> None:
    assert covered([2.005e5], [150.0])[0] == [True]


def test_the_neighbour_of_a_covered_position_is_kept_for_interpolation() -> None:
    times = [90.0, 95.0, 105.0, 110.0]
    assert covered([1e5] * 4, times, alone=False) == (
        [False, True, True, True], Uncovered(time=1),
    )  # fmt: skip
    # Not across a gap, nor from another aircraft.
    assert covered([1e5] * 2, [80.0, 105.0], alone=False)[0] == [False, True]
    assert covered([1e5] * 2, [95.0, 105.0])[0] == [False, True]


def updates(
    sensor: str, latitude_deg: Floats, time_s: Floats, longitude_deg: list[float] | None = None
) -> pl.DataFrame:
    count = len(time_s)
    east = [8.0] * count if longitude_deg is None else longitude_deg
    return pl.DataFrame(
        {
            "sensor_id": [sensor] * count, "time_s": time_s, "latitude_deg": latitude_deg,
            "longitude_deg": east, "state": ["confirmed"] * (count - 1) + ["coasting"],
        }
    )  # fmt: skip


def test_a_sensor_covers_the_time_of_its_measured_updates() -> None:
    rows = updates("r", np.array([47.1, 47.2, 49.0]), np.array([10.0, 20.0, 99.0]))
    (found,) = covered_regions(rows, [RADAR, RADAR.model_copy(update={"id": "silent"})])
    assert (found.first_s, found.last_s, found.range_max_m) == (10.0, 20.0, 2e5)
    assert found.height_m == 500.0


def test_without_a_range_the_farthest_update_is_the_limit() -> None:
    rows = updates("r", np.array([47.1, 47.5, 49.0]), np.array([10.0, 20.0, 99.0]))
    (found,) = covered_regions(rows, [RADAR.model_copy(update={"range_max_m": None})])
    assert found.range_max_m == pytest.approx(0.5 * DEGREE_M, rel=0.01)


@pytest.mark.parametrize("sensor", [RADAR.model_copy(update={"range_max_m": None}),
                                    Sensor(id="r", kind="adsb")])  # fmt: skip
def test_high_aircraft_as_near_as_the_farthest_update_are_inside(sensor: Sensor) -> None:
    """Within 13 km of a sensor an aircraft at 11 km is 17 km away."""
    north_m = np.linspace(-13e3, 13e3, 53)
    latitude_deg = 47.0 + north_m / DEGREE_M
    rows = updates("r", np.append(latitude_deg, 47.0), np.append(np.full(53, 150.0), 151.0))
    (found,) = covered_regions(rows, [sensor])
    place = np.radians(latitude_deg), np.full(53, np.radians(8.0))
    seen, _ = covered_rows([found], np.arange(53), np.full(53, 150.0), place, np.full(53, 11_000.0))
    assert seen.all()
    beyond = np.radians([47.0 + 15e3 / DEGREE_M]), np.radians([8.0])
    seen, counts = covered_rows(
        [found], np.zeros(1, np.int64), np.array([150.0]), beyond, np.array([11_000.0])
    )
    assert (seen.tolist(), counts) == ([False], Uncovered(range=1))


def test_receivers_cover_an_area_across_the_antimeridian() -> None:
    rows = updates("a", np.full(5, -17.0), np.arange(5.0), [178.5, 179.5, -179.7, -178.9, 0.0])
    (found,) = covered_regions(rows, [Sensor(id="a", kind="adsb")])
    assert np.degrees(found.longitude_rad) == pytest.approx(179.9)
    assert found.range_max_m < 2.0 * DEGREE_M


def test_receivers_cover_the_area_of_their_updates_without_a_horizon() -> None:
    rows = updates("a", np.array([50.0, 50.2, 50.4, 52.0]), np.arange(4.0))
    (found,) = covered_regions(rows, [Sensor(id="a", kind="adsb")])
    assert np.degrees(found.latitude_rad) == pytest.approx(50.2)
    assert found.range_max_m == pytest.approx(0.2 * DEGREE_M, rel=0.01)
    place = np.radians([50.3]), np.radians([8.0])
    seen, _ = covered_rows([found], np.zeros(1, np.int64), np.ones(1), place, np.zeros(1))
    assert seen.tolist() == [True]
