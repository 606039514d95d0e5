"""Kernels are compiled once for the types of their arguments."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, inner_loop, kernel, loop

Floats = NDArray[np.float64]


@in_loop
def inlined(value: float, power: int, negative: bool) -> float:
    result = value**power
    return -result if negative else result


@loop
def called(value: float, power: int, negative: bool) -> float:
    return inlined(value, power, negative)


@inner_loop
def within(numbers: Floats) -> float:
    total = 0.0
    for number in numbers:
        total += inlined(number, 2, True)
    return total


@kernel
def totals(numbers: Floats) -> float:
    return within(numbers) - called(numbers[0], 2, False)


@kernel
def constants(out: Floats) -> None:
    out[0] = inlined(out[0], 2, False) + called(out[0], 2, False)
    out[1] = inlined(out[1], 3, True) + called(out[1], 3, negative=True)
    out[2] = inlined(out[2], out.shape[0], False) + called(out[2], out.shape[0], False)


@pytest.mark.parametrize("callee", [inlined, called])
def test_constants_are_arguments_as_others(callee: Any) -> None:
    numbers = np.array([3.0, 2.0, 2.0])
    constants(numbers)
    # What an earlier run left in the cache would be loaded without its callees.
    caller: Any = constants
    caller.recompile()
    assert numbers.tolist() == [18.0, -16.0, 16.0]
    assert [str(one) for one in callee.signatures[0]] == ["float64", "int64", "bool"]
    assert len(callee.signatures) == 1


def test_a_part_is_translated_with_its_callers_alone() -> None:
    numbers = np.array([1.0, 2.0, 3.0])
    caller: Any = totals
    caller.recompile()
    assert totals(numbers) == -15.0
    part: Any = within
    (compiled,) = part.overloads.values()
    # A function that is ready to run has its address.
    assert not compiled.library.codegen._engine.is_symbol_defined(compiled.fndesc.mangled_name)
    assert within(numbers) == -14.0
