"""Defaults and bounds of settings as lines of text, to compare them with the recorded ones."""

from collections.abc import Iterator
from dataclasses import MISSING, fields
from enum import Enum
from typing import TYPE_CHECKING, Any, get_args

from annotated_types import BaseMetadata
from pydantic import BaseModel

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

#: Constraints on values in a JSON schema.
_BOUNDS = (
    "minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum", "minLength", "maxLength",
    "minItems", "maxItems", "pattern", "enum", "const",
)  # fmt: skip
_WITHIN = ("items", "prefixItems", "anyOf", "allOf", "oneOf")


def model_lines(model: type[BaseModel]) -> list[str]:
    """Return a line for each field of a model and of the models in it."""
    return [
        f"{kind.__name__}.{name}: {'; '.join((_default(schema), *_bounds_of(kind, name, schema)))}"
        for kind in dict.fromkeys(_models(model))
        for name, schema in kind.model_json_schema().get("properties", {}).items()
    ]


def dataclass_lines(kind: type["DataclassInstance"]) -> list[str]:
    """Return a line for each field of a dataclass that has a default."""
    return [
        f"{kind.__module__}.{kind.__name__}.{one.name}: {one.default!r}"
        for one in fields(kind)
        if one.default is not MISSING
    ]


def schema_lines(document: dict[str, Any]) -> list[str]:
    """Return a line for each bounded field of a JSON schema and of the models in it."""
    models = {document["title"]: document, **document.get("$defs", {})}
    return [
        f"{model}.{name}: {'; '.join(bounds)}"
        for model, described in models.items()
        for name, schema in described.get("properties", {}).items()
        if (bounds := list(_bounds(schema)))
    ]


def command_lines(command: Any, name: str) -> list[str]:
    """Return a line for each option of a command and of the commands in it."""
    lines = []
    for option in command.params:
        ends = {end: getattr(option, end) for end in ("min", "max")}
        bounds = (f"{end} {value!r}" for end, value in ends.items() if value is not None)
        lines.append(f"{name} {option.opts[0]}: {'; '.join((_shown(option.default), *bounds))}")
    for part, within in sorted(getattr(command, "commands", {}).items()):
        lines += command_lines(within, f"{name} {part}")
    return lines


def parameter_lines(document: dict[str, Any]) -> list[str]:
    """Return a line for each parameter of an OpenAPI document."""
    return [
        f"{verb} {path} {one['name']}: {'; '.join((_default(schema), *_bounds(schema)))}"
        for path, verbs in document["paths"].items()
        for verb, operation in verbs.items()
        for one in operation.get("parameters", ())
        for schema in (one["schema"],)
    ]


def answer_lines(document: dict[str, Any]) -> list[str]:
    """Return a line for each operation of an OpenAPI document with the statuses it may answer."""
    return [
        f"{verb} {path} answers: {', '.join(sorted(operation['responses']))}"
        for path, verbs in document["paths"].items()
        for verb, operation in verbs.items()
    ]


def _models(kind: Any) -> Iterator[type[BaseModel]]:
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
        for field in kind.model_fields.values():
            yield from _models(field.annotation)
    for one in get_args(kind):
        yield from _models(one)


def _default(schema: dict[str, Any]) -> str:
    value = schema.get("default", "no default")
    # The defaults of a section are in separate lines.
    return "a section" if isinstance(value, dict) else repr(value)


def _shown(value: object) -> str:
    return repr(value.value if isinstance(value, Enum) else value)


def _bounds_of(kind: type[BaseModel], name: str, schema: dict[str, Any]) -> list[str]:
    # A schema lacks the bounds beside a custom validator.
    beside = [one for one in kind.model_fields[name].metadata if isinstance(one, BaseMetadata)]
    return list(_bounds(schema)) or [repr(one) for one in beside]


def _bounds(schema: object) -> Iterator[str]:
    if isinstance(schema, list):
        for one in schema:
            yield from _bounds(one)
    elif isinstance(schema, dict):
        yield from (f"{name} {schema[name]!r}" for name in _BOUNDS if name in schema)
        for name in _WITHIN:
            yield from _bounds(schema.get(name))
