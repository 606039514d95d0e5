"""Tables of the core: dataclasses whose fields are columns, and the same rows as structured arrays.

The type of a column is declared once, in the annotation of its field.
"""

from collections.abc import Collection, Sequence
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

Table = TypeVar("Table")


@cache
def column_types(table: type[Any]) -> dict[str, type[np.generic]]:
    """Return the columns of a table with their types.

    Parameters
    ----------
    table : type
        A dataclass; fields that are not annotated as `NDArray[...]` are no columns.

    Returns
    -------
    dict
        Types by name, in the order of the fields.
    """
    found = ((field.name, _element_type(field.type)) for field in fields(table))
    return {name: kind for name, kind in found if kind is not None}


# `NDArray` is an alias of `ndarray` up to numpy 2.4, and a type of its own from 2.5 on.
def _element_type(annotation: Any) -> type[np.generic] | None:
    parameters = get_args(annotation)
    if get_origin(annotation) is np.ndarray:
        parameters = get_args(parameters[1])
    elif get_origin(annotation) is not NDArray:
        return None
    kind: type[np.generic] = parameters[0]
    return kind


def empty_columns(table: type) -> dict[str, NDArray[Any]]:
    """Return the columns of a table without rows.

    Parameters
    ----------
    table : type
        A dataclass of columns.

    Returns
    -------
    dict
        Arrays of length 0, by name.
    """
    return {name: np.empty(0, kind) for name, kind in column_types(table).items()}


def joined_columns(table: type, parts: Sequence[Any]) -> dict[str, NDArray[Any]]:
    """Return the columns of all parts, one part after the other.

    Parameters
    ----------
    table : type
        A dataclass of columns.
    parts : sequence
        Tables of this type, or none.

    Returns
    -------
    dict
        Arrays by name.
    """
    if not parts:
        return empty_columns(table)
    return {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in column_types(table)
    }


def row_type(table: type, names: Collection[str] | None = None) -> np.dtype[np.void]:
    """Return the structured type of the rows of a table.

    Parameters
    ----------
    table : type
        A dataclass of columns.
    names : collection of str, optional
        The columns, in this order; by default all.

    Returns
    -------
    dtype
        A field for each column.
    """
    types = column_types(table)
    return np.dtype([(name, types[name]) for name in (types if names is None else names)])


def rows_of(table: object, kind: np.dtype[np.void] | None = None) -> NDArray[np.void]:
    """Return a table as rows.

    Parameters
    ----------
    table : object
        A dataclass of columns.
    kind : dtype, optional
        Columns and their order, as given by `row_type`; by default all.

    Returns
    -------
    (n,) ndarray
        A copy.
    """
    chosen = row_type(type(table)) if kind is None else kind
    names = chosen.names or ()
    rows = np.empty(len(getattr(table, names[0])), chosen)
    for name in names:
        rows[name] = getattr(table, name)
    return rows


def table_of(table: type[Table], rows: NDArray[np.void]) -> Table:
    """Return rows as a table.

    Parameters
    ----------
    table : type
        A dataclass of columns.
    rows : (n,) ndarray
        With a field for each column.

    Returns
    -------
    table
        A copy, each column contiguous.
    """
    names = row_type(table).names or ()
    return table(**{name: np.ascontiguousarray(rows[name]) for name in names})
