"""Four numbers side by side in compiled functions, where the compiler does not do so by itself.

A loop over the columns of several arrays becomes vector instructions only when the compiler can
show that the arrays do not overlap, and of loops that take many arrays it gives up. Here the
columns are taken four at a time by name: `load_lanes`, the operators + − · and `store_lanes`. Each
lane is computed as a number by itself would be, so that results are the same to the last bit.
Uncompiled, lanes are arrays of NumPy.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import (
    intrinsic,
    models,
    overload,
    register_model,
)
from numpy.typing import NDArray

LANES = 4
Lanes = NDArray[np.float64]

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INTEGERS = ir.VectorType(ir.IntType(64), LANES)
_IN_LOOP: Any = {"forceinline": True, "_nrt": False}


class LanesType(types.Type):
    """The type of lanes in compiled functions."""

    def __init__(self) -> None:
        super().__init__("Lanes")


_LANES = LanesType()
# numba tells no types of these.
_PrimitiveModel: Any = models.PrimitiveModel
_declare: Any = cgutils.get_or_insert_function


@register_model(LanesType)
class _LanesModel(_PrimitiveModel):  # type: ignore[misc]  # numba tells no types.
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, _VECTOR)


def load_lanes(array: NDArray[np.float64], row: int, part: int, first: int, count: int) -> Lanes:
    """Return columns of an array.

    Parameters
    ----------
    array : (r, p, c) ndarray of float64
        The array; its last axis is without gaps.
    row, part : int
        Which of its first and second axis.
    first, count : int
        First column, and how many: `LANES`, or fewer at the end; the other lanes are zero.

    Returns
    -------
    lanes
        The numbers.
    """
    return array[row, part, first : first + count].copy()


def store_lanes(
    array: NDArray[np.float64], row: int, part: int, first: int, count: int, lanes: Lanes
) -> None:
    """Set columns of an array: arguments as in `load_lanes`."""
    array[row, part, first : first + count] = lanes


def lanes_of(first: float, second: float, third: float, fourth: float) -> Lanes:
    """Return four numbers side by side.

    Parameters
    ----------
    first, second, third, fourth : float
        The numbers.

    Returns
    -------
    lanes
        The numbers.
    """
    return np.array([first, second, third, fourth])


def lane_of(lanes: Lanes, place: int) -> float:
    """Return one of the numbers.

    Parameters
    ----------
    lanes : lanes
        The numbers.
    place : int
        Which, 0 to 3.

    Returns
    -------
    float
        The number.
    """
    return float(lanes[place])


@overload(load_lanes, jit_options=_IN_LOOP)
def _load(array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
    def compiled(array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
        return _read(array, row, part, first, count)

    return compiled


@overload(store_lanes, jit_options=_IN_LOOP)
def _store(array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any) -> Any:
    def compiled(array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any) -> None:
        _write(array, row, part, first, count, lanes)

    return compiled


@overload(lanes_of, jit_options=_IN_LOOP)
def _of(first: Any, second: Any, third: Any, fourth: Any) -> Any:
    def compiled(first: Any, second: Any, third: Any, fourth: Any) -> Any:
        return _join(first, second, third, fourth)

    return compiled


@overload(lane_of, jit_options=_IN_LOOP)
def _at(lanes: Any, place: Any) -> Any:
    def compiled(lanes: Any, place: Any) -> Any:
        return _take(lanes, place)

    return compiled


def _typed_join(typing: Any, first: Any, second: Any, third: Any, fourth: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        made = ir.Constant(_VECTOR, ir.Undefined)
        for place, value in enumerate(given):
            made = builder.insert_element(made, value, ir.IntType(32)(place))
        return made

    return _LANES(*[types.float64] * LANES), generate


def _typed_take(typing: Any, lanes: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.extract_element(given[0], given[1])

    return types.float64(_LANES, types.int64), generate


def _typed_read(typing: Any, array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place, mask = _place_and_mask(context, builder, signature, given)
        name = f"llvm.masked.load.v{LANES}f64.p0"
        of = ir.FunctionType(_VECTOR, [place.type, ir.IntType(32), mask.type, _VECTOR])
        function = _declare(builder.module, of, name)
        zero = ir.Constant(_VECTOR, [0.0] * LANES)
        return builder.call(function, [place, ir.IntType(32)(8), mask, zero])

    i = types.int64
    return _LANES(array, i, i, i, i), generate


def _typed_write(
    typing: Any, array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        place, mask = _place_and_mask(context, builder, signature, given)
        name = f"llvm.masked.store.v{LANES}f64.p0"
        of = ir.FunctionType(ir.VoidType(), [_VECTOR, place.type, ir.IntType(32), mask.type])
        function = _declare(builder.module, of, name)
        builder.call(function, [given[5], place, ir.IntType(32)(8), mask])
        return context.get_dummy_value()

    i = types.int64
    return types.void(array, i, i, i, i, _LANES), generate


# Where the first of the columns stands, and which lanes are among them.
def _place_and_mask(context: Any, builder: Any, signature: Any, given: Any) -> tuple[Any, Any]:
    view = context.make_array(signature.args[0])(context, builder, given[0])
    offset = builder.mul(given[3], ir.IntType(64)(8))
    for axis in (0, 1):
        stride = builder.extract_value(view.strides, axis)
        offset = builder.add(offset, builder.mul(stride, given[1 + axis]))
    byte = ir.IntType(8).as_pointer()
    place = builder.gep(builder.bitcast(view.data, byte), [offset])
    counted = _spread(builder, given[4], _INTEGERS)
    numbers = ir.Constant(_INTEGERS, list(range(LANES)))
    return builder.bitcast(place, _VECTOR.as_pointer()), builder.icmp_signed("<", numbers, counted)


# One number in every lane.
def _spread(builder: Any, value: Any, vector: Any) -> Any:
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.IntType(32)(0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), places)


def _operation(python: Callable[..., Any], instruction: str) -> None:
    # Lanes with lanes, or with a number, which then stands in every lane.
    def typed(typing: Any, one: Any, other: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            lanes = [
                value if kind is _LANES else _spread(builder, value, _VECTOR)
                for kind, value in zip(signature.args, given, strict=True)
            ]
            return getattr(builder, instruction)(*lanes)

        kinds = [kind if kind is _LANES else types.float64 for kind in (one, other)]
        return _LANES(*kinds), generate

    made: Any = intrinsic(typed)

    @overload(python, jit_options=_IN_LOOP)
    def chosen(one: Any, other: Any) -> Any:
        if not (isinstance(one, LanesType) or isinstance(other, LanesType)):
            return None

        def compiled(one: Any, other: Any) -> Any:
            return made(one, other)

        return compiled


_read: Any = intrinsic(_typed_read)
_write: Any = intrinsic(_typed_write)
_join: Any = intrinsic(_typed_join)
_take: Any = intrinsic(_typed_take)
_operation(operator.add, "fadd")
_operation(operator.sub, "fsub")
_operation(operator.mul, "fmul")
