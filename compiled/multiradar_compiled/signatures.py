"""Argument types of kernels as text, for storage in a file.

A number is `int64`, an array `float64[2C]` (dimensions and layout; followed by `!` if read only), a
named tuple `package.module:Name{float64[1C] int64[1C]}`, another tuple `(int64 float64[1C])`.
"""

import re
from importlib import import_module
from typing import Any

from numba import types as numba_types
from numba.np.numpy_support import as_dtype, from_dtype

# numba's types are only partly declared.
types: Any = numba_types

_TOKEN = re.compile(r"[\w.:\[\]!]+|[{}()]")
_ARRAY = re.compile(r"(?P<dtype>\w+)\[(?P<dimensions>\d+)(?P<layout>[ACF])\](?P<fixed>!?)")
_CLOSING = {"{": "}", "(": ")"}
_NUMBERS = {
    str(one): one
    for one in (
        *(types.int8, types.int16, types.int32, types.int64),
        *(types.uint8, types.uint16, types.uint32, types.uint64),
        *(types.float32, types.float64, types.boolean, types.none),
    )
}


def describe(argument: Any) -> str:
    """Return a type as text.

    Parameters
    ----------
    argument : numba type
        A number, an array of numbers, or a tuple of these.

    Raises
    ------
    TypeError
        For other types.
    """
    if isinstance(argument, types.BaseNamedTuple):
        name = f"{argument.instance_class.__module__}:{argument.instance_class.__qualname__}"
        return f"{name}{{{_describe_all(argument.types)}}}"
    if isinstance(argument, types.BaseTuple):
        return f"({_describe_all(argument.types)})"
    if isinstance(argument, types.Array):
        form = f"{as_dtype(argument.dtype)}[{argument.ndim}{argument.layout}]"
        return form if argument.mutable else form + "!"
    if str(argument) in _NUMBERS:
        return str(argument)
    msg = f"expected a type of numbers, arrays and tuples, was {argument}"
    raise TypeError(msg)


def parse(text: str) -> Any:
    """Return the type of a text by `describe`.

    Raises
    ------
    ValueError
        If no type has this text, as when a named tuple has other fields now.
    """
    tokens = _TOKEN.findall(text)
    parsed = _parse(tokens)
    if tokens:
        raise _unknown(text)
    return parsed


def _describe_all(arguments: Any) -> str:
    return " ".join(describe(one) for one in arguments)


def _parse(tokens: list[str]) -> Any:
    token = tokens.pop(0) if tokens else ""
    if token == "(":
        return types.Tuple(_parse_until(")", tokens))
    if ":" in token and tokens[:1] == ["{"]:
        tokens.pop(0)
        module, _, name = token.partition(":")
        named = getattr(import_module(module), name)
        parts = _parse_until("}", tokens)
        if len(parts) != len(named._fields):
            msg = f"expected {len(named._fields)} fields of {token}, was {len(parts)}"
            raise ValueError(msg)
        if len(set(parts)) == 1:
            return types.NamedUniTuple(parts[0], len(parts), named)
        return types.NamedTuple(parts, named)
    if array := _ARRAY.fullmatch(token):
        element = from_dtype(as_dtype(_number(array["dtype"])))
        dimensions = int(array["dimensions"])
        return types.Array(element, dimensions, array["layout"], readonly=array["fixed"] == "!")
    return _number(token)


def _parse_until(closing: str, tokens: list[str]) -> list[Any]:
    parts = []
    while tokens and tokens[0] != closing:
        parts.append(_parse(tokens))
    if not tokens:
        raise _unknown(closing)
    tokens.pop(0)
    return parts


def _number(name: str) -> Any:
    if name not in _NUMBERS:
        raise _unknown(name)
    return _NUMBERS[name]


def _unknown(text: str) -> ValueError:
    return ValueError(f"expected a type such as float64[2C], was {text!r}")
