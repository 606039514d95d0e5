"""Groups of tracks that depend on the biases of the same sensors."""

import numpy as np

from multiradar.estimation.filters._kernels import DENSE_MAX
from multiradar.tracking.mode_states import GROUP_TRACKS, groups_by_columns


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
