"""Query parameters: strict types shared by all routes."""

import re
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any

from fastapi import Path, Query
from pydantic import BeforeValidator
from pydantic.config import JsonDict

from multiradar.access.parameters import NUMBER, number
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN, TIME_MAX_S

# ASCII only: int() of Python also accepts "1_0" and digits of other scripts.
_INTEGER = re.compile(r"[+-]?[0-9]{1,18}")

_ISO_8601_LENGTH_MAX = 40


def integer(text: object) -> int:
    """Return an integer written in plain ASCII decimal notation.

    Raises
    ------
    ValueError
        When it has another form or more than 18 digits.
    """
    if not isinstance(text, str) or _INTEGER.fullmatch(text) is None:
        msg = "expected an integer of at most 18 digits"
        raise ValueError(msg)
    return int(text)


def data_time(text: object) -> float:
    """Return a data time in seconds, given in seconds or in ISO 8601 with an offset.

    Raises
    ------
    ValueError
        When it has another form or is out of range.
    """
    plain = isinstance(text, str) and NUMBER.fullmatch(text) is not None
    time_s = number(text) if plain else _iso_8601(text)
    if not abs(time_s) < TIME_MAX_S:
        msg = f"expected a time within {TIME_MAX_S:g} s of the epoch"
        raise ValueError(msg)
    return time_s


def _iso_8601(text: object) -> float:
    # In a query string an unescaped plus sign is decoded as a blank.
    wrong = "expected seconds, or ISO 8601 with Z or an offset such as 2026-01-31T12:00:00Z"
    if not isinstance(text, str) or len(text) > _ISO_8601_LENGTH_MAX or not text.isascii():
        raise ValueError(wrong)
    try:
        moment = datetime.fromisoformat(text.replace(" ", "+"))
    except ValueError:
        raise ValueError(wrong) from None
    if moment.tzinfo is None:
        raise ValueError(wrong)
    return moment.timestamp()


# The bounds of a parameter stand before these: after a function, they are missing in OpenAPI.
AsInteger = BeforeValidator(integer)
AsTime = BeforeValidator(data_time)

#: Greatest number that `integer` reads.
INTEGER_MOST = 10**18 - 1

# What `data_time` reads.
_TIME_FORMS: JsonDict = {
    "anyOf": [
        {"type": "number", "exclusiveMinimum": -TIME_MAX_S, "exclusiveMaximum": TIME_MAX_S},
        {"type": "string", "format": "date-time"},
    ],
    "examples": [1767182400.0, "2026-01-31T12:00:00Z"],
}


def list_form(names: Sequence[str]) -> JsonDict:
    """Return the form of a comma-separated list of names, for OpenAPI."""
    return {"type": "array", "minItems": 1, "items": {"enum": list(names)}}


def time_query(description: str) -> Any:
    """Return the declaration of a parameter that is a data time."""
    return Query(description=description, json_schema_extra=_TIME_FORMS)


Since = Annotated[
    float | None,
    time_query(
        "Return only rows at or after this data time: seconds, or ISO 8601 with Z or an offset"
    ),
    AsTime,
]
Until = Annotated[
    float | None,
    time_query(
        "Return the last rows at or before this data time instead of the first ones; not together "
        "with `cursor`"
    ),
    AsTime,
]
At = Annotated[
    float | None,
    time_query("A past data time: seconds, or ISO 8601 with Z or an offset"),
    AsTime,
]
Limit = Annotated[
    int,
    Query(ge=1, le=10_000, description="Maximum number of rows per page", examples=[1000]),
    AsInteger,
]
_CURSOR_TEXT = "`next_cursor` of the previous page; keep the other parameters unchanged"
#: Cursors of a list by number, and of a table by time; their content is not an interface.
TrackCursor = Annotated[
    str | None,
    Query(
        max_length=64, description=_CURSOR_TEXT, json_schema_extra={"format": "cursor-by-number"}
    ),
]
TimeCursor = Annotated[
    str | None,
    Query(max_length=64, description=_CURSOR_TEXT, json_schema_extra={"format": "cursor-by-time"}),
]
TrackId = Annotated[
    int,
    Path(
        ge=1,
        le=INTEGER_MOST,
        description="Number of the track, from `track_id`",
        examples=[17],
    ),
    AsInteger,
]
SensorId = Annotated[
    str, Path(pattern=SENSOR_ID_PATTERN, description="Name of the sensor", examples=["41-10"])
]
