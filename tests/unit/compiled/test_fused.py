"""Fused multiply-add is rounded once, explicitly and independent of the compiler."""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import fused, loop


@loop
def fill(numbers: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for row in range(numbers.shape[0]):
        out[row] = fused(numbers[row, 0], numbers[row, 1], numbers[row, 2])


def test_compiled_it_is_rounded_once() -> None:
    rng = np.random.default_rng(1)
    pairs = rng.uniform(0.5, 2.0, (200, 2))
    numbers = np.column_stack([pairs, -pairs[:, 0] * pairs[:, 1]])
    found = np.empty(200)
    fill(numbers, found)
    exact = [
        float(Fraction(first) * Fraction(second) + Fraction(third))
        for first, second, third in numbers.tolist()
    ]
    np.testing.assert_array_equal(found, exact)
    # Rounded twice, all results would be zero.
    assert np.count_nonzero(found) > 100


def test_uncompiled_it_is_the_product_and_the_sum() -> None:
    assert fused(2.0, 3.0, 1.0) == 7.0
