"""Validation errors as a code and a message of the form "expected …, was …"."""

from collections.abc import Mapping
from typing import Any

from multiradar_schemas.documents.names import shown, time_unit
from multiradar_schemas.reject import RejectCode

#: Type of errors whose message is complete.
SENTENCE_ERROR = "sentence"

#: Type of errors of a missing field that the kind of a table requires.
ABSENT_ERROR = "absent"

_CODES = {
    "missing": RejectCode.MISSING_FIELD,
    "union_tag_not_found": RejectCode.MISSING_FIELD,
    "one_time": RejectCode.MISSING_FIELD,
    "whole_source": RejectCode.MISSING_FIELD,
    "many_times": RejectCode.UNKNOWN_FIELD,
    "extra_forbidden": RejectCode.UNKNOWN_FIELD,
    "union_tag_invalid": RejectCode.UNKNOWN_KIND,
    "finite_number": RejectCode.NON_FINITE,
    "string_unicode": RejectCode.ENCODING,
    "json_invalid": RejectCode.MALFORMED_JSON,
}
_OUT_OF_RANGE = frozenset(
    {
        "greater_than",
        "greater_than_equal",
        "less_than",
        "less_than_equal",
        "string_pattern_mismatch",
        "string_too_long",
        "string_too_short",
        "too_short",
        "too_long",
        "literal_error",
        "enum",
        "iso_8601",
        "int_parsing_size",
        "value_error",
        SENTENCE_ERROR,
    }
)
_NUMBER_TYPES = frozenset({"float_type", "int_type", "float_parsing", "int_parsing"})
_TYPES = _NUMBER_TYPES | {"string_type"}
# Messages of errors of a whole row, which do not quote the row.
_ONE_TIME = "expected exactly one of time_s, time_ns and time, was "
_SENTENCES = {
    "union_tag_not_found": "kind: missing; expected a value",
    "one_time": f"{_ONE_TIME}none",
    "many_times": f"{_ONE_TIME}more than one",
    "whole_source": "{missing}: missing; expected all of {fields} or none",
}
_TIME = ("time_s",)
_BOUNDS = ("greater than", "less than")


def explain(details: Mapping[str, Any]) -> tuple[RejectCode, str]:
    """Return the stable code and the message of a validation error.

    Parameters
    ----------
    details : mapping
        An element of `ValidationError.errors()`.

    Returns
    -------
    RejectCode
        The stable code.
    str
        A message of the form "field: expected …, was …".
    """
    kind, value = str(details["type"]), details.get("input")
    code, place = _code(kind, value), details["loc"]
    hint = time_unit(value) if code is RejectCode.OUT_OF_RANGE and place[-1:] == _TIME else ""
    return code, f"{location_text(place)}{reason_of(details)}{hint}"


def reason_of(details: Mapping[str, Any]) -> str:
    """Return the message of an error without its location; see `explain`."""
    kind = str(details["type"])
    value = details.get("input")
    if kind == "missing" or (value is None and kind in _TYPES):
        return "missing; expected a value" if kind == "missing" else "expected a value, was null"
    if kind == "extra_forbidden":
        return f"unknown field, was {shown(value)}"
    if kind == SENTENCE_ERROR:
        return str(details["msg"])
    return _sentence(kind, details, value)


def location_text(location: tuple[int | str, ...]) -> str:
    """Return a location as `sensor[2].bias.range_gain: `; empty at the top level."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{shown(part)[1:-1]}"
    return f"{path.removeprefix('.')}: " if path else ""


def _code(kind: str, value: object) -> RejectCode:
    if value is None and kind in _TYPES:
        return RejectCode.MISSING_FIELD
    if kind in _NUMBER_TYPES and isinstance(value, str):
        return RejectCode.NOT_A_NUMBER
    if kind in _OUT_OF_RANGE:
        return RejectCode.OUT_OF_RANGE
    return _CODES.get(kind, RejectCode.WRONG_TYPE)


def _sentence(kind: str, details: Mapping[str, Any], value: object) -> str:
    context = details.get("ctx", {})
    if kind == "union_tag_invalid":
        return f"kind: expected one of {context['expected_tags']}, was {_tag(value)}"
    if kind == "string_pattern_mismatch":
        return f"expected text of the form {context['pattern']}, was {shown(value)}"
    if kind in _SENTENCES:
        return _SENTENCES[kind].format(**context)
    message = str(details["msg"])
    for opening in ("Input should be ", "Value error, expected "):
        if message.startswith(opening):
            expected = message.removeprefix(opening)
            article = "a value " if expected.startswith(_BOUNDS) else ""
            return f"expected {article}{expected}, was {shown(value)}"
    return f"{message[:1].lower()}{message[1:]}, was {shown(value)}"


def _tag(value: object) -> str:
    return shown(value.get("kind") if isinstance(value, dict) else value)
