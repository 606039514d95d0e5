"""Positions of a reference that were rounded are named, those as measured are not."""

import numpy as np
import pytest

from multiradar.evaluation.trajectories import Reference
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.toolbox.evaluation.rounding import rounded_positions

PLANE = SystemPlane(np.radians(46.5), np.radians(8.0))
AIRCRAFT, ROWS, PERIOD_S = 12, 100, 4.0


def reference(step_deg: float = 0.0, speed_mps: float = 220.0) -> Reference:
    rng = np.random.default_rng(4)
    time_s = np.tile(PERIOD_S * np.arange(ROWS), AIRCRAFT)
    aircraft = np.repeat(np.arange(AIRCRAFT), ROWS)
    heading = rng.uniform(0.0, 2.0 * np.pi, AIRCRAFT)[aircraft]
    start_m = rng.uniform(-80e3, 80e3, (AIRCRAFT, 2))[aircraft]
    along_m = (speed_mps * time_s)[:, None]
    place_m = start_m + along_m * np.column_stack([np.sin(heading), np.cos(heading)])
    if step_deg:
        latitude, longitude = PLANE.to_geodetic(*place_m.T)
        latitude = np.radians(np.round(np.degrees(latitude) / step_deg) * step_deg)
        longitude = np.radians(np.round(np.degrees(longitude) / step_deg) * step_deg)
        place_m = np.column_stack(PLANE.to_plane(latitude, longitude))
    return Reference(
        plane=PLANE,
        names=np.array([f"a{number:02d}" for number in range(AIRCRAFT)]),
        aircraft=aircraft,
        time_s=time_s,
        position_m=place_m,
        velocity_mps=None,
        height_m=np.full(len(aircraft), 9000.0),
        gap_s=30.0,
    )


@pytest.mark.parametrize(("step_deg", "error"), [(0.01, "321 m"), (0.001, "32 m")])
def test_rounded_positions_are_named_with_their_error(step_deg: float, error: str) -> None:
    (sentence,) = rounded_positions(reference(step_deg))
    assert f"multiples of {step_deg:g}°" in sentence
    assert f"error of {error}" in sentence


@pytest.mark.parametrize("step_deg", [0.0, 1e-6, 180.0 / 2**25, 1e-4])
def test_positions_as_measured_are_not(step_deg: float) -> None:
    assert rounded_positions(reference(step_deg)) == []


def test_a_row_of_equal_steps_is_not_rounded() -> None:
    """One aircraft to the north at a constant speed, 880 m from row to row."""
    one = reference()
    time_s = one.time_s[:ROWS]
    north_m = 220.0 * time_s
    straight = Reference(
        plane=PLANE,
        names=one.names[:1],
        aircraft=np.zeros(ROWS, np.int64),
        time_s=time_s,
        position_m=np.column_stack([np.zeros(ROWS), north_m]),
        velocity_mps=None,
        height_m=np.full(ROWS, 9000.0),
        gap_s=30.0,
    )
    assert rounded_positions(straight) == []
