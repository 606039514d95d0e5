"""Bodies of requests: bytes and a media type in, a table and rejected rows out."""

from collections.abc import Callable
from dataclasses import dataclass

import polars as pl

from multiradar.errors import RequestError
from multiradar.runtime.live.receipt import RejectedRow
from multiradar_converters.normalised.arrow import parse_arrow
from multiradar_converters.normalised.parsed import Parsed
from multiradar_converters.normalised.text import parse_json, parse_ndjson
from multiradar_schemas.errors import BodyError
from multiradar_schemas.reject import RejectCode


@dataclass(frozen=True, slots=True)
class Decoded:
    """A message: every row of it is either in `frame` or in `rejected`.

    Attributes
    ----------
    frame : DataFrame
        Accepted rows; column `index` is the position of each in the message.
    rejected : tuple of RejectedRow
        Rejected rows.
    """

    frame: pl.DataFrame
    rejected: tuple[RejectedRow, ...]


def decode(media_type: str, body: bytes, rows_max: int) -> Decoded:
    """Read the body of a request.

    Parameters
    ----------
    media_type : str
        One of `MEDIA_TYPES`.
    body : bytes
        The whole body.
    rows_max : int
        Maximum number of measurements.

    Raises
    ------
    RequestError
        400 when the body cannot be read, 413 when it has too many rows; with the reject code.
    """
    try:
        parsed = _PARSERS[media_type](body, rows_max)
    except BodyError as error:
        status = 413 if error.code is RejectCode.TOO_LARGE else 400
        raise RequestError(status, str(error.code), error.reason) from error
    rejected = tuple(
        RejectedRow(row.index, row.code.value, row.reason, row.raw) for row in parsed.rejected
    )
    return Decoded(parsed.frame, rejected)


def _json(body: bytes, rows_max: int) -> Parsed:
    if not body.lstrip(b" \t\r\n").startswith(b"{"):
        return parse_json(body, rows_max=rows_max)
    # One object is an array of one; adding brackets must not make several objects valid.
    parsed = parse_json(b"[" + body + b"]", rows_max=rows_max)
    if len(parsed.frame) + len(parsed.rejected) != 1:
        raise BodyError(RejectCode.MALFORMED_JSON, "expected an array, was a sequence of objects")
    return parsed


def _ndjson(body: bytes, rows_max: int) -> Parsed:
    return parse_ndjson(body, rows_max=rows_max)


def _arrow(body: bytes, rows_max: int) -> Parsed:
    return parse_arrow(body, rows_max=rows_max)


_PARSERS: dict[str, Callable[[bytes, int], Parsed]] = {
    "application/json": _json,
    "application/x-ndjson": _ndjson,
    "application/vnd.apache.arrow.stream": _arrow,
}

#: Supported media types.
MEDIA_TYPES = tuple(_PARSERS)
