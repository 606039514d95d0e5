"""LLVM intrinsics of lanes; see `lane_kernels` for their meaning."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

LANES = 8

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INTEGERS = ir.VectorType(ir.IntType(64), LANES)
_PLACES = ir.VectorType(ir.IntType(32), LANES)
_INTEGER = ir.IntType(64)
# Numbers of this size have no fraction; their last bits are a whole number.
_WHOLE = 1.5 * 2.0**52
_FRACTION_BITS = 52
_BITS_OF_ONE = 0x3FF0000000000000


class LanesType(types.Type):
    """The type of lanes in compiled functions."""

    def __init__(self) -> None:
        super().__init__("Lanes")


_LANES = LanesType()
# numba has no type annotations of these.
_PrimitiveModel: Any = models.PrimitiveModel
_declare: Any = cgutils.get_or_insert_function


@register_model(LanesType)
class _LanesModel(_PrimitiveModel):  # type: ignore[misc]  # numba is untyped.
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, _VECTOR)


def _typed_broadcast(typing: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _spread(builder, given[0], _VECTOR)

    return _LANES(types.float64), generate


def _typed_extract_lane(typing: Any, lanes: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.extract_element(given[0], given[1])

    return types.float64(_LANES, types.int64), generate


def _shuffle(*places: int) -> Any:
    # Indices from 8 on are lanes of the second vector.
    def typed(typing: Any, one: Any, other: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            return builder.shuffle_vector(given[0], given[1], ir.Constant(_PLACES, places))

        return _LANES(_LANES, _LANES), generate

    return intrinsic(typed)


def _typed_read_part(typing: Any, array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _read(context, builder, signature, given[0], given[1:4], given[4])

    i = types.int64
    return _LANES(array, i, i, i, i), generate


def _typed_read_columns(typing: Any, array: Any, row: Any, first: Any, count: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _read(context, builder, signature, given[0], given[1:3], given[3])

    i = types.int64
    return _LANES(array, i, i, i), generate


def _typed_write_part(
    typing: Any, array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _write(context, builder, signature, given[0], given[1:4], given[4], given[5])

    i = types.int64
    return types.void(array, i, i, i, i, _LANES), generate


def _typed_write_columns(
    typing: Any, array: Any, row: Any, first: Any, count: Any, lanes: Any
) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _write(context, builder, signature, given[0], given[1:3], given[3], given[4])

    i = types.int64
    return types.void(array, i, i, i, _LANES), generate


def _read(context: Any, builder: Any, signature: Any, array: Any, indices: Any, count: Any) -> Any:
    place = _place(context, builder, signature, array, indices)
    mask = _mask(builder, count)
    name = f"llvm.masked.load.v{LANES}f64.p0"
    of = ir.FunctionType(_VECTOR, [place.type, ir.IntType(32), mask.type, _VECTOR])
    function = _declare(builder.module, of, name)
    zero = ir.Constant(_VECTOR, [0.0] * LANES)
    return builder.call(function, [place, ir.IntType(32)(8), mask, zero])


def _write(
    context: Any, builder: Any, signature: Any, array: Any, indices: Any, count: Any, lanes: Any
) -> Any:
    place = _place(context, builder, signature, array, indices)
    # AMD processors execute a masked store as forty operations.
    with builder.if_else(builder.icmp_signed(">=", count, _INTEGER(LANES))) as (whole, part):
        with whole:
            builder.store(lanes, place, align=8)
        with part:
            mask = _mask(builder, count)
            name = f"llvm.masked.store.v{LANES}f64.p0"
            of = ir.FunctionType(ir.VoidType(), [_VECTOR, place.type, ir.IntType(32), mask.type])
            function = _declare(builder.module, of, name)
            builder.call(function, [lanes, place, ir.IntType(32)(8), mask])
    return context.get_dummy_value()


# Address of the first column; the last axis of the array is contiguous.
def _place(context: Any, builder: Any, signature: Any, array: Any, indices: Any) -> Any:
    view = context.make_array(signature.args[0])(context, builder, array)
    offset = builder.mul(indices[-1], _INTEGER(8))
    for axis, index in enumerate(indices[:-1]):
        stride = builder.extract_value(view.strides, axis)
        offset = builder.add(offset, builder.mul(stride, index))
    byte = ir.IntType(8).as_pointer()
    place = builder.gep(builder.bitcast(view.data, byte), [offset])
    return builder.bitcast(place, _VECTOR.as_pointer())


# Mask of the first lanes.
def _mask(builder: Any, count: Any) -> Any:
    numbers = ir.Constant(_INTEGERS, list(range(LANES)))
    return builder.icmp_signed("<", numbers, _spread(builder, count, _INTEGERS))


# One number in every lane.
def _spread(builder: Any, value: Any, vector: Any) -> Any:
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.IntType(32)(0))
    places = ir.Constant(_PLACES, [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), places)


def _widened(builder: Any, signature: Any, given: Any) -> list[Any]:
    # Broadcasts single numbers.
    return [
        value if kind is _LANES else _spread(builder, value, _VECTOR)
        for kind, value in zip(signature.args, given, strict=True)
    ]


def _signature(*given: Any) -> Any:
    return _LANES(*[kind if kind is _LANES else types.float64 for kind in given])


def _arithmetic(instruction: str) -> Callable[..., Any]:
    def typed(typing: Any, one: Any, other: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            return getattr(builder, instruction)(*_widened(builder, signature, given))

        return _signature(one, other), generate

    made: Callable[..., Any] = intrinsic(typed)
    return made


def _typed_negate(typing: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.fneg(given[0])

    return _LANES(_LANES), generate


def _typed_fuse(typing: Any, first: Any, second: Any, third: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        of = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        function = _declare(builder.module, of, f"llvm.fma.v{LANES}f64")
        return builder.call(function, _widened(builder, signature, given))

    return _signature(first, second, third), generate


def series(coefficients: tuple[float, ...]) -> Any:
    """Return the intrinsic of a polynomial, the coefficient of the highest power first."""

    def typed(typing: Any, lanes: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            of = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
            function = _declare(builder.module, of, f"llvm.fma.v{LANES}f64")
            value, *others = (ir.Constant(_VECTOR, [one] * LANES) for one in coefficients)
            for other in others:
                value = builder.call(function, [value, given[0], other])
            return value

        return _LANES(_LANES), generate

    return intrinsic(typed)


def _typed_greater_of(typing: Any, one: Any, other: Any, more: Any, less: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        first, second, yes, no = _widened(builder, signature, given)
        return builder.select(builder.fcmp_ordered(">", first, second), yes, no)

    return _signature(one, other, more, less), generate


def _typed_square_root(typing: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        of = ir.FunctionType(_VECTOR, [_VECTOR])
        return builder.call(_declare(builder.module, of, f"llvm.sqrt.v{LANES}f64"), given)

    return _LANES(_LANES), generate


def _typed_round_off(typing: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        whole = ir.Constant(_VECTOR, [_WHOLE] * LANES)
        return builder.fsub(builder.fadd(given[0], whole), whole)

    return _LANES(_LANES), generate


def _typed_power_of_two(typing: Any, lanes: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        whole = builder.fadd(given[0], ir.Constant(_VECTOR, [_WHOLE] * LANES))
        bits = builder.bitcast(whole, _INTEGERS)
        shift = ir.Constant(_INTEGERS, [_FRACTION_BITS] * LANES)
        one = ir.Constant(_INTEGERS, [_BITS_OF_ONE] * LANES)
        return builder.bitcast(builder.add(builder.shl(bits, shift), one), _VECTOR)

    return _LANES(_LANES), generate


broadcast: Any = intrinsic(_typed_broadcast)
extract_lane: Any = intrinsic(_typed_extract_lane)
# By pairs, the even lanes of two vectors, and the odd ones; by fours, the first pairs and the last
# ones; the first halves, and the last ones.
evens: Any = _shuffle(0, 8, 2, 10, 4, 12, 6, 14)
odds: Any = _shuffle(1, 9, 3, 11, 5, 13, 7, 15)
first_pairs: Any = _shuffle(0, 1, 8, 9, 4, 5, 12, 13)
last_pairs: Any = _shuffle(2, 3, 10, 11, 6, 7, 14, 15)
first_halves: Any = _shuffle(0, 1, 2, 3, 8, 9, 10, 11)
last_halves: Any = _shuffle(4, 5, 6, 7, 12, 13, 14, 15)
read_part: Any = intrinsic(_typed_read_part)
read_columns: Any = intrinsic(_typed_read_columns)
write_part: Any = intrinsic(_typed_write_part)
write_columns: Any = intrinsic(_typed_write_columns)
add: Any = _arithmetic("fadd")
subtract: Any = _arithmetic("fsub")
multiply: Any = _arithmetic("fmul")
divide: Any = _arithmetic("fdiv")
negate: Any = intrinsic(_typed_negate)
fuse: Any = intrinsic(_typed_fuse)
greater_of: Any = intrinsic(_typed_greater_of)
square_root: Any = intrinsic(_typed_square_root)
round_off: Any = intrinsic(_typed_round_off)
power_of_two: Any = intrinsic(_typed_power_of_two)
