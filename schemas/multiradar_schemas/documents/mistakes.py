"""All errors in a configuration file, with their locations.

An error is a message of the form "line 7: sensor 26-10: latitude_deg: expected …, was …".
"""

import types
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from multiradar_schemas.documents.explain import ABSENT_ERROR, location_text, reason_of
from multiradar_schemas.documents.names import shown, unknown, unknown_choice
from multiradar_schemas.documents.toml_lines import Path, line_of

_ABSENT = frozenset({"missing", ABSENT_ERROR})
_OUT_OF_BOUNDS = frozenset(
    {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "int_parsing_size"}
)
_EXPECTED = {
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "string_type": "text",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "dict_type": "a table",
    "model_type": "a table",
    "list_type": "a list",
    "tuple_type": "a list",
    "greater_than": "a number above {gt:.12g}",
    "greater_than_equal": "a number of at least {ge:.12g}",
    "less_than": "a number below {lt:.12g}",
    "less_than_equal": "a number of at most {le:.12g}",
}
_LISTS = frozenset({"list_type", "tuple_type"})
_LENGTHS = frozenset({"too_short", "too_long"})
#: Keys that identify a table of a list in messages.
_NAMES = ("id", "name", "label")
#: Units that are omitted in messages.
_NO_UNITS = frozenset({"", "1", "name", "of the parameter"})


def mistakes_in(
    error: ValidationError,
    model: type[BaseModel],
    values: Mapping[str, Any],
    lines: Mapping[Path, int],
    *,
    key: str = "key",
) -> tuple[str, ...]:
    """Return every error that a model found in a file.

    Parameters
    ----------
    error : ValidationError
        The validation error.
    model : type
        The model.
    values : mapping
        Content of the file.
    lines : mapping of tuple to int
        The lines of the keys; see `multiradar_schemas.documents.toml_lines.key_lines`.
    key : str
        Name of a key in messages.

    Returns
    -------
    tuple of str
        A message for each error, in the order of the lines.
    """
    details = _without_echoes(error.errors(include_url=False))
    if _to_fill_in(details):
        return (_filled_in(details, values, lines),)
    located = [
        (line_of(one["loc"], lines) or 0, _mistake(one, model, values, key)) for one in details
    ]
    return tuple(
        f"line {line}: {sentence}" if line else sentence
        for line, sentence in dict.fromkeys(sorted(located, key=lambda one: one[0]))
    )


def known_keys(model: type[BaseModel], location: Path) -> tuple[str, ...]:
    """Return the keys of the table at a location of a file; empty without a table."""
    field = _field(model, location)
    tables = [model] if not location else [] if field is None else _models(field.annotation)
    return tuple(name for one in tables for name in one.model_fields)


def _mistake(
    details: Mapping[str, Any], model: type[BaseModel], values: Mapping[str, Any], key: str
) -> str:
    location = details["loc"]
    kind, value = details["type"], details.get("input")
    if kind == "extra_forbidden":
        known = known_keys(model, location[:-1])
        return f"{_where(location[:-1], values)}{unknown(key, location[-1], known)}"
    where = _where(location, values)
    if kind in _ABSENT:
        return f"{where}missing{_of_tables(model, location)}"
    if kind == "literal_error" and isinstance(value, str):
        return f"{where}{unknown_choice(value, details['ctx']['expected'])}"
    bounds = _bounds(model, details)
    if bounds:
        return f"{where}expected a number {bounds}, was {shown(value)}"
    return f"{where}{_expected(kind, details)}"


# What a missing list of tables looks like.
def _of_tables(model: type[BaseModel], location: Path) -> str:
    field = _field(model, location)
    if field is None or get_origin(field.annotation) not in {tuple, list}:
        return ""
    if not any(True for _ in _models(field.annotation)):
        return ""
    return f"; write [[{location[-1]}]] before the keys of each {location[-1]}"


def _expected(kind: str, details: Mapping[str, Any]) -> str:
    if kind not in _EXPECTED:
        return reason_of(details)
    expected, value = _EXPECTED[kind].format(**details.get("ctx", {})), details.get("input")
    if kind in _LISTS and isinstance(value, Mapping) and details["loc"]:
        name = details["loc"][-1]
        return f"expected {expected} of tables: write [[{name}]] for [{name}]"
    return f"expected {expected}, was {shown(value)}"


def _without_echoes(details: list[Any]) -> list[Any]:
    # A list with invalid tables is reported as too short as well.
    places = [one["loc"] for one in details]
    return [
        one
        for one in details
        if one["type"] not in _LENGTHS
        or not any(
            len(at) > len(one["loc"]) and at[: len(one["loc"])] == one["loc"] for at in places
        )
    ]


def _bounds(model: type[BaseModel], details: Mapping[str, Any]) -> str:
    # A number out of bounds is most often in another unit.
    location = details["loc"]
    field = _field(model, location) if location and isinstance(location[-1], str) else None
    if field is None or details["type"] not in _OUT_OF_BOUNDS:
        return ""
    limits = {name: getattr(one, name) for one in field.metadata for name in ("ge", "le")
              if getattr(one, name, None) is not None}  # fmt: skip
    if len(limits) < 2:
        return ""
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    unit_text = "" if unit in _NO_UNITS else f" ({unit})"
    return f"from {_number(limits['ge'])} to {_number(limits['le'])}{unit_text}"


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.12g}"


def _field(model: type[BaseModel], location: Path) -> FieldInfo | None:
    # The field of a model at a location of a file; None when there is none.
    found: FieldInfo | None = None
    tables = [model]
    for part in location:
        if isinstance(part, str):
            found = next((one.model_fields[part] for one in tables if part in one.model_fields),
                         None)  # fmt: skip
            tables = [] if found is None else list(_models(found.annotation))
    return found


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    # The models in an annotation: itself, the members of a union, or the elements of a list.
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) in {Union, types.UnionType, tuple, list, Annotated}:
        for one in get_args(annotation):
            yield from _models(one)


def _where(location: Path, values: Mapping[str, Any]) -> str:
    # A table of a list is identified by its name, if it has one, instead of its index.
    path: Path = ()
    found: Any = values
    named = ""
    for part in location:
        found = _within(found, part)
        path = (*path, part)
        name = _name(found) if isinstance(part, int) else None
        if name is not None:
            named += f"{'.'.join(str(one) for one in path[:-1])} {name}: "
            path = ()
    return named + location_text(path)


def _within(found: Any, part: int | str) -> Any:
    if isinstance(found, Mapping):
        return found.get(part)
    if isinstance(found, list | tuple) and isinstance(part, int) and part < len(found):
        return found[part]
    return None


def _name(table: Any) -> str | None:
    if not isinstance(table, Mapping):
        return None
    for key in _NAMES:
        if isinstance(table.get(key), str):
            return shown(table[key])[1:-1]
    for first, second in (("source", "sensor"), ("sac", "sic")):
        if first in table and second in table:
            return f"{shown(table[first])}-{shown(table[second])}"
    return None


# Whether a file lacks only values that `convert` cannot derive from a recording.
def _to_fill_in(details: list[Any]) -> bool:
    return bool(details) and all(one["type"] == ABSENT_ERROR for one in details)


def _filled_in(details: list[Any], values: Mapping[str, Any], lines: Mapping[Path, int]) -> str:
    missing = []
    for line, one in sorted(((line_of(one["loc"], lines) or 0, one) for one in details),
                            key=lambda pair: pair[0]):  # fmt: skip
        what = " ".join(_where(one["loc"], values).replace(": ", " ").split()[1:])
        missing.append(f"{what} (line {line})" if line else what)
    count = f"{len(missing)} field{'' if len(missing) == 1 else 's'}"
    return f"{count} to fill in: {', '.join(missing)}"
