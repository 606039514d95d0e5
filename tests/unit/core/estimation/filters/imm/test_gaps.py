"""Interacting modes over gaps of many scans: the covariance stays that of the errors."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.scenario.model import Leg
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, Radar, Scene, make_scene

FLIGHTS = 24
SPEED_MPS = 230.0


# Flights at one distance from a radar with known biases, across its lines of sight.
def around(away_m: float, legs: tuple[Leg, ...], seed: int) -> Scene:
    radar = Radar("A", 46.0, 6.0, 1500.0, 4.0, 40.0, 0.06, {})
    flights = []
    for number in range(FLIGHTS):
        bearing = 2.0 * np.pi * number / FLIGHTS
        east, north = np.sin(bearing), np.cos(bearing)
        state = (away_m * east, away_m * north, SPEED_MPS * north, -SPEED_MPS * east)
        flights.append(Flight(0.0, 400.0, state, legs=legs))
    return make_scene(np.random.default_rng(seed), [radar], flights)


# NEES per dimension of the last update of each flight, whose plots in ``kept`` the filter sees.
def nees_at_the_end(scene: Scene, kept: NDArray[np.bool_]) -> float:
    rows = np.flatnonzero(kept)
    batch: MeasurementBatch = scene.batch.select(rows)
    engine = Engine(scene.sensors, TrackingSettings(filter_name="imm", drop_after_s=200.0))
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    assert len(updates.time_s) == len(rows)
    number = scene.batch.track_number[rows]
    last = len(rows) - 1 - np.unique(number[::-1], return_index=True)[1]
    east, north = scene.plane.to_plane(updates.latitude_rad[last], updates.longitude_rad[last])
    off = np.column_stack([east, north]) - scene.truth[rows[last], :2]
    return float(np.mean(np.sum(off**2, axis=1) / updates.position_sigma_m[last] ** 2))


@pytest.mark.parametrize("away_m", [60e3, 300e3])
@pytest.mark.parametrize("gap_s", [8.0, 48.0])
def test_a_second_plot_far_from_the_first_one_gives_its_own_position(
    away_m: float, gap_s: float
) -> None:
    scene = around(away_m, (), 3)
    time_s, number = scene.batch.time_s, scene.batch.track_number
    first = np.array([time_s[number == one].min() for one in number])
    kept = (time_s < first + 2.0) | (np.abs(time_s - first - gap_s) < 2.0)
    assert nees_at_the_end(scene, kept) < 1.6


# Scans of 4 s: the first plot after the gap, and the third, by which the velocity counts.
@pytest.mark.parametrize(
    ("bank_deg", "gap_s", "plots", "nees_max"), [(15.0, 20.0, 1, 1.5), (20.0, 44.0, 3, 2.6)]
)
def test_an_aircraft_that_turned_for_a_quarter_of_a_gap(
    bank_deg: float, gap_s: float, plots: int, nees_max: float
) -> None:
    rate = 9.80665 * np.tan(np.radians(bank_deg)) / SPEED_MPS
    legs = (Leg(200.0 + 0.1 * gap_s), Leg(0.25 * gap_s, rate), Leg(200.0))
    scene = around(60e3, legs, 4)
    since_s = scene.batch.time_s - 200.0
    kept = (since_s < 2.0) | ((since_s > gap_s) & (since_s < gap_s + 4.0 * plots))
    assert nees_at_the_end(scene, kept) < nees_max
