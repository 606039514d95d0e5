"""Reading of flatbuffer tables, the format of Arrow metadata, with every offset checked.

A table begins with a signed offset back to its vtable. The vtable (16-bit words) contains its own
length, the length of the table, and for each slot the offset of the value from the table, 0 if
absent.
"""

import struct
from collections.abc import Iterator

_SIGNED_32 = struct.Struct("<i")
_UNSIGNED_32 = struct.Struct("<I")
_UNSIGNED_16 = struct.Struct("<H")
_VTABLE_HEADER = 4


class FlatbufferError(ValueError):
    """An offset of a flatbuffer points outside it."""


class Table:
    """A table inside a buffer; slots are numbered from 0."""

    def __init__(self, buffer: bytes, place: int) -> None:
        self._buffer = buffer
        self._place = place
        self._vtable = place - unpack(_SIGNED_32, buffer, place)
        self._vtable_size = unpack(_UNSIGNED_16, buffer, self._vtable)

    @classmethod
    def root(cls, buffer: bytes) -> "Table":
        """Return the table that the pointer at the beginning of a buffer refers to."""
        return cls(buffer, unpack(_UNSIGNED_32, buffer, 0))

    def scalar(self, slot: int, form: str, default: int = 0) -> int:
        """Return an integer of a `struct` format, or its default when absent."""
        place = self._slot(slot)
        return default if place is None else unpack(struct.Struct(f"<{form}"), self._buffer, place)

    def table(self, slot: int) -> "Table | None":
        """Return the table at a slot."""
        place = self._target(slot)
        return None if place is None else Table(self._buffer, place)

    def text(self, slot: int) -> str:
        """Return the text at a slot, empty when absent."""
        count, place = self._vector(slot, 1)
        try:
            return self._buffer[place : place + count].decode("utf-8")
        except UnicodeDecodeError as error:
            raise FlatbufferError("the metadata are not valid UTF-8") from error

    def tables(self, slot: int) -> Iterator["Table"]:
        """Yield the tables of a vector."""
        count, place = self._vector(slot, 4)
        for entry in range(place, place + 4 * count, 4):
            yield Table(self._buffer, entry + unpack(_UNSIGNED_32, self._buffer, entry))

    def structs(self, slot: int, form: str) -> list[tuple[int, ...]]:
        """Return a vector of structs of integers of a `struct` format."""
        layout = struct.Struct(f"<{form}")
        count, place = self._vector(slot, layout.size)
        return list(layout.iter_unpack(self._buffer[place : place + count * layout.size]))

    def _slot(self, slot: int) -> int | None:
        entry = _VTABLE_HEADER + 2 * slot
        if entry + 2 > self._vtable_size:
            return None
        offset = unpack(_UNSIGNED_16, self._buffer, self._vtable + entry)
        return self._place + offset if offset else None

    def _target(self, slot: int) -> int | None:
        place = self._slot(slot)
        return None if place is None else place + unpack(_UNSIGNED_32, self._buffer, place)

    def _vector(self, slot: int, size: int) -> tuple[int, int]:
        place = self._target(slot)
        if place is None:
            return 0, 0
        count = unpack(_UNSIGNED_32, self._buffer, place)
        if place + 4 + count * size > len(self._buffer):
            msg = f"a vector of {count} entries exceeds the metadata"
            raise FlatbufferError(msg)
        return count, place + 4


def unpack(layout: struct.Struct, buffer: bytes, place: int) -> int:
    """Return the integer at an offset of a buffer.

    Raises
    ------
    FlatbufferError
        When the offset is outside.
    """
    if place < 0 or place + layout.size > len(buffer):
        msg = f"expected an offset within {len(buffer)} bytes, found {place}"
        raise FlatbufferError(msg)
    value: int = layout.unpack_from(buffer, place)[0]
    return value
