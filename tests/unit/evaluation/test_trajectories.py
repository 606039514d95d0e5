"""The reference between its positions: lines, curves, gaps, ends."""

import numpy as np
import pytest

from multiradar.evaluation.trajectories import positions_at
from support.scenarios.skies import Row, reference_of, straight


def turning(times: list[float], rate_rad_per_s: float = np.radians(3.0)) -> list[Row]:
    speed = 200.0
    return [
        (
            t,
            speed / rate_rad_per_s * (1.0 - np.cos(rate_rad_per_s * t)),
            speed / rate_rad_per_s * np.sin(rate_rad_per_s * t),
            speed * np.sin(rate_rad_per_s * t),
            speed * np.cos(rate_rad_per_s * t),
        )
        for t in times
    ]


def test_a_turn_is_interpolated_to_decimetres_with_velocities_and_cut_without() -> None:
    coarse, fine = [5.0 * n for n in range(13)], [0.7 * n for n in range(85)]
    true = np.array(turning(fine))
    first = np.zeros(len(fine), np.int64)
    curve = positions_at(reference_of({"a": turning(coarse)}), first, np.array(fine))
    assert np.hypot(*(curve.position_m - true[:, 1:3]).T).max() < 0.2
    assert np.hypot(*(curve.velocity_mps - true[:, 3:5]).T).max() < 0.2
    lines = positions_at(
        reference_of({"a": turning(coarse)}, velocities=False), first, np.array(fine)
    )
    # a Δt² / 8 with 10.5 m/s² and 5 s.
    assert np.hypot(*(lines.position_m - true[:, 1:3]).T).max() == pytest.approx(32.7, rel=0.03)


def test_nothing_is_known_before_after_and_in_a_gap() -> None:
    rows = straight([0.0, 10.0, 40.0, 50.0], 0.0, 0.0, 100.0, 0.0)
    reference = reference_of({"a": rows, "b": straight([20.0, 30.0], 0.0, 9e4, 0.0, 0.0)})
    times = np.array([-0.1, 0.0, 5.0, 10.0, 10.1, 39.9, 40.0, 50.0, 50.1])
    found = positions_at(reference, np.zeros(len(times), np.int64), times)
    known = [False, True, True, True, False, False, True, True, False]
    assert np.isfinite(found.position_m[:, 0]).tolist() == known
    assert found.position_m[2] == pytest.approx([500.0, 0.0])
    assert np.isnan(positions_at(reference, np.array([-1]), np.array([5.0])).position_m).all()


def test_the_end_of_a_line_has_the_velocity_that_leads_to_it() -> None:
    rows = straight([0.0, 10.0, 40.0], 0.0, 0.0, 100.0, 0.0)
    reference = reference_of({"a": rows}, velocities=False)
    found = positions_at(reference, np.zeros(3, np.int64), np.array([0.0, 10.0, 40.0]))
    assert found.velocity_mps[:2] == pytest.approx(np.array([[100.0, 0.0], [100.0, 0.0]]))
    # A position alone has none.
    assert np.isnan(found.velocity_mps[2]).all()


def test_velocities_of_rows_close_together_span_a_second() -> None:
    """With positions to 10 m, rows a millisecond apart would give 10 km/s."""
    times = [0.0, 0.001, 0.4, 1.2, 1.201, 2.0]
    rows = [(t, 100.0 * t + 10.0 * (n % 2), 0.0, 0.0, 0.0) for n, t in enumerate(times)]
    reference = reference_of({"a": rows, "b": rows[:3]}, velocities=False)
    found = positions_at(reference, np.zeros(6, np.int64), np.array(times))
    assert found.velocity_mps[:, 0] == pytest.approx(100.0, abs=13.0)
    # Within less than a second none is known.
    assert np.isnan(positions_at(reference, np.array([1]), np.array([0.4])).velocity_mps).all()
