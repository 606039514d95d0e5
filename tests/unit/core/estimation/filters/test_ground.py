"""The ground status of an aircraft is the reported one, unless speed or height contradict."""

import numpy as np
import pytest

from multiradar.estimation.filters._ground_kernels import (
    AIRBORNE,
    ON_GROUND,
    UNKNOWN,
    height_of_row,
    record_ground,
    settle_ground,
)
from multiradar.estimation.filters._kernels import STARTED, UPDATED
from multiradar.estimation.filters.arrays import Aircraft, aircraft_arrays
from multiradar.estimation.filters.height._height_kernels import (
    DOUBTED,
    KIND_SURFACE,
    P11,
    RATE,
    SOURCE,
    SURFACE,
)
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR

SITE_HEIGHT_M = 400.0


def aircraft(before: int, speed_mps: float, sigma_mps: float = 2.0) -> Aircraft:
    """Return an aircraft at the height of the radar, with a pressure altitude of 350 m."""
    one = aircraft_arrays(1, 0)
    one.on_ground[0] = before
    one.mean[0, 2] = speed_mps
    one.covariance[0, 7] = sigma_mps**2
    one.height[0] = SITE_HEIGHT_M
    one.vertical[0, SOURCE] = SURFACE
    one.vertical[0, DOUBTED] = 350.0
    return one


@pytest.mark.parametrize(
    ("reported", "before", "speed_mps", "height_m", "expected"),
    [
        (ON_GROUND, UNKNOWN, 0.0, np.nan, True),
        (ON_GROUND, AIRBORNE, 80.0, 380.0, True),  # landing
        (ON_GROUND, AIRBORNE, 250.0, 380.0, False),  # no aircraft is as fast on the ground
        (ON_GROUND, AIRBORNE, 80.0, 3000.0, False),  # far above the surface
        (AIRBORNE, ON_GROUND, 0.0, 350.0, True),  # a parked aircraft
        (AIRBORNE, ON_GROUND, 0.0, np.nan, True),
        (AIRBORNE, ON_GROUND, 0.0, 420.0, False),  # a helicopter
        (AIRBORNE, ON_GROUND, 70.0, 350.0, False),  # take-off
        (AIRBORNE, UNKNOWN, 0.0, 350.0, False),
        (AIRBORNE, AIRBORNE, 0.0, 350.0, False),
        (UNKNOWN, ON_GROUND, 20.0, 350.0, True),
        (UNKNOWN, ON_GROUND, 250.0, 350.0, False),
        (UNKNOWN, ON_GROUND, 80.0, 450.0, False),
        (UNKNOWN, UNKNOWN, 0.0, 350.0, False),
    ],
)
def test_a_status_must_fit_speed_and_height(
    reported: int, before: int, speed_mps: float, height_m: float, expected: bool
) -> None:
    one = aircraft(before, speed_mps)
    assert settle(one, reported, height_m, UPDATED) is expected


def test_an_uncertain_speed_contradicts_nothing() -> None:
    assert settle(aircraft(AIRBORNE, 250.0, 100.0), ON_GROUND, np.nan, UPDATED)
    # An aircraft that is initiated has no speed: that of an earlier one does not count.
    assert settle(aircraft(AIRBORNE, 250.0), ON_GROUND, np.nan, STARTED)
    assert not settle(aircraft(ON_GROUND, 0.0), AIRBORNE, np.nan, STARTED)


def test_the_range_of_a_plot_on_the_ground_has_the_height_of_the_site() -> None:
    on_ground = height_of_row(True, KIND_RADAR, -38.0, SITE_HEIGHT_M)
    assert on_ground == (KIND_SURFACE, SITE_HEIGHT_M)
    assert height_of_row(False, KIND_RADAR, -38.0, SITE_HEIGHT_M) == (KIND_RADAR, -38.0)
    assert height_of_row(True, KIND_POSITION, 120.0, SITE_HEIGHT_M) == (KIND_POSITION, 120.0)


def test_there_is_no_climb_on_the_ground_and_an_unknown_one_at_take_off() -> None:
    one = aircraft(AIRBORNE, 70.0)
    one.vertical[0, RATE], one.vertical[0, P11] = -3.5, 0.5
    record_ground(True, ON_GROUND, 340.0, 0, one.on_ground, one.vertical)
    assert (one.on_ground[0], one.vertical[0, RATE], one.vertical[0, P11]) == (ON_GROUND, 0.0, 0.0)
    assert one.vertical[0, DOUBTED] == 340.0
    record_ground(False, AIRBORNE, 400.0, 0, one.on_ground, one.vertical)
    assert one.on_ground[0] == AIRBORNE
    assert one.vertical[0, P11] > 100.0


def test_an_aircraft_that_never_reported_a_status_has_none() -> None:
    one = aircraft(UNKNOWN, 70.0)
    record_ground(False, UNKNOWN, 400.0, 0, one.on_ground, one.vertical)
    assert one.on_ground[0] == UNKNOWN


def settle(one: Aircraft, reported: int, height_m: float, action: int) -> bool:
    grounded = settle_ground(
        reported, height_m, SITE_HEIGHT_M, action, 0, one.on_ground, one.mean, one.covariance,
        one.height, one.vertical,
    )  # fmt: skip
    return bool(grounded)
