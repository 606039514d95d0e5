"""Products over the biases in use have the same bits as those over all biases."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import ALL_BLOCKS, DENSE_MAX, read_out
from multiradar.estimation.filters.imm._column_list_kernels import (
    blocks_between,
    inform_of_columns,
    list_columns,
    read_out_columns,
    spread_of_columns,
)
from multiradar.estimation.filters.two_stage._information_kernels import inform, spread_of_biases

# The last block has fewer than eight columns.
COUNT = 2 * DENSE_MAX + 3
MODES = 3
USED = [2, 3, 24, 25, 26, COUNT - 1]
OWN = (40, 42)


@pytest.fixture
def mode_sensitivity() -> NDArray[np.float64]:
    random = np.random.default_rng(8)
    found = np.zeros((2 * MODES, 4, COUNT))
    found[MODES:][..., USED] = random.normal(size=(MODES, 4, len(USED)))
    found[MODES, :3, 2] = 0.0  # one component is enough
    return found


def _listed(mode_sensitivity: NDArray[np.float64]) -> tuple[NDArray[np.int64], int]:
    columns = np.full(COUNT, -1)
    return columns, list_columns(1, MODES, mode_sensitivity, ALL_BLOCKS, *OWN, columns)


def test_lists_the_biases_in_use_and_those_of_the_sensor(
    mode_sensitivity: NDArray[np.float64],
) -> None:
    columns, listed = _listed(mode_sensitivity)
    assert columns[:listed].tolist() == sorted({*USED, *range(*OWN)})
    only = blocks_between(24, 26)
    assert only == 1 << 3
    assert list_columns(1, MODES, mode_sensitivity, only, 24, 26, columns) == 3
    assert blocks_between(15, 17) == 0b110


def test_sums_are_those_over_all_biases(mode_sensitivity: NDArray[np.float64]) -> None:
    random = np.random.default_rng(9)
    columns, listed = _listed(mode_sensitivity)
    used = columns[:listed]
    root = random.normal(size=(COUNT, COUNT))
    covariance, slope = root @ root.T, np.zeros((2, COUNT))
    slope[:, used] = random.normal(size=(2, listed))
    scratch = np.empty((2, COUNT))
    expected = spread_of_biases(slope, covariance, scratch)
    assert spread_of_columns(slope, covariance, scratch, columns, listed) == expected
    sums = [(np.zeros((COUNT, COUNT)), np.zeros(COUNT)) for _ in range(2)]
    for _ in range(2):
        inform(1.0, 0.25, 2.0, 3.0, -1.0, slope, scratch, *sums[0])
        inform_of_columns(1.0, 0.25, 2.0, 3.0, -1.0, slope, scratch, *sums[1], columns, listed)
    np.testing.assert_array_equal(np.triu(sums[1][0]), np.triu(sums[0][0]))
    np.testing.assert_array_equal(sums[1][1], sums[0][1])
    assert sums[0][0].any()


def test_readout_is_that_over_all_biases(mode_sensitivity: NDArray[np.float64]) -> None:
    random = np.random.default_rng(10)
    columns, listed = _listed(mode_sensitivity)
    mean, covariance, bias = random.normal(size=4), np.arange(1.0, 11.0), random.normal(size=COUNT)
    factor = np.tril(random.normal(size=(COUNT, COUNT)))
    found, expected = np.full(8, np.nan), np.full(8, np.nan)
    for sensitivity in (mode_sensitivity[MODES], np.zeros((4, COUNT))):
        state = mean, covariance, sensitivity
        read_out(*state, ALL_BLOCKS, bias, factor, expected)
        read_out_columns(*state, bias, factor, columns, listed, found)
        np.testing.assert_array_equal(found, expected)
