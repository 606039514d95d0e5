"""Trimmed fits of chosen columns are least squares of the differences that are left in."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.cross_sensor.trimmed_fit import Equations

Floats = NDArray[np.float64]
TRUE = np.array([3.0, -2.0, 0.5])


# Differences of 1 m noise about `TRUE`; a tenth of them, by `far_m`, of other aircraft.
def differences(far_m: float = 0.0, count: int = 700) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(3)
    columns = rng.normal(0.0, 10.0, (count, 2, 5))
    apart = columns[:, :, [0, 2, 4]] @ TRUE + rng.normal(0.0, 1.0, (count, 2))
    apart[: count // 10] += far_m
    return apart, columns


def test_chosen_columns_are_fitted_without_outliers() -> None:
    apart, columns = differences(far_m=1e4)
    fit = Equations(apart, columns).fit([0, 2, 4])
    assert not fit.used[:70].any()
    rows = columns[fit.used][:, :, [0, 2, 4]].reshape(-1, 3)
    plain, *_ = np.linalg.lstsq(rows, apart[fit.used].ravel(), rcond=None)
    # The ridge is a millionth of the normal matrix.
    np.testing.assert_allclose(fit.solution, plain, rtol=1e-5)
    np.testing.assert_allclose(fit.inverse, np.linalg.inv(rows.T @ rows), rtol=1e-5, atol=1e-9)
    left = apart - columns[:, :, [0, 2, 4]] @ fit.solution
    np.testing.assert_allclose(fit.residual_m, np.linalg.norm(left, axis=1), rtol=1e-12)


def test_a_model_does_not_depend_on_the_columns_beside_it() -> None:
    apart, columns = differences(far_m=300.0)
    among, alone = Equations(apart, columns).fit([4, 1]), Equations(apart, columns[:, :, [4, 1]])
    np.testing.assert_allclose(among.solution, alone.fit([0, 1]).solution, rtol=1e-9)


# Each difference twice, of one aircraft: the second adds nothing.
def test_errors_that_an_aircraft_shares_are_counted_once() -> None:
    apart, columns = differences()
    once = Equations(apart, columns)
    twice = Equations(np.tile(apart, (2, 1)), np.tile(columns, (2, 1, 1)))
    names = np.arange(len(apart))
    chosen = [0, 2, 4]
    expected = once.clustered(once.fit(chosen), 2, names)
    found = twice.clustered(twice.fit(chosen), 2, np.tile(names, 2))
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(expected)), once.fit(chosen).sigma[1:], rtol=0.3)


# Columns without effect leave the differences as they are.
@pytest.mark.parametrize("lengths", [
    [3.0, 1.0, 7.0], [3.0, 1.0, 7.0, 5.0], [5.0, 1.0], [2.0], [1.0, 3.0, 12.0], [1.0, 3.0, 12.1],
    [0.2, 0.2, 4.0], [0.2, 0.2, 4.1],
])  # fmt: skip
def test_differences_are_left_out_beyond_four_times_their_median(lengths: list[float]) -> None:
    apart_m = np.column_stack([lengths, np.zeros(len(lengths))])
    fit = Equations(apart_m, np.zeros((len(lengths), 2, 1))).fit([0])
    assert fit.scale == max(np.median(lengths), 1.0)
    assert fit.used.tolist() == [one <= 4.0 * fit.scale for one in lengths]
