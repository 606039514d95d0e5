"""Columns of a table as arrays, without copies: the Arrow C data interface.

Apache Arrow, "The Arrow C data interface" and "The Arrow C stream interface"; the layout of texts
is that of "variable-size binary view" of the columnar format 1.5: 16 octets each, the length
(int32) and a text of up to 12 octets, or the first four octets of a longer one and its place.
"""

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

#: Octets of a text that its view contains.
INLINE_OCTETS_MAX = 12

_RELEASE: Any = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class _Array(ctypes.Structure):
    pass


_Arrays = ctypes.POINTER(ctypes.POINTER(_Array))
_Array._fields_ = [
    ("length", ctypes.c_int64),
    ("null_count", ctypes.c_int64),
    ("offset", ctypes.c_int64),
    ("n_buffers", ctypes.c_int64),
    ("n_children", ctypes.c_int64),
    ("buffers", ctypes.POINTER(ctypes.c_void_p)),
    ("children", _Arrays),
    ("dictionary", ctypes.c_void_p),
    ("release", ctypes.c_void_p),
    ("private", ctypes.c_void_p),
]


class _Stream(ctypes.Structure):
    _fields_ = (
        ("get_schema", ctypes.c_void_p),
        ("get_next", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(_Array))),
        ("get_last_error", ctypes.c_void_p),
        ("release", ctypes.c_void_p),
        ("private", ctypes.c_void_p),
    )


_pointer: Any = ctypes.pythonapi.PyCapsule_GetPointer
_pointer.restype = ctypes.c_void_p
_pointer.argtypes = [ctypes.py_object, ctypes.c_char_p]

# Data type of the values by that of the column; texts have two numbers each.
_TYPES: dict[type[pl.DataType], tuple[str, int]] = {
    pl.Float64: ("<f8", 1),
    pl.Int64: ("<i8", 1),
    pl.String: ("<i8", 2),
}
#: Types of columns that can be exported.
VIEWED = frozenset(_TYPES)
_ALL_VALID = np.empty(0, np.uint8)


class Column(NamedTuple):
    """A column in place.

    Attributes
    ----------
    values : (n,) float64, (n,) int64 or (n, 2) int64
        Numbers, arbitrary where there is none; of texts the views.
    valid : (k,) uint8
        Bits of the rows that have a value; empty if all have.
    begin : int
        Bit of the first row.
    """

    values: NDArray[Any]
    valid: NDArray[np.uint8]
    begin: int


@contextmanager
def exported(frame: pl.DataFrame, names: Sequence[str]) -> Iterator[dict[str, Column]]:
    """Export columns of a table; the arrays may be read, within the context only.

    Parameters
    ----------
    frame : DataFrame
        The table, at least one row.
    names : sequence of str
        Its columns to export, of type Float64, Int64 or String.

    Returns
    -------
    dict of str to Column
        The columns.
    """
    chosen = frame[:, list(names)].rechunk()
    capsule = chosen.__arrow_c_stream__(None)
    address = _pointer(capsule, b"arrow_array_stream")
    stream = _Stream.from_address(address)
    whole = _Array()
    if stream.get_next(address, ctypes.byref(whole)) or not whole.release:
        msg = "expected one batch of rows"
        raise RuntimeError(msg)
    try:
        yield {
            name: _column(whole.children[number].contents, kind)
            for number, (name, kind) in enumerate(chosen.schema.items())
        }
    finally:
        _RELEASE(whole.release)(ctypes.byref(whole))


def _column(array: Any, kind: pl.DataType) -> Column:
    rows, begin = array.length, array.offset
    name, width = _TYPES[type(kind)]
    values = _at(array.buffers[1], 8 * width * (begin + rows)).view(name)[width * begin :]
    bits = _ALL_VALID
    if array.null_count and array.buffers[0]:
        bits = _at(array.buffers[0], (begin + rows + 7) // 8)
    return Column(values if width == 1 else values.reshape(rows, width), bits, begin)


def _at(address: int, octets: int) -> NDArray[np.uint8]:
    memory: Any = (ctypes.c_ubyte * octets).from_address(address)
    return np.frombuffer(memory, np.uint8)
