"""Columns of tables from the fields of models: a field is declared once, in its model."""

import types
import typing
from collections.abc import Collection
from typing import Any

import polars as pl
from pydantic import BaseModel

_KINDS: dict[Any, pl.DataType] = {
    float: pl.Float64(),
    int: pl.Int64(),
    str: pl.String(),
    bool: pl.Boolean(),
}


def table_schema(
    model: type[BaseModel],
    *,
    first: tuple[str, ...] = (),
    without: Collection[str] = (),
    prefix: str = "",
) -> pl.Schema:
    """Return the columns of a table whose rows are a model.

    Parameters
    ----------
    model : type
        The model; its fields are numbers, texts, booleans, or lists of them.
    first : tuple of str, optional
        Fields that come before the others, in this order.
    without : collection of str, optional
        Fields that have no column.
    prefix : str, optional
        Prefix of the names of the columns.

    Returns
    -------
    Schema
        Names and types, in the order of the fields.

    Raises
    ------
    KeyError
        If a field has a type without a column type.
    """
    fields = model.model_fields
    names = [*first, *(name for name in fields if name not in first and name not in without)]
    return pl.Schema({prefix + name: _column_type(fields[name].annotation) for name in names})


def required_columns(model: type[BaseModel], schema: pl.Schema) -> tuple[str, ...]:
    """Return the required columns: fields that cannot be None."""
    return tuple(name for name in schema if not _is_optional(model.model_fields[name].annotation))


def lists_of(schema: pl.Schema) -> pl.Schema:
    """Return the same columns as lists of their values."""
    return pl.Schema({name: pl.List(kind) for name, kind in schema.items()})


def _is_optional(annotation: Any) -> bool:
    return type(None) in typing.get_args(annotation)


def _column_type(annotation: Any) -> pl.DataType:
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        (annotation,) = (part for part in parts if part is not type(None))
        return _column_type(annotation)
    if origin is typing.Annotated:
        return _column_type(parts[0])
    if origin is typing.Literal:
        return _column_type(type(parts[0]))
    if origin is list:
        return pl.List(_column_type(parts[0]))
    return _KINDS[annotation]
