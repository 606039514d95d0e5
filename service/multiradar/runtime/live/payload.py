"""Encoding of measurements in the journal: an Arrow IPC stream."""

import io

import polars as pl

from multiradar_schemas.measurements.columns import complete
from multiradar_schemas.measurements.directions import without_empty_columns


def encode_rows(frame: pl.DataFrame) -> bytes:
    """Return measurements as an Arrow IPC stream; empty for no rows."""
    if not len(frame):
        return b""
    buffer = io.BytesIO()
    without_empty_columns(complete(frame)).rechunk().write_ipc_stream(buffer)
    return buffer.getvalue()


def decode_rows(payload: bytes) -> pl.DataFrame:
    """Return the measurements of an Arrow IPC stream."""
    return pl.read_ipc_stream(io.BytesIO(payload))
