"""Decoding of samples and queries on the measurement keys: encoding, content, sensor of the key."""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass

import polars as pl

from multiradar.errors import PayloadError, RequestError
from multiradar.ingest.bodies import Decoded, decode
from multiradar.ingest.zenoh.keys import is_sensor_id, last_part
from multiradar.runtime.live.receipt import RejectedRow
from multiradar_schemas.reject import RejectCode

ARROW = "application/vnd.apache.arrow.stream"
NDJSON = "application/x-ndjson"
JSON = "application/json"

_MEDIA_TYPES = {
    JSON: JSON,
    "text/json": JSON,
    NDJSON: NDJSON,
    "application/json lines": NDJSON,
    "application/jsonl": NDJSON,
    ARROW: ARROW,
    "application/vnd.apache.arrow": ARROW,
}
#: Encodings of Zenoh when the sender declared none.
_UNDECLARED = frozenset({"", "zenoh/bytes", "zenoh/string", "text/plain"})
_ARROW_START = b"\xff\xff\xff\xff"
#: Last parts of a key for measurements of several sensors.
_ANY_SENSOR = frozenset({"*", "**"})
_NOT_NAMED = str(RejectCode.MISSING_FIELD)


@dataclass(frozen=True, slots=True)
class PayloadBounds:
    """Size limits.

    Attributes
    ----------
    bytes_max : int
        Maximum size of the content.
    rows_max : int
        Maximum number of measurements.
    """

    bytes_max: int
    rows_max: int


def read_payload(key: str, media_type: str, payload: bytes, bounds: PayloadBounds) -> Decoded:
    """Read measurements.

    Parameters
    ----------
    key : str
        Key; its last part names the sensor, or is `*` for several.
    media_type : str
        The encoding declared by the sender.
    payload : bytes
        The content.
    bounds : PayloadBounds
        Size limits.

    Returns
    -------
    Decoded
        Accepted and rejected rows. A row without a sensor gets that of the key; one with another
        sensor is rejected.

    Raises
    ------
    PayloadError
        If the payload cannot be read.
    """
    sensor_id = _sensor_of(key)
    if len(payload) > bounds.bytes_max:
        reason = f"expected at most {bounds.bytes_max} bytes, found {len(payload)}"
        raise PayloadError(RejectCode.TOO_LARGE, reason)
    known_type = _known_type(media_type, payload)
    try:
        decoded = _decoded(known_type, payload, sensor_id, bounds.rows_max)
    except RequestError as error:
        raise PayloadError(error.code, str(error)) from error
    return decoded if sensor_id is None else _of_sensor(decoded, sensor_id)


def _sensor_of(key: str) -> str | None:
    name = last_part(key)
    if name in _ANY_SENSOR:
        return None
    if not is_sensor_id(name):
        reason = f"expected a key ending in a sensor identifier, was {ascii(name)[:80]}"
        raise PayloadError(RejectCode.UNKNOWN_SENSOR, reason)
    return name


def _known_type(media_type: str, payload: bytes) -> str:
    # Zenoh appends a schema after a semicolon.
    named = media_type.partition(";")[0].strip().lower()
    if named in _UNDECLARED:
        return _guessed_type(payload)
    known = _MEDIA_TYPES.get(named)
    if known is None:
        reason = f"expected encoding {JSON}, {NDJSON} or {ARROW}, was {ascii(named)[:80]}"
        raise PayloadError(RejectCode.ENCODING, reason)
    return known


def _guessed_type(payload: bytes) -> str:
    if payload.startswith(_ARROW_START):
        return ARROW
    text = payload.strip()
    return NDJSON if text.startswith(b"{") and b"\n" in text else JSON


def _decoded(media_type: str, payload: bytes, sensor_id: str | None, rows_max: int) -> Decoded:
    try:
        decoded = decode(media_type, payload, rows_max)
    except RequestError as error:
        if media_type != ARROW or sensor_id is None or error.code != _NOT_NAMED:
            raise
        # A column is missing: if it is that of the sensor, the second reading succeeds.
        return decode(media_type, _with_sensor_column(payload, sensor_id), rows_max)
    if sensor_id is None or not any(row.code == _NOT_NAMED for row in decoded.rejected):
        return decoded
    return _named(decoded, sensor_id)


def _with_sensor_column(payload: bytes, sensor_id: str) -> bytes:
    frame = pl.read_ipc_stream(io.BytesIO(payload), use_pyarrow=False)
    if "sensor_id" not in frame.columns:
        frame = frame.with_columns(pl.lit(sensor_id).alias("sensor_id"))
    buffer = io.BytesIO()
    frame.write_ipc_stream(buffer)
    return buffer.getvalue()


def _named(decoded: Decoded, sensor_id: str) -> Decoded:
    """Read the rows without a sensor again, with that of the key."""
    rewritten = [(row, _renamed(row.raw, sensor_id)) for row in decoded.rejected]
    again = [(row, text) for row, text in rewritten if text is not None and row.code == _NOT_NAMED]
    if not again:
        return decoded
    second = decode(JSON, b"[" + ",".join(text for _, text in again).encode() + b"]", len(again))
    index = [row.index for row, _ in again]
    accepted = second.frame.with_columns(
        pl.Series("index", [index[at] for at in second.frame["index"].to_list()], pl.UInt32)
    )
    rejected = [
        RejectedRow(index[row.index], row.code, row.reason, row.raw) for row in second.rejected
    ]
    reread = set(index)
    kept = [row for row in decoded.rejected if row.index not in reread]
    frame = pl.concat([decoded.frame, accepted]).sort("index")
    return Decoded(frame, _ordered([*kept, *rejected]))


def _renamed(raw: str, sensor_id: str) -> str | None:
    """Return the JSON of a row with a sensor added, or None when it has one or is no object."""
    try:
        row = json.loads(raw)
    except (ValueError, RecursionError):
        return None
    if not isinstance(row, dict):
        return None
    if "sensor_id" not in row:
        # The rest of the text is unchanged, so that other errors in it are found again.
        rest = raw.lstrip()[1:]
        comma = "" if rest.lstrip().startswith("}") else ","
        return f'{{"sensor_id":"{sensor_id}"{comma}{rest}'
    if row["sensor_id"] is None and raw.count('"sensor_id"') == 1:
        return json.dumps({**row, "sensor_id": sensor_id})
    return None


def _of_sensor(decoded: Decoded, sensor_id: str) -> Decoded:
    foreign = decoded.frame.filter(pl.col("sensor_id") != sensor_id)
    if foreign.is_empty():
        return decoded
    rejected = [
        RejectedRow(
            index=int(row["index"]),
            code=str(RejectCode.UNKNOWN_SENSOR),
            reason=f"expected {sensor_id}, the sensor in the key, was {row['sensor_id']}",
            raw=json.dumps({name: value for name, value in row.items() if name != "index"}),
        )
        for row in foreign.iter_rows(named=True)
    ]
    own = decoded.frame.filter(pl.col("sensor_id") == sensor_id)
    return Decoded(own, _ordered([*decoded.rejected, *rejected]))


def _ordered(rows: Sequence[RejectedRow]) -> tuple[RejectedRow, ...]:
    return tuple(sorted(rows, key=lambda row: row.index))
