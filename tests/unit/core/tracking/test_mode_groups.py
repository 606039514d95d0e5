"""Groups of tracks that depend on the biases of the same sensors."""

import numpy as np

from multiradar.estimation.filters._kernels import DENSE_MAX
from multiradar.estimation.filters.arrays import aircraft_arrays
from multiradar.tracking.mode_states import GROUP_TRACKS, groups_by_columns, mode_states


def test_groups_give_the_products_of_all_columns() -> None:
    random = np.random.default_rng(5)
    tracks, width = 3 * GROUP_TRACKS + 5, 4 * DENSE_MAX
    sensitivity = np.zeros((tracks, 4, width))
    for track in range(tracks):
        first = int(random.integers(0, width - 6))
        sensitivity[track, :, first : first + 6] = random.normal(size=(4, 6))
    # Without any, as of an aircraft that only ADS-B has reported.
    sensitivity[7] = 0.0
    factor = np.triu(random.normal(size=(width, width)))
    product, seen, used = np.full_like(sensitivity, np.nan), np.zeros(tracks), 0
    for some, columns in groups_by_columns(sensitivity):
        product[some] = sensitivity[some][..., columns] @ factor.T[columns]
        seen[some] += 1
        used += len(np.arange(width)[columns])
    np.testing.assert_allclose(product, sensitivity @ factor.T, rtol=1e-12, atol=1e-12)
    assert (seen == 1).all()
    assert used < 2.5 * width  # of four groups


def test_few_columns_are_one_group() -> None:
    groups = list(groups_by_columns(np.zeros((5, 4, DENSE_MAX))))
    assert groups == [(slice(None), slice(None))]


def test_modes_of_many_biases_are_those_of_the_biases_in_use() -> None:
    random = np.random.default_rng(6)
    used = 2 * DENSE_MAX
    few, many = (aircraft_arrays(3, width, modes=2) for width in (DENSE_MAX, used))
    few.mode_probability[:] = 0.5
    few.mode_probability[1] = np.nan  # before its second plot
    few.mean[:], few.covariance[:], few.sensitivity[:] = random.normal(size=(3, 4)), 1.0, 0.0
    few.sensitivity[:, :, 3:7] = random.normal(size=(3, 4, 4))
    few.mode_mean[:], few.mode_covariance[:], few.mode_sensitivity[:] = 2.0, 1.0, 0.0
    few.mode_sensitivity[:, :, 3:7] = random.normal(size=(6, 4, 4))
    for name, array in few._asdict().items():
        other = getattr(many, name)
        other[tuple(slice(size) for size in array.shape)] = array
    many.sensitivity[..., DENSE_MAX:] = many.mode_sensitivity[..., DENSE_MAX:] = 0.0
    bias, factor = random.normal(size=used), np.triu(random.normal(size=(used, used)))
    corner = slice(DENSE_MAX)
    factor[corner, DENSE_MAX:] = 0.0
    expected = mode_states(few, np.arange(3), bias[corner], factor[corner, corner])
    found = mode_states(many, np.arange(3), bias, factor)
    np.testing.assert_array_equal(found.probability, expected.probability)
    np.testing.assert_allclose(found.mean, expected.mean, rtol=1e-12)
    np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-12)
