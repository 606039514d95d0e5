"""Latitude and longitude of reports, by the speeds of aircraft on different courses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.conversion import check_reported
from multiradar.diagnosis.motion.reports import check_reports
from multiradar.diagnosis.plots import Plots

DEGREE_M = 111_195.0
LATITUDE_DEG = 50.0


def _reports(seed: int, *, turn_deg: float = 120.0, wind_mps: float = 0.0) -> Plots:
    # Aircraft at different speeds on two legs each, in a wind from the west.
    random = np.random.default_rng(seed)
    parts: list[NDArray[np.float64]] = []
    for number in range(12):
        time_s = np.arange(0.0, 400.0, 4.0)
        course = random.uniform(0.0, 2.0 * np.pi) + np.radians(turn_deg) * (time_s > 200.0)
        speed = random.uniform(160.0, 260.0)
        east = np.cumsum(4.0 * (speed * np.sin(course) + wind_mps)) + random.uniform(-5e4, 5e4)
        north = np.cumsum(4.0 * speed * np.cos(course)) + random.uniform(-5e4, 5e4)
        parts.append(np.column_stack([np.full(len(time_s), number), time_s, east, north]))
    number, time_s, east, north = np.concatenate(parts).T
    east = east + random.normal(0.0, 20.0, len(east))
    latitude_deg = LATITUDE_DEG + (north + random.normal(0.0, 20.0, len(north))) / DEGREE_M
    longitude_deg = 8.0 + east / DEGREE_M / np.cos(np.radians(latitude_deg))
    missing = np.full(len(time_s), np.nan)
    keys = np.full((len(time_s), 3), -1, np.int64)
    keys[:, 1] = number
    height_m = np.full(len(time_s), 11_000.0)
    return Plots(time_s, missing, missing, latitude_deg, longitude_deg, height_m, keys)


def _code(plots: Plots) -> str:
    found = check_reports("adsb", plots)
    return "" if found is None else found.code


def _swapped(plots: Plots) -> Plots:
    return replace(plots, latitude_deg=plots.longitude_deg, longitude_deg=plots.latitude_deg)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("wind_mps", [0.0, 50.0])
def test_swapped_columns_show_in_turns(seed: int, wind_mps: float) -> None:
    plots = _reports(seed, wind_mps=wind_mps)
    assert _code(plots) == ""
    assert _code(_swapped(plots)) == "columns_exchanged"


@pytest.mark.parametrize("seed", range(3))
def test_reports_of_rounded_positions_are_named_without_a_sensors_file(seed: int) -> None:
    plots = _reports(seed)
    assert check_reported("adsb", plots) == []
    rounded = replace(
        plots,
        latitude_deg=plots.latitude_deg.round(2),
        longitude_deg=plots.longitude_deg.round(2),
    )
    (found,) = check_reported("adsb", rounded)
    assert found.code == "resolution"
    assert "the sigma of such reports is 30 m" in found.sentence
