"""Motion with constant accelerations is exact for all of them, zero included."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import MotionParameterError, ShapeError
from multiradar.restoration.control_tracks._motion_kernels import fly, fly_with_slopes
from multiradar.restoration.control_tracks.motion import advance
from support.kernels import plain
from support.scenarios.flown import state_by_series

SIZES = (0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0, 2.0, 4.0)
#: The slowest and fastest aircraft, from short intervals to the length of a window, and back.
FLIGHTS = (
    (20.0, 0.5), (20.0, 90.0), (80.0, 30.0), (120.0, 1.0), (200.0, -40.0), (250.0, 90.0),
    (350.0, 0.01), (350.0, 90.0),
)  # fmt: skip


def integrated(v: float, u: float, w: float, t: float) -> tuple[float, float]:
    """(2.1) by Gauss and Legendre in 64 parts with 80 bits: accurate to 1e-17 of the distance."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    edges = np.linspace(0.0, 1.0, 65).astype(np.longdouble) * np.longdouble(t)
    half = np.diff(edges) / 2
    times = (edges[1:] - half)[:, None] + half[:, None] * nodes
    weight = half[:, None] * weights
    start, side, along = np.longdouble(v), np.longdouble(u), np.longdouble(w)
    speed = start + along * times
    bent = side / along * np.log1p(along * times / start) if w else side * times / start
    return (
        float(np.sum(weight * speed * np.cos(bent))),
        float(np.sum(weight * speed * np.sin(bent))),
    )


def accelerations() -> list[tuple[float, float]]:
    signed = [sign * size for size in SIZES for sign in (1.0, -1.0)]
    return [(u, w) for u, w in itertools.product(signed, signed) if abs(w) <= 2.0]


@pytest.mark.slow
@pytest.mark.parametrize(("v", "t"), FLIGHTS)
def test_displacements_are_accurate_to_1e9_for_all_accelerations(v: float, t: float) -> None:
    chosen = [(u, w) for u, w in accelerations() if v + w * t > 12.0]
    u, w = np.array(chosen).T
    states = advance([0.0, 0.0, v, 0.0], u, w, t)
    exact = np.array([integrated(v, *one, t) for one in chosen])
    off = np.hypot(states[:, 1] - exact[:, 0], states[:, 0] - exact[:, 1])
    flown = np.abs((v + 0.5 * w * t) * t)
    assert len(chosen) > 280
    # The requirement is 1e-9 of the distance; rounding, also of 18 rad, leaves 1e-14 of it.
    assert (off / flown).max() < 1e-14


@pytest.mark.parametrize(
    ("v", "w", "t"),
    [(20.0, -0.1, 90.0), (20.0, 2.0, 90.0), (350.0, -2.0, 90.0), (60.0, 1e-9, 45.0)],
)
@pytest.mark.parametrize("u", [0.0, -1e-9, 0.02, 4.0, -4.0])
def test_displacements_equal_the_integrated_equations(
    v: float, w: float, t: float, u: float
) -> None:
    """Against (2.1) integrated numerically with forty digits; heading 1.1 rad."""
    start = np.array([1e3, -2e3, v, 1.1])
    exact = state_by_series(start, u, w, t)
    found = advance(start, u, w, t)
    assert np.hypot(*(found - exact)[:2]) < 1e-13 * (v + 0.5 * w * t) * t + 1e-12
    np.testing.assert_allclose(found[2:], exact[2:], rtol=1e-13)


def test_the_formula_of_the_report_agrees_where_it_is_accurate() -> None:
    # (2.3) with u = 2, w = −0.7, v0 = 150; the asymmetric case distinguishes right from left.
    v, u, w, t = 150.0, 2.0, -0.7, 25.0
    end = v + w * t
    turn = u / w * np.log(end / v)
    size = u**2 + 4.0 * w**2
    x = u / size * end**2 * np.sin(turn) + 2.0 * w / size * (end**2 * np.cos(turn) - v**2)
    z = -u / size * (end**2 * np.cos(turn) - v**2) + 2.0 * w / size * end**2 * np.sin(turn)
    east, north, speed, heading = advance([10.0, -20.0, v, 0.0], u, w, t)
    assert z > 0.0
    np.testing.assert_allclose([east - 10.0, north + 20.0], [z, x], rtol=1e-12)
    np.testing.assert_allclose([speed, heading], [end, turn], rtol=1e-14)


def test_to_the_right_of_north_is_east() -> None:
    quarter = advance([0.0, 0.0, 100.0, 0.0], 2.0, 0.0, np.pi / 2.0 * 100.0 / 2.0)
    np.testing.assert_allclose(quarter, [5000.0, 5000.0, 100.0, np.pi / 2.0], rtol=1e-12)


def test_propagation_back_returns_to_the_start() -> None:
    start = np.array([1e5, -2e5, 180.0, 2.5])
    there = advance(start, -3.0, 1.5, 60.0)
    np.testing.assert_allclose(advance(there, -3.0, 1.5, -60.0), start, rtol=1e-12)


@pytest.mark.parametrize("u", [0.0, 1e-9, 1e-3, 0.3, -4.0])
@pytest.mark.parametrize("w", [0.0, -1e-9, 1e-3, 0.3, -1.0])
@pytest.mark.parametrize(("v", "t"), [(190.0, 70.0), (25.0, 14.0), (350.0, 90.0), (60.0, 0.5)])
def test_slopes_are_the_derivatives_of_the_motion(v: float, t: float, u: float, w: float) -> None:
    heading = 0.8
    slopes = fly_with_slopes(v, heading, u, w, t)
    whole = fly(0.0, 0.0, v, heading, u, w, t)
    np.testing.assert_allclose(slopes[:4], whole, rtol=1e-13, atol=1e-12)
    steps = (1e-2, 1e-6, 1e-5, 1e-5)
    for i, step in enumerate(steps):
        parts = []
        for way in (step, -step):
            moved = [v, heading, u, w]
            moved[i] += way
            parts.append(np.array(fly(0.0, 0.0, moved[0], moved[1], moved[2], moved[3], t)))
        slope = (parts[0] - parts[1]) / (2.0 * step)
        # Differences of 13 km keep half of the digits of a metre; at 25 m/s the path is nonlinear
        # by 1e-5 over the step of the speed.
        rtol = 2e-6 if v > 50.0 else 2e-5
        np.testing.assert_allclose([slopes[4 + i], slopes[8 + i]], slope[:2], rtol=rtol, atol=1e-4)
        if i in (0, 3):
            at = 12 if i == 0 else 13
            np.testing.assert_allclose(slopes[at], slope[3], rtol=rtol, atol=1e-9)


def test_kernels_equal_their_plain_forms() -> None:
    for state in ((0.0, 0.0, 150.0, 1.0, 2.0, 0.5, 40.0), (5.0, 6.0, 90.0, -2.0, 1e-8, 0.0, 9.0)):
        np.testing.assert_allclose(fly(*state), plain(fly)(*state), rtol=1e-14)
        np.testing.assert_allclose(
            fly_with_slopes(*state[2:]), plain(fly_with_slopes)(*state[2:]), rtol=1e-13
        )


@pytest.mark.parametrize(("speed", "w", "t"), [(5.0, 0.0, 1.0), (100.0, -2.0, 60.0)])
def test_an_aircraft_does_not_come_to_rest(speed: float, w: float, t: float) -> None:
    with pytest.raises(MotionParameterError, match="speed: expected at least 10 m/s"):
        advance([0.0, 0.0, speed, 0.0], 1.0, w, t)


def test_invalid_states_are_rejected() -> None:
    with pytest.raises(ShapeError, match="state: expected finite numbers"):
        advance([0.0, np.nan, 100.0, 0.0], 0.0, 0.0, 1.0)


def test_states_and_accelerations_broadcast() -> None:
    found: NDArray[np.float64] = advance(np.full((2, 1, 4), 100.0), [1.0, 2.0, 3.0], 0.0, 1.0)
    assert found.shape == (2, 3, 4)
