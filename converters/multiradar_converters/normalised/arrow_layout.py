"""Validation of the layout of an Arrow IPC stream before it is read.

Arrow columnar format 1.5, "IPC Streaming Format": messages of 0xFFFFFFFF, the length of the
metadata (int32), the metadata (a flatbuffer `Message`, padded), and the body with the buffers of
the columns; the first message is a `Schema`, the others are `RecordBatch` or `DictionaryBatch`;
a length of 0 ends the stream.

A reader allocates the sizes in the metadata. A message of a kilobyte can declare 2^60 rows, and the
failed allocation aborts the process. So every length that determines an allocation is compared here
with the bytes present.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from multiradar_converters.normalised.flatbuffer import FlatbufferError, Table, unpack

FIELDS_MAX = 64
MESSAGES_MAX = 4096
#: Schemas that are kept for the next message with the same, and their octets.
_KNOWN_MAX, _KNOWN_BYTES_MAX = 64, 16 * 1024

_CONTINUATION = b"\xff\xff\xff\xff"
_LENGTH = struct.Struct("<i")
_SCHEMA, _DICTIONARY_BATCH, _RECORD_BATCH = 1, 2, 3
_NULL, _INTEGER, _FLOAT, _UTF8, _BOOLEAN = 1, 2, 3, 5, 6
_TIMESTAMP, _LARGE_UTF8, _UTF8_VIEW = 10, 20, 24
_VIEW_BYTES = 16
_FLOAT_BYTES = {0: 2, 1: 4, 2: 8}
_TYPE_NAMES = {
    4: "binary",
    7: "decimal",
    8: "date",
    9: "time of day",
    12: "list",
    13: "struct",
    18: "duration",
    19: "binary",
    23: "binary",
}


class ArrowLayoutError(ValueError):
    """The stream contradicts its metadata, or has features that measurements never need."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a schema.

    Attributes
    ----------
    name : str
        Its name.
    kind : int
        Number of its type in the Arrow metadata.
    value_bytes : int
        Bytes of a fixed-width value, of a text offset, or of a dictionary index; 0 for bits.
    dictionary : int or None
        Identifier of its dictionary.
    """

    name: str
    kind: int
    value_bytes: int
    dictionary: int | None


def check_layout(stream: bytes, rows_max: int) -> int:
    """Compare every length in a stream with the bytes present.

    Parameters
    ----------
    stream : bytes
        The stream.
    rows_max : int
        Maximum rows, and maximum entries of a dictionary.

    Returns
    -------
    int
        Number of its rows.

    Raises
    ------
    ArrowLayoutError
        At the first inconsistent length, or at a compressed or nested column.
    """
    try:
        return _check(stream, rows_max)
    except FlatbufferError as error:
        raise ArrowLayoutError(str(error)) from error


def _check(stream: bytes, rows_max: int) -> int:
    columns: Sequence[Column] | None = None
    rows = 0
    for metadata, body in _messages(stream):
        message = Table.root(metadata)
        kind = message.scalar(1, "B")
        header = message.table(2)
        if header is None:
            raise ArrowLayoutError("the message has no header")
        if columns is None:
            if kind != _SCHEMA:
                raise ArrowLayoutError(f"expected the schema first, found a message of type {kind}")
            columns = _columns(metadata)
        elif kind == _RECORD_BATCH:
            rows += _batch(header, body, columns, rows_max - rows)
        elif kind == _DICTIONARY_BATCH:
            _dictionary(header, body, columns, rows_max)
        else:
            raise ArrowLayoutError(f"expected a batch, found a message of type {kind}")
    if columns is None:
        raise ArrowLayoutError("expected a schema, found the end of the stream")
    return rows


def _messages(stream: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = 0
    for _ in range(MESSAGES_MAX):
        if place == len(stream):
            return
        if stream[place : place + 4] != _CONTINUATION:
            raise ArrowLayoutError(f"expected a message at byte {place}, found none")
        length = unpack(_LENGTH, stream, place + 4)
        place += 8
        if length == 0:
            if place != len(stream):
                raise ArrowLayoutError(f"unexpected data after the stream, at byte {place}")
            return
        if not 0 < length <= len(stream) - place:
            left = len(stream) - place
            raise ArrowLayoutError(f"expected {length} bytes of metadata, found {left}")
        metadata = stream[place : place + length]
        place += length
        body_length = Table.root(metadata).scalar(3, "q")
        if not 0 <= body_length <= len(stream) - place:
            left = len(stream) - place
            raise ArrowLayoutError(f"expected a body of {body_length} bytes, found {left}")
        yield metadata, stream[place : place + body_length]
        place += body_length
    raise ArrowLayoutError(f"expected at most {MESSAGES_MAX} messages, found more")


# A sender has the same columns in each message.
def _columns(metadata: bytes) -> Sequence[Column]:
    return _known_columns(metadata) if len(metadata) <= _KNOWN_BYTES_MAX else _schema_of(metadata)


def _schema_of(metadata: bytes) -> Sequence[Column]:
    header = Table.root(metadata).table(2)
    assert header is not None, "the message has a header"
    return tuple(_schema(header))


_known_columns = lru_cache(maxsize=_KNOWN_MAX)(_schema_of)


def _schema(header: Table) -> list[Column]:
    if header.scalar(0, "h") != 0:
        raise ArrowLayoutError("expected little-endian columns, found big-endian")
    columns: list[Column] = []
    for field in header.tables(1):
        if len(columns) == FIELDS_MAX:
            raise ArrowLayoutError(f"expected at most {FIELDS_MAX} columns, found more")
        columns.append(_column(field))
    names = [column.name for column in columns]
    for name in names:
        if names.count(name) > 1:
            raise ArrowLayoutError(f"expected each column once, found {name[:60]!r} twice")
    return columns


def _column(field: Table) -> Column:
    name = field.text(0)
    kind = field.scalar(2, "B")
    form = field.table(3)
    if form is None or any(True for _ in field.tables(5)):
        raise ArrowLayoutError(
            f"column {name[:60]!r}: expected a flat type, found a nested type or none"
        )
    encoding = field.table(4)
    if encoding is None:
        return Column(name, kind, _value_bytes(name, kind, form), None)
    if kind not in (_UTF8, _LARGE_UTF8, _UTF8_VIEW):
        raise ArrowLayoutError(f"column {name[:60]!r}: expected a dictionary of text values")
    index = encoding.table(1)
    index_bytes = 4 if index is None else index.scalar(0, "i") // 8
    if index_bytes not in (1, 2, 4, 8):
        raise ArrowLayoutError(f"column {name[:60]!r}: expected indices of 1 to 8 bytes")
    return Column(name, kind, index_bytes, encoding.scalar(0, "q"))


def _value_bytes(name: str, kind: int, form: Table) -> int:
    widths = {
        _NULL: 0,
        _BOOLEAN: 0,
        _UTF8: 4,
        _LARGE_UTF8: 8,
        _UTF8_VIEW: _VIEW_BYTES,
        _TIMESTAMP: 8,
    }
    if kind == _INTEGER:
        width = form.scalar(0, "i") // 8
    elif kind == _FLOAT:
        width = _FLOAT_BYTES.get(form.scalar(0, "h"), -1)
        if name == "time_s" and 0 < width < 8:
            # Single precision counts Unix times in steps of 128 s.
            found = f"float{8 * width}"
            raise ArrowLayoutError(f"column 'time_s': expected float64 or integers, was {found}")
    else:
        width = widths.get(kind, -1)
    if width < 0 or (kind == _INTEGER and width not in (1, 2, 4, 8)):
        found = _TYPE_NAMES.get(kind, f"type {kind}")
        expected = "a number, boolean, text or time stamp"
        raise ArrowLayoutError(f"column {name[:60]!r}: expected {expected}, was {found}")
    return width


def _dictionary(header: Table, body: bytes, columns: Sequence[Column], rows_max: int) -> None:
    number = header.scalar(0, "q")
    data = header.table(1)
    if data is None:
        raise ArrowLayoutError("the dictionary has no values")
    for column in columns:
        if column.dictionary == number:
            width = {_UTF8: 4, _LARGE_UTF8: 8, _UTF8_VIEW: _VIEW_BYTES}[column.kind]
            _batch(data, body, [Column(column.name, column.kind, width, None)], rows_max)


def _batch(header: Table, body: bytes, columns: Sequence[Column], rows_max: int) -> int:
    rows = header.scalar(0, "q")
    if not 0 <= rows <= rows_max:
        raise ArrowLayoutError(f"expected at most {rows_max} rows, found {rows}")
    if header.table(3) is not None:
        raise ArrowLayoutError("expected uncompressed buffers")
    nodes = header.structs(1, "qq")
    if len(nodes) != len(columns):
        raise ArrowLayoutError(f"expected {len(columns)} columns in the batch, found {len(nodes)}")
    buffers = _Buffers(header.structs(2, "qq"), header.structs(4, "q"), body)
    for column, (length, null_count) in zip(columns, nodes, strict=True):
        if length != rows or not 0 <= null_count <= rows:
            msg = f"expected {rows} values, found {length}, of which {null_count} null"
            raise ArrowLayoutError(f"column {column.name[:60]!r}: {msg}")
        buffers.check(column, rows, null_count)
    buffers.check_all_used()
    return rows


class _Buffers:
    """The buffers of a batch, in the order of its columns."""

    def __init__(
        self,
        places: list[tuple[int, ...]],
        variadic: list[tuple[int, ...]],
        body: bytes,
    ) -> None:
        for offset, length in places:
            if offset < 0 or length < 0 or offset + length > len(body):
                msg = (
                    f"expected a buffer within {len(body)} bytes, found {length} bytes at {offset}"
                )
                raise ArrowLayoutError(msg)
        self._places = iter(places)
        self._variadic = iter(variadic)
        self._body = body

    def check(self, column: Column, rows: int, null_count: int) -> None:
        if column.kind == _NULL and column.dictionary is None:
            return
        self._next_buffer(column, (rows + 7) // 8 if null_count else 0)
        if column.dictionary is not None or column.kind in (_INTEGER, _FLOAT, _TIMESTAMP):
            self._next_buffer(column, rows * column.value_bytes)
        elif column.kind == _BOOLEAN:
            self._next_buffer(column, (rows + 7) // 8)
        elif column.kind == _UTF8_VIEW:
            self._check_views(column, rows)
        else:
            self._check_offsets(column, rows)

    def check_all_used(self) -> None:
        if next(self._places, None) is not None or next(self._variadic, None) is not None:
            raise ArrowLayoutError("expected only the buffers of the columns, found more")

    def _next_buffer(self, column: Column, least: int) -> bytes:
        place = next(self._places, None)
        if place is None:
            raise ArrowLayoutError(f"column {column.name[:60]!r}: missing buffer")
        offset, length = place
        if length < least:
            msg = f"expected a buffer of {least} bytes, found {length}"
            raise ArrowLayoutError(f"column {column.name[:60]!r}: {msg}")
        return self._body[offset : offset + length]

    def _check_offsets(self, column: Column, rows: int) -> None:
        buffer = self._next_buffer(column, (rows + 1) * column.value_bytes if rows else 0)
        form = np.dtype("<i4" if column.kind == _UTF8 else "<i8")
        offsets = np.frombuffer(buffer, form, min(rows + 1, len(buffer) // form.itemsize))
        data = self._next_buffer(column, 0)
        if len(offsets) == 0:
            return
        if offsets[0] < 0 or offsets[-1] > len(data) or np.any(offsets[1:] < offsets[:-1]):
            msg = "expected ascending text offsets"
            raise ArrowLayoutError(f"column {column.name[:60]!r}: {msg}")

    def _check_views(self, column: Column, rows: int) -> None:
        self._next_buffer(column, rows * _VIEW_BYTES)
        count = next(self._variadic, (-1,))[0]
        if not 0 <= count <= len(self._body):
            msg = f"number of text buffers: expected 0 to {len(self._body)}, was {count}"
            raise ArrowLayoutError(f"column {column.name[:60]!r}: {msg}")
        for _ in range(count):
            self._next_buffer(column, 0)
