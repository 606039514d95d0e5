"""NEES is 1 for each dimension where the claim is right, and its band holds 95 %."""

import numpy as np
import pytest

from multiradar.evaluation.measures.consistency import Consistency, consistency


def drawn(claim: float) -> Consistency:
    """Return what 40 aircraft show that err by 10 m on each axis and claim another sigma."""
    draw = np.random.Generator(np.random.PCG64(3))
    aircraft, bins = 40, 300
    error = np.hypot(*draw.normal(0.0, 10.0, (2, aircraft * bins)))
    whose = np.repeat(np.arange(aircraft), bins)
    when = np.tile(np.arange(bins) * 10.0, aircraft)
    found = consistency(error, np.full(len(error), claim), whose, when)
    assert found is not None
    return found


def test_a_right_claim_gives_one_and_the_shares_of_the_band() -> None:
    found = drawn(10.0 * np.sqrt(2.0))
    assert found.samples == 12_000
    assert found.mean == pytest.approx(1.0, abs=0.03)
    assert found.inside == pytest.approx(0.95, abs=0.01)
    assert len(found.time_s) == 300
    assert found.inside_by_time == pytest.approx(0.95, abs=0.04)


def test_a_claim_of_half_the_error_gives_four_and_leaves_the_band() -> None:
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


def test_nothing_is_said_of_nothing() -> None:
    nothing = np.zeros(0)
    assert consistency(nothing, nothing, nothing.astype(np.int64), nothing) is None
