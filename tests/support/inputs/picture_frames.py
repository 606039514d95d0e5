"""Frames of the air picture, read back by their description."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.picture.frames import MAGIC, TYPES

Tables = dict[str, dict[str, NDArray[Any]]]


def decoded(frame: bytes) -> tuple[dict[str, Any], Tables]:
    """Return the header and the tables of a frame."""
    assert frame[:4] == MAGIC
    length = int.from_bytes(frame[4:8], "little")
    header = json.loads(frame[8 : 8 + length])
    tables = {
        name: {
            column: np.frombuffer(frame, TYPES[kind], table["rows"], 8 + length + offset)
            for column, (kind, offset) in table["columns"].items()
        }
        for name, table in header["tables"].items()
    }
    return header, tables
