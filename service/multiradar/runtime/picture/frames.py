"""Binary frames of columns, which a browser reads as typed arrays without parsing.

A frame is the text `MRP1`, the length of a header (4 octets, little endian), the header in JSON
(UTF-8, padded with spaces) and the columns, little endian. The header lists under `tables`, for
each table, the number of rows and for each column its type (`f8`, `f4`, `i4`, `i1`) and its offset
in octets behind the header. Header and columns begin at multiples of 8 octets.
"""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"MRP1"
#: Types of columns.
TYPES = {"f8": "<f8", "f4": "<f4", "i4": "<i4", "i1": "<i1"}
_ALIGNMENT = 8
_START = len(MAGIC) + 4

Columns = Mapping[str, NDArray[Any]]


def encoded(members: Mapping[str, object], tables: Mapping[str, Columns]) -> bytes:
    """Return a frame.

    Parameters
    ----------
    members : mapping
        Further members of the header; finite numbers, texts, lists and mappings.
    tables : mapping of mapping of (n,) ndarray
        Columns of each table, of types in `TYPES`.
    """
    described: dict[str, object] = {}
    parts: list[bytes] = []
    offset = 0
    for name, columns in tables.items():
        placed = {}
        rows = 0
        for column, values in columns.items():
            rows = len(values)
            kind = f"{values.dtype.kind}{values.dtype.itemsize}"
            part = np.ascontiguousarray(values, TYPES[kind]).tobytes()
            placed[column] = [kind, offset]
            parts.append(_padded(part, b"\0"))
            offset += len(parts[-1])
        described[name] = {"rows": rows, "columns": placed}
    text = json.dumps({**members, "tables": described}, allow_nan=False, separators=(",", ":"))
    header = text.encode()
    header += b" " * (-(_START + len(header)) % _ALIGNMENT)
    return b"".join([MAGIC, len(header).to_bytes(4, "little"), header, *parts])


def _padded(part: bytes, filler: bytes) -> bytes:
    return part + filler * (-len(part) % _ALIGNMENT)
