"""Young tracks misled by a false first plot recover their aircraft."""

import numpy as np
import pytest

from multiradar.estimation.filters.arrays import Aircraft, Rows
from multiradar.estimation.filters.bank import FILTERS
from multiradar.tracking._identity_kernels import assign
from multiradar.tracking.association._grid_kernels import COARSE_SIGMAS, NEAR_COLUMN
from multiradar.tracking.association._pair_term_kernels import LOG_OFF_PHASE, log_scan_phase
from multiradar.tracking.association._young_kernels import (
    LOG_FAST_MIN,
    LOG_REINITIALISED,
    SPEED_SIGMA,
    log_of_speed,
    log_reinitialised,
    reset_velocity,
    score_of_twin,
)
from multiradar.tracking.association.track_grid import Candidates, PlotPosition, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import TENTATIVE, USUAL_SPEED, Lifecycle
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import NEW_TRACK, TWIN, RowIdentities

COLUMNS, SENSORS, SLOT = 3, 2, 5
LOG_DENSITY = np.log(1e-11)


def misled_track(filter_name: str) -> tuple[Aircraft, Lifecycle]:
    """A track with two plots, the last one at 100 s, and a rejected one at 104 s."""
    modes = 8 if filter_name == "imm" else 0
    pool = AircraftPool(FILTERS[filter_name], COLUMNS, SENSORS, modes)
    aircraft, life = pool.aircraft, pool.life
    random = np.random.default_rng(2)
    aircraft.mean[SLOT] = [1000.0, 2000.0, 500.0, -300.0]
    aircraft.covariance[SLOT] = random.uniform(1.0, 2.0, 10)
    aircraft.sensitivity[SLOT] = random.normal(size=(4, COLUMNS))
    aircraft.time[SLOT], aircraft.updated[SLOT] = 104.0, 100.0
    aircraft.mode_probability[SLOT] = 0.125
    life.stage[SLOT], life.hits[SLOT], life.score[SLOT] = TENTATIVE, 2, 4.0
    life.born[SLOT], life.first_sensor[SLOT] = 80.0, 0
    life.last_seen[SLOT] = [80.0, 100.0]
    return aircraft, life


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_a_track_is_reinitialised_at_its_last_plot_for_any_biases(filter_name: str) -> None:
    aircraft, life = misled_track(filter_name)
    bias = np.array([30.0, -20.0, 10.0])
    chi = aircraft.mean[SLOT] + aircraft.sensitivity[SLOT] @ bias
    reset_velocity(SLOT, 300.0**2, aircraft, life)
    found = aircraft.mean[SLOT] + aircraft.sensitivity[SLOT] @ bias
    np.testing.assert_allclose(found, [*(chi[:2] - 4.0 * chi[2:]), 0.0, 0.0], rtol=1e-12)
    assert aircraft.time[SLOT] == 100.0
    assert np.isnan(aircraft.mode_probability[SLOT, :1]).all()
    upper = aircraft.covariance[SLOT]
    assert upper[[2, 3, 5, 6, 8]].tolist() == [0.0] * 5
    assert upper[[7, 9]].tolist() == [300.0**2] * 2


def test_the_lifecycle_of_a_reinitialised_track_starts_at_its_last_plot() -> None:
    aircraft, life = misled_track("two-stage")
    reset_velocity(SLOT, 300.0**2, aircraft, life)
    assert (life.hits[SLOT], life.score[SLOT], life.born[SLOT]) == (1, 0.0, 100.0)
    # The false plot stays counted, and a sensor with only that plot has missed nothing.
    assert life.first_sensor[SLOT] < 0
    assert life.last_seen[SLOT].tolist() == [-np.inf, 100.0]


def test_usual_speeds_cost_nothing_and_fast_ones_no_more_than_the_bound() -> None:
    assert log_of_speed(0.9 * USUAL_SPEED * 10.0, 10.0) == 0.0
    assert log_of_speed((USUAL_SPEED + 50.0) * 10.0, 10.0) == pytest.approx(-0.5)
    assert log_of_speed(700.0 * 10.0, 10.0) == LOG_FAST_MIN
    # Nearly simultaneous plots of two radars give no speed.
    assert log_of_speed(100.0, 0.01) == 0.0


def test_a_reinitialised_score_is_that_of_any_flight_from_the_last_plot() -> None:
    aircraft, _ = misled_track("two-stage")
    grid = TrackGrid.empty(8)
    # The window starts at 106 s; the track would have flown on until then.
    grid.state[SLOT, :4] = [2000.0, 1400.0, 500.0, -300.0]
    grid.state[SLOT, NEAR_COLUMN] = 900.0
    time_s, reach = 106.2, 1200.0
    rows = Rows(
        np.full(1, SLOT), np.array([time_s]), np.zeros(1, np.int64), np.zeros(1, np.int64),
        np.array([[50e3, 1.0]]), np.full(1, np.nan), np.zeros(1, np.int64),
        np.full(1, -1),
    )  # fmt: skip
    last = np.array([2000.0 - 6.0 * 500.0, 1400.0 + 6.0 * 300.0])
    plot = last + np.array([900.0, 800.0])
    log_clutter = LOG_DENSITY + np.log(50e3)
    east, north = plot.tolist()
    position = PlotPosition(0.0, east, north, reach)
    found = log_reinitialised(0, SLOT, 0.2, position, rows, aircraft, grid, log_clutter)
    variance = (reach**2 + 900.0**2) / (2.0 * COARSE_SIGMAS**2) + (SPEED_SIGMA * 6.2) ** 2
    density = np.exp(-0.5 * (900.0**2 + 800.0**2) / variance) / (2.0 * np.pi * variance)
    assert found == pytest.approx(np.log(density) - LOG_DENSITY + LOG_REINITIALISED, abs=1e-9)


def test_two_plots_of_one_window_initiate_one_track_if_their_positions_are_known() -> None:
    candidates = Candidates.empty(3)
    candidates.position[:] = [[0.0, 0.0, 1200.0], [150.0, -100.0, 900.0], [100.0, 0.0, 4000.0]]
    variance = (1200.0**2 + 900.0**2) / (2.0 * COARSE_SIGMAS**2)
    expected = np.exp(-0.5 * (150.0**2 + 100.0**2) / variance) / (2.0 * np.pi * variance)
    found = score_of_twin(1, 0, candidates, LOG_DENSITY)
    assert found == pytest.approx(np.log(expected) - LOG_DENSITY, abs=1e-9)
    assert score_of_twin(2, 0, candidates, LOG_DENSITY) == -np.inf


def test_the_second_of_two_such_plots_is_assigned_the_track_of_the_first() -> None:
    pool = AircraftPool(FILTERS["two-stage"], COLUMNS, SENSORS)
    identities = RowIdentities.empty(3)
    identities.slot[:] = [NEW_TRACK, NEW_TRACK, TWIN - 2]
    nothing = np.full(3, -1, np.int64)
    done = assign(
        0, 3, False, nothing, nothing, nothing, nothing, np.zeros(3, np.int8),
        np.zeros(3, np.int32), pool.roster, pool.new_tracks, pool.aircraft, pool.life, identities,
    )  # fmt: skip
    assert done == 3
    assert identities.slot[2] == identities.slot[0] != identities.slot[1]
    assert identities.track_id[2] == identities.track_id[0]


def test_a_plot_at_another_scan_phase_has_a_lower_score_if_the_period_is_known() -> None:
    for scans in (1.0, 1.98, 3.1):
        assert log_scan_phase(scans * 11.4, 11.4) == 0.0
    for scans in (0.6, 1.5, 2.3):
        assert log_scan_phase(scans * 11.4, 11.4) == LOG_OFF_PHASE
    # After many scans the phase is unknown, and some radars have no scan period.
    assert log_scan_phase(7.5 * 11.4, 11.4) == 0.0
    assert log_scan_phase(5.0, 0.0) == 0.0
    assert log_scan_phase(np.inf, 11.4) == 0.0
