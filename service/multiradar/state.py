"""State of objects as a snapshot carries it: declared fields, and one codec for all of them.

A class with state declares its fields and their types in `STATE`. What it does not declare is given
by its parameters, or computed again. Nothing else is stored, and nothing is executed when a state
is restored: a type that is not declared cannot occur.

==========================================  ========================================
Declared type                               Stored as
==========================================  ========================================
`int`, `float`, `bool`, `str`               itself
`bytes`, arrays of numbers or of rows       an array
`X | None`                                  nothing, or X
`list`, `deque`, `set`, `tuple`             their items, with the bound of a deque
`dict`, `OrderedDict`, `Counter`            their items, in their order
named tuples and dataclasses                their fields
a class with `STATE`                        its declared fields
==========================================  ========================================
"""

import dataclasses
from collections import Counter, OrderedDict, deque
from collections.abc import Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Any, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError

#: Declared types by name of the field.
Fields = Mapping[str, Any]

_NUMBERS: dict[type, tuple[type, ...]] = {
    bool: (bool, np.bool_),
    int: (int, np.integer),
    float: (float, int, np.floating),
    str: (str,),
}
_LISTS = (list, set, tuple, deque)
_MAPPINGS = (dict, OrderedDict, Counter)
#: Kinds of arrays: boolean, integer, floating, rows of these.
_ARRAY_KINDS = "biufV"


class CopiedState(NamedTuple):
    """A copy of the state of an object, which later changes of it do not affect."""

    kind: type
    fields: dict[str, Any]


class EncodedState(NamedTuple):
    """A state as values of JSON and arrays.

    Attributes
    ----------
    document : object
        Values of JSON; arrays by their number.
    arrays : list of ndarray
        The arrays, contiguous.
    """

    document: Any
    arrays: list[NDArray[Any]]


def copied_state(holder: Any) -> CopiedState:
    """Return a copy of the state of an object: quick, to be encoded later.

    Parameters
    ----------
    holder : object
        Its class declares `STATE`.
    """
    kind = type(holder)
    return CopiedState(kind, _copied_fields(holder, kind))


def encoded_state(copy: CopiedState, arrays: list[NDArray[Any]] | None = None) -> EncodedState:
    """Return a copied state as values of JSON and arrays.

    Parameters
    ----------
    copy : CopiedState
        The state.
    arrays : list of ndarray, optional
        The arrays are added to these.

    Raises
    ------
    StateError
        If a value is not of the declared type: a bug in multiradar.
    """
    arrays = [] if arrays is None else arrays
    return EncodedState(_encoded(copy.fields, copy.kind, arrays, copy.kind.__name__), arrays)


def restore_state(holder: Any, state: EncodedState) -> None:
    """Set the state of an object, newly built with the same parameters.

    Where its class has a method `restored`, that is called afterwards.

    Parameters
    ----------
    holder : object
        Its class declares `STATE`.
    state : EncodedState
        The state; the object keeps its arrays.

    Raises
    ------
    StateError
        If it is not a state of this class.
    """
    try:
        _restore(holder, state.document, state.arrays)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise StateError(f"{type(holder).__name__}: the state does not match: {error!r}") from error


def carry_state(old: Any, new: Any, change: Any) -> None:
    """Continue the state of an object in one that was built with other parameters.

    Arrays that are larger in the new object keep its values where the old one has none. A class
    whose state needs more than that has a method `carry(old, change)`.

    Parameters
    ----------
    old, new : object
        Of one class, which declares `STATE`; the new one takes the arrays of the old one.
    change : object
        What changed, for the methods `carry`.
    """
    own = getattr(new, "carry", None)
    if own is not None:
        own(old, change)
        return
    for name, kind in type(new).STATE.items():
        before, now = getattr(old, name), getattr(new, name)
        if hasattr(kind, "STATE"):
            carry_state(before, now, change)
        else:
            setattr(new, name, fitted(before, now))


def fitted(old: Any, new: Any) -> Any:
    """Return a value of a state as `carry_state` continues it.

    Parameters
    ----------
    old, new : object
        Arrays, or named tuples of them: the new ones are filled in place. Of all else, and of
        arrays that have grown, the old value is the result.
    """
    if isinstance(new, np.ndarray):
        if any(was > now for was, now in zip(old.shape, new.shape, strict=True)):
            return old
        new[tuple(slice(size) for size in old.shape)] = old
        return new
    if isinstance(new, tuple) and hasattr(new, "_fields"):
        return type(new)(*(fitted(*one) for one in zip(old, new, strict=True)))
    return old


@cache
def layout_of(kind: type) -> str:
    """Return the declared types of a class and of all it contains, as one line for each."""
    lines: dict[str, str] = {}
    _describe(kind, lines)
    return "\n".join(lines.values())


# ---------------------------------------------------------------- copying


def _copied_fields(holder: Any, kind: type) -> dict[str, Any]:
    fields: Fields = kind.STATE  # type: ignore[attr-defined]
    return {name: _copied(getattr(holder, name), declared) for name, declared in fields.items()}


def _copied(value: Any, kind: Any) -> Any:
    if value is None or not _changes(kind):
        return value
    kind = _without_none(kind)
    if _is_array(kind):
        return np.array(value, order="C")
    if hasattr(kind, "STATE"):
        return _copied_fields(value, kind)
    origin, arguments = _parts(kind)
    if origin in _MAPPINGS:
        _, held = _pair(origin, arguments)
        return [(key, _copied(one, held)) for key, one in value.items()]
    kinds = _item_kinds(kind, len(value) if origin in _LISTS else 0)
    items = value if origin in _LISTS else [getattr(value, name) for name in _fields_of(kind)]
    copies = [_copied(one, item) for one, item in zip(items, kinds, strict=True)]
    return (value.maxlen, copies) if origin is deque else copies


# Whether values of a type can change in place; others need no copy.
@cache
def _changes(kind: Any) -> bool:
    kind = _without_none(kind)
    origin = get_origin(kind) or kind
    return (
        _is_array(kind)
        or hasattr(origin, "STATE")
        or origin in _MAPPINGS
        or origin in (list, set, deque)
        or any(_changes(one) for one in get_args(kind) if one is not Ellipsis)
        or any(_changes(one) for one in _fields_of(kind).values())
    )


# ---------------------------------------------------------------- encoding


def _encoded(value: Any, kind: Any, arrays: list[NDArray[Any]], place: str) -> Any:
    if kind is not _without_none(kind):
        if value is None:
            return None
        kind = _without_none(kind)
    if kind in _NUMBERS:
        _require(isinstance(value, _NUMBERS[kind]), kind, value, place)
        return kind(value)
    if kind is bytes:
        _require(isinstance(value, bytes), kind, value, place)
        return _number_of(np.frombuffer(value, np.uint8), arrays)
    if _is_array(kind):
        _require(isinstance(value, np.ndarray), kind, value, place)
        _require(value.dtype.kind in _ARRAY_KINDS and not value.dtype.hasobject, kind, value, place)
        return _number_of(value, arrays)
    return _encoded_items(value, kind, arrays, place)


def _encoded_items(value: Any, kind: Any, arrays: list[NDArray[Any]], place: str) -> Any:
    if hasattr(kind, "STATE"):
        return {
            name: _encoded(value[name], one, arrays, f"{place}.{name}")
            for name, one in kind.STATE.items()
        }
    origin, arguments = _parts(kind)
    if origin in _MAPPINGS:
        key_kind, held = _pair(origin, arguments)
        pairs = value if isinstance(value, list) else value.items()
        return [
            [_encoded(key, key_kind, arrays, place), _encoded(one, held, arrays, place)]
            for key, one in pairs
        ]
    longest = None
    if origin is deque:
        longest, value = value if isinstance(value, tuple) else (value.maxlen, value)
    elif origin is set:
        # It has no order of its own.
        value = sorted(value)
    elif origin not in _LISTS and not isinstance(value, list):
        value = [getattr(value, name) for name in _fields_of(kind)]
    items = [
        _encoded(one, item, arrays, place)
        for one, item in zip(value, _item_kinds(kind, len(value)), strict=True)
    ]
    return [longest, items] if origin is deque else items


def _number_of(array: NDArray[Any], arrays: list[NDArray[Any]]) -> int:
    arrays.append(np.ascontiguousarray(array).reshape(array.shape))
    return len(arrays) - 1


def _require(fits: bool, kind: Any, value: Any, place: str) -> None:  # a condition
    if not fits:
        raise StateError(
            f"{place}: expected {kind}, was {type(value).__name__}; this is a bug in multiradar"
        )


# ---------------------------------------------------------------- restoring


def _restore(holder: Any, document: Any, arrays: list[NDArray[Any]]) -> None:
    fields: Fields = type(holder).STATE
    if document.keys() != fields.keys():
        raise KeyError(f"{type(holder).__name__} has different fields")
    for name, kind in fields.items():
        if hasattr(kind, "STATE"):
            _restore(getattr(holder, name), document[name], arrays)
        else:
            setattr(holder, name, _decoded(document[name], kind, arrays))
    restored = getattr(holder, "restored", None)
    if restored is not None:
        restored()


def _decoded(document: Any, kind: Any, arrays: list[NDArray[Any]]) -> Any:
    if kind is not _without_none(kind):
        return None if document is None else _decoded(document, _without_none(kind), arrays)
    if kind in _NUMBERS:
        return kind(document)
    if kind is bytes:
        return arrays[document].tobytes()
    if _is_array(kind):
        return arrays[document]
    return _decoded_items(document, kind, arrays)


def _decoded_items(document: Any, kind: Any, arrays: list[NDArray[Any]]) -> Any:
    if hasattr(kind, "STATE"):
        # In a mapping or list: built without parameters.
        holder = kind()
        _restore(holder, document, arrays)
        return holder
    origin, arguments = _parts(kind)
    if origin in _MAPPINGS:
        key_kind, held = _pair(origin, arguments)
        return origin(
            {_decoded(key, key_kind, arrays): _decoded(one, held, arrays) for key, one in document}
        )
    longest, items = document if origin is deque else (None, document)
    kinds = _item_kinds(kind, len(items))
    values = [_decoded(one, item, arrays) for one, item in zip(items, kinds, strict=True)]
    if origin is deque:
        return deque(values, longest)
    if origin in _LISTS:
        return origin(values)
    return kind(**dict(zip(_fields_of(kind), values, strict=True)))


# ---------------------------------------------------------------- types


@cache
def _without_none(kind: Any) -> Any:
    if get_origin(kind) not in (Union, UnionType):
        return kind
    (kind,) = (one for one in get_args(kind) if one is not NoneType)
    return kind


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    return get_origin(kind) or kind, get_args(kind)


@cache
def _is_array(kind: Any) -> bool:
    return (get_origin(kind) or kind) is np.ndarray


@cache
def _fields_of(kind: Any) -> dict[str, Any]:
    # Named tuples and dataclasses; empty for all others.
    if dataclasses.is_dataclass(kind):
        names: tuple[str, ...] = tuple(field.name for field in dataclasses.fields(kind))
    else:
        names = getattr(kind, "_fields", ())
    hints = get_type_hints(kind) if names else {}
    return {name: hints[name] for name in names}


# Types of the items of a list or of a tuple, or of the fields of a table.
def _item_kinds(kind: Any, count: int) -> tuple[Any, ...]:
    origin, arguments = _parts(kind)
    if origin not in _LISTS:
        return tuple(_fields_of(kind).values())
    is_fixed = origin is tuple and arguments[-1] is not Ellipsis
    return arguments if is_fixed else arguments[:1] * count


def _pair(origin: Any, arguments: tuple[Any, ...]) -> tuple[Any, Any]:
    key_kind, *held = arguments
    return key_kind, int if origin is Counter else held[0]


def _describe(kind: Any, lines: dict[str, str]) -> None:
    kind = _without_none(kind)
    origin = get_origin(kind) or kind
    fields = origin.STATE if hasattr(origin, "STATE") else _fields_of(kind)
    if fields:
        name = origin.__qualname__
        if name in lines:
            return
        lines[name] = f"{name}: " + ", ".join(f"{one}={held}" for one, held in fields.items())
        for held in fields.values():
            _describe(held, lines)
    elif not _is_array(kind):
        for held in get_args(kind):
            _describe(held, lines)
