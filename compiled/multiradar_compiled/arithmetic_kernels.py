"""What the last bits of all output depend on besides the program: elementary functions."""

import hashlib
import math
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import kernel

# Libraries round a sine differently in one of some hundred arguments.
_ARGUMENTS: Final = 20_000
_OF_ONE: Final = (np.sin, np.cos, np.tan, np.exp, np.expm1, np.log, np.log1p, np.arcsin)
_OF_TWO: Final = (np.arctan2, np.hypot)


@cache
def arithmetic() -> str:
    """Return a digest of the results of elementary functions, compiled and in numpy.

    Everything else is rounded once, the same on every processor. These functions come from the C
    library and from numpy, which choose their form by what the processor can do.

    Returns
    -------
    str
        16 hexadecimal digits; equal on machines on which all output is equal.
    """
    # Multiples of the golden ratio, spread evenly over [0, 1).
    small = np.modf(np.arange(1, _ARGUMENTS + 1) * (math.sqrt(1.25) + 0.5))[0]
    large = 8.0 * small
    results = np.empty((6, _ARGUMENTS))
    elementary_functions(small, large, results)
    digest = hashlib.sha256(results.tobytes())
    for one in _OF_ONE:
        digest.update(one(small).tobytes())
    for two in _OF_TWO:
        digest.update(two(small, large).tobytes())
    return digest.hexdigest()[:16]


@kernel
def elementary_functions(
    small: NDArray[np.float64], large: NDArray[np.float64], results: NDArray[np.float64]
) -> None:
    """Write those that kernels call: sin, cos, exp and log of one column, and two of both."""
    for i in range(len(small)):
        results[0, i] = math.sin(large[i])
        results[1, i] = math.cos(large[i])
        results[2, i] = math.exp(-large[i])
        results[3, i] = math.log(small[i])
        results[4, i] = math.atan2(small[i], large[i])
        results[5, i] = math.hypot(small[i], large[i])
