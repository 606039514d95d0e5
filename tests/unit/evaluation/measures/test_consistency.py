"""NEES is 1 per dimension where the covariance is correct, and its band holds 95 %."""

import numpy as np
import pytest

from multiradar.evaluation.measures.consistency import Consistency, consistency


def drawn(claim: float) -> Consistency:
    """Return the NEES of 40 aircraft with errors of 10 m per axis and another reported sigma."""
    draw = np.random.Generator(np.random.PCG64(3))
    aircraft, bins = 40, 300
    error = np.hypot(*draw.normal(0.0, 10.0, (2, aircraft * bins)))
    aircraft_index = np.repeat(np.arange(aircraft), bins)
    when = np.tile(np.arange(bins) * 10.0, aircraft)
    found = consistency(error, np.full(len(error), claim), aircraft_index, when)
    assert found is not None
    return found


def test_a_correct_covariance_gives_one_and_nominal_containment() -> None:
    found = drawn(10.0 * np.sqrt(2.0))
    assert found.samples == 12_000
    assert found.mean == pytest.approx(1.0, abs=0.03)
    assert found.inside == pytest.approx(0.95, abs=0.01)
    assert len(found.time_s) == 300
    assert found.inside_by_time == pytest.approx(0.95, abs=0.04)


def test_a_sigma_of_half_the_error_gives_four_outside_the_band() -> None:
    found = drawn(5.0 * np.sqrt(2.0))
    assert found.mean == pytest.approx(4.0, abs=0.1)
    assert found.inside_by_time == 0.0


def test_the_band_is_that_of_chi_square() -> None:
    error, sigma = np.full(4, 1.0), np.full(4, 1.0)
    found = consistency(error, sigma, np.arange(4), np.zeros(4))
    assert found is not None
    # Table of chi-square with 8 degrees of freedom: 2.180 and 17.535.
    assert found.low[0] * 8 == pytest.approx(2.180, abs=5e-4)
    assert found.high[0] * 8 == pytest.approx(17.535, abs=5e-4)
    assert found.mean_by_time[0] == pytest.approx(1.0)


def test_one_update_of_each_aircraft_counts_in_a_bin() -> None:
    found = consistency(
        np.array([9.0, 1.0, 1.0]), np.ones(3), np.array([0, 0, 1]), np.array([1.0, 2.0, 3.0])
    )
    assert found is not None
    assert found.mean_by_time.tolist() == [1.0]
    assert found.mean == pytest.approx((81.0 + 1.0 + 1.0) / 3.0)


def test_no_samples_give_no_result() -> None:
    nothing = np.zeros(0)
    assert consistency(nothing, nothing, nothing.astype(np.int64), nothing) is None
