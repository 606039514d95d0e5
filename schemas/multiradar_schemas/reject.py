"""Rejected records: location, reason and content."""

from enum import StrEnum
from typing import Annotated, Self

from pydantic import Field, model_validator

from multiradar_schemas.base import Record, described

#: What a range beyond range_max_m is expected to be; and the reason of an ASTERIX record of an
#: unknown source, before its SAC and SIC. The diagnosis recognises both.
INSTRUMENTED_RANGE = "a range within the instrumented range of the sensor"
UNKNOWN_SOURCE = "no sensor in the sensors file has this SAC and SIC: "


class RejectCode(StrEnum):
    """Stable codes of rejects; each is documented in `docs/reference/fields.md`."""

    MALFORMED_LINE = "MALFORMED_LINE"
    WRONG_FIELD_COUNT = "WRONG_FIELD_COUNT"
    NOT_A_NUMBER = "NOT_A_NUMBER"
    NON_FINITE = "NON_FINITE"
    OUT_OF_RANGE = "OUT_OF_RANGE"
    MISSING_FIELD = "MISSING_FIELD"
    UNKNOWN_FIELD = "UNKNOWN_FIELD"
    WRONG_TYPE = "WRONG_TYPE"
    DUPLICATE_KEY = "DUPLICATE_KEY"
    TRUNCATED = "TRUNCATED"
    ENCODING = "ENCODING"
    UNKNOWN_SENSOR = "UNKNOWN_SENSOR"
    SENSOR_DISABLED = "SENSOR_DISABLED"
    SENSOR_NOT_ALLOWED = "SENSOR_NOT_ALLOWED"
    UNKNOWN_KIND = "UNKNOWN_KIND"
    TIME_LATE = "TIME_LATE"
    TIME_FUTURE = "TIME_FUTURE"
    RATE_EXCEEDED = "RATE_EXCEEDED"
    DUPLICATE = "DUPLICATE"
    MALFORMED_JSON = "MALFORMED_JSON"
    MALFORMED_ARROW = "MALFORMED_ARROW"
    MALFORMED_BLOCK = "MALFORMED_BLOCK"
    TOO_LARGE = "TOO_LARGE"


#: Meaning of each code.
CODE_MEANINGS: dict[RejectCode, str] = {
    RejectCode.MALFORMED_LINE: "A line that does not match the format of its file.",
    RejectCode.WRONG_FIELD_COUNT: "A line with more or fewer fields than its profile defines.",
    RejectCode.NOT_A_NUMBER: "Text instead of a number.",
    RejectCode.NON_FINITE: "NaN or infinity.",
    RejectCode.OUT_OF_RANGE: "A value outside its physical or formal bounds.",
    RejectCode.MISSING_FIELD: "A required value of this kind of measurement is absent.",
    RejectCode.UNKNOWN_FIELD: "A field that this kind of measurement does not have.",
    RejectCode.WRONG_TYPE: "A value of the wrong type, such as `true` instead of a number.",
    RejectCode.DUPLICATE_KEY: "A JSON object with a repeated key.",
    RejectCode.TRUNCATED: "The input ends in the middle of a record.",
    RejectCode.ENCODING: "Bytes that are not text in the declared encoding.",
    RejectCode.UNKNOWN_SENSOR: "A sensor that is not in the sensors file.",
    RejectCode.SENSOR_DISABLED: "A sensor that is disabled (`enabled = false`).",
    RejectCode.SENSOR_NOT_ALLOWED: "A sensor for which this client may not send measurements.",
    RejectCode.UNKNOWN_KIND: "A kind of measurement that does not exist, "
    "or that its sensor does not provide.",
    RejectCode.TIME_LATE: "Older than the reorder horizon allows.",
    RejectCode.TIME_FUTURE: "Too far ahead of the data time.",
    RejectCode.RATE_EXCEEDED: "Above the maximum rate of the sensor (`plots_per_scan_max`).",
    RejectCode.DUPLICATE: "Already ingested.",
    RejectCode.MALFORMED_JSON: "Not JSON, or not of the required structure.",
    RejectCode.MALFORMED_ARROW: "Not an Arrow IPC stream, or columns of the wrong type.",
    RejectCode.MALFORMED_BLOCK: "Octets that are not an ASTERIX data block, or a data block "
    "that does not match its category and edition.",
    RejectCode.TOO_LARGE: "Larger than a configured limit.",
}

_LINE = described(
    "Number of the line, from 1", unit="line", source="reader", absent="binary or columnar input"
)
_OFFSET = described(
    "Offset of the first byte, or index of the row in tables, from 0",
    unit="byte",
    source="reader",
    absent="text input, which has `line`",
)


class Reject(Record):
    """A line of `rejects.ndjson`; every rejected record has one."""

    file: Annotated[str, described("Name of the input", unit="text", source="reader")]
    line: Annotated[int | None, Field(ge=1), _LINE] = None
    offset: Annotated[int | None, Field(ge=0), _OFFSET] = None
    reason: Annotated[str, described("Human-readable reason", unit="text", source="reader")]
    code: Annotated[RejectCode, described("Stable code", unit="code", source="reader")]
    raw: Annotated[str, described("Original content, unchanged", unit="text", source="input")]

    @model_validator(mode="after")
    def _one_location(self) -> Self:
        if (self.line is None) == (self.offset is None):
            msg = "expected exactly one of line and offset"
            raise ValueError(msg)
        return self
