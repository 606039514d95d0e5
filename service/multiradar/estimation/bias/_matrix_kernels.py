"""Compiled algebra of the shared biases.

The published biases enter every track, so these products and inverses determine the last bits of
all output. Each sum has one order here. Libraries of linear algebra choose theirs by the type of
the processor, and by the number of threads.

References
----------
N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd edition, SIAM 2002, chapters 10
and 14.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import inlined_kernel, kernel

Floats = NDArray[np.float64]


@kernel
def multiply(left: Floats, right: Floats) -> Floats:
    """Return the product of an (n, m) and an (m, k) matrix."""
    result = np.zeros((left.shape[0], right.shape[1]))
    for i in range(left.shape[0]):
        add_rows(result[i], left[i], right, 0, left.shape[1], 0, right.shape[1])
    return result


@kernel
def triangular_root(matrix: Floats) -> Floats:
    """Return the upper triangular U with UᵀU equal to the symmetric matrix.

    The last element is NaN if the matrix is not positive definite.
    """
    count = matrix.shape[0]
    root = np.zeros((count, count))
    factors = np.empty(count)
    for i in range(count):
        root[i, i:] = matrix[i, i:]
        factors[:i] = -root[:i, i]
        add_rows(root[i], factors, root, 0, i, i, count)
        if not root[i, i] > 0.0:
            root[count - 1, count - 1] = math.nan
            return root
        root[i, i:] /= math.sqrt(root[i, i])
    return root


@kernel
def inverse_by_root(root: Floats) -> Floats:
    """Return (UᵀU)⁻¹ of an upper triangular U, exactly symmetric."""
    count = root.shape[0]
    factors = np.empty(count)
    half = np.zeros((count, count))
    for i in range(count):
        factors[:i] = -root[:i, i]
        half[i, i] = 1.0
        add_rows(half[i], factors, half, 0, i, 0, i)
        half[i, : i + 1] /= root[i, i]
    result = np.zeros((count, count))
    for i in range(count):
        factors[:] = half[:, i]
        add_rows(result[i], factors, half, i, count, 0, i + 1)
        result[:i, i] = result[i, :i]
    return result


# Four rows at a time: the sum is loaded and stored a quarter as often. The order of the additions
# does not depend on how the compiler vectorises, for its lanes are columns.
@inlined_kernel
def add_rows(
    to: Floats, factors: Floats, rows: Floats, first: int, stop: int, start: int, end: int
) -> None:
    """Add rows[k] times factors[k], first ≤ k < stop, to the columns start ≤ j < end."""
    k = first
    while k + 4 <= stop:
        f0, f1, f2, f3 = factors[k], factors[k + 1], factors[k + 2], factors[k + 3]
        r0, r1, r2, r3 = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        for j in range(start, end):
            to[j] += f0 * r0[j] + f1 * r1[j] + f2 * r2[j] + f3 * r3[j]
        k += 4
    while k < stop:
        f0 = factors[k]
        r0 = rows[k]
        for j in range(start, end):
            to[j] += f0 * r0[j]
        k += 1
