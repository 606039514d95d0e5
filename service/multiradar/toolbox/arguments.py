"""Types of arguments, checked against the annotations of a function before it starts."""

import functools
import inspect
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin

from multiradar.errors import ArgumentError
from multiradar_schemas.documents.names import did_you_mean

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_WORDS: dict[Any, str] = {
    Path: "a path",
    str: "text",
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    Callable: "a callable",
    tuple: "two numbers",
    Mapping: "a mapping",
}
_SEVERAL = (Iterable, Collection, Sequence)
_WAS_MAX = 60


def typed(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Return a function that checks the types of its arguments.

    Parameters
    ----------
    function : callable
        Annotations in quotes name types that are imported for the type checker only: the function
        checks these arguments.

    Returns
    -------
    callable
        It raises `ArgumentError`. A text where several are expected is one of them, not its
        letters.
    """
    signature = inspect.signature(function)
    takes_more = any(one.kind is one.VAR_KEYWORD for one in signature.parameters.values())

    @functools.wraps(function)
    def checked(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        if not takes_more:
            for name in kwargs:
                if name not in signature.parameters:
                    raise unknown_argument(name, signature.parameters)
        bound = signature.bind(*args, **kwargs)
        for name, value in bound.arguments.items():
            parameter = signature.parameters[name]
            if parameter.kind is parameter.VAR_KEYWORD:
                value.update(checked_options(value, *get_args(parameter.annotation)[:1]))
            else:
                several = parameter.kind is parameter.VAR_POSITIONAL
                kind = Sequence[parameter.annotation] if several else parameter.annotation  # type: ignore[name-defined]  # of the signature
                bound.arguments[name] = checked_value(name, value, kind)
        return function(*bound.args, **bound.kwargs)

    return checked


def unknown_argument(name: str, known: Iterable[str]) -> ArgumentError:
    """Return the error about an argument that a function does not have."""
    names = [one for one in known if one != "self"]
    return ArgumentError(
        f"unknown argument `{name}`{did_you_mean(name, names)}; known: {', '.join(names)}", name
    )


def checked_options(given: Mapping[str, Any], declared: object) -> dict[str, Any]:
    """Return options whose types are as the annotations of a class declare.

    Raises
    ------
    ArgumentError
        One has another type. An unknown one is not checked.
    """
    kinds = getattr(declared, "__annotations__", {})
    return {name: checked_value(name, value, kinds.get(name)) for name, value in given.items()}


def checked_value(name: str, value: Any, annotation: Any) -> Any:
    """Return an argument of the annotated type.

    Raises
    ------
    ArgumentError
        It has another type.
    """
    kinds = _alternatives(annotation)
    if not all(_origin(kind) in (*_WORDS, *_SEVERAL, NoneType) for kind in kinds):
        return value
    if isinstance(value, Iterator):
        value = tuple(value)
    if (
        isinstance(value, str)
        and str not in kinds
        and any(_origin(one) in _SEVERAL for one in kinds)
    ):
        value = (value,)
    if isinstance(value, str) and not value and Path in kinds:
        # The path of the working directory is ".".
        raise ArgumentError(f"`{name}`: expected {_words(kinds)}, was an empty text", name)
    if any(_fits(value, kind) for kind in kinds):
        return value
    shown = repr(value)
    was = shown if len(shown) <= _WAS_MAX else type(value).__name__
    raise ArgumentError(f"`{name}`: expected {_words(kinds)}, was {was}", name)


def _alternatives(annotation: Any) -> tuple[Any, ...]:
    union = get_origin(annotation) in (Union, UnionType)
    return get_args(annotation) if union else (annotation,)


def _origin(kind: Any) -> Any:
    return get_origin(kind) or kind


def _fits(value: Any, kind: Any) -> bool:
    origin = _origin(kind)
    if origin is Callable:
        return callable(value)
    if origin in (int, float):
        number = Integral if origin is int else Real
        return isinstance(value, number) and not isinstance(value, bool)
    if not isinstance(value, origin):
        return False
    if origin is tuple:
        of = get_args(kind)
        return len(value) == len(of) and all(map(_fits, value, of))
    if origin in _SEVERAL:
        of = _alternatives(get_args(kind)[0])
        return not isinstance(value, bytes) and all(
            any(_fits(one, other) for other in of) for one in value
        )
    return True


def _words(kinds: Sequence[Any]) -> str:
    words = []
    for kind in kinds:
        origin = _origin(kind)
        if origin in _SEVERAL:
            words.append("several paths" if Path in get_args(get_args(kind)[0]) else "names")
        elif origin is not NoneType and not (origin is str and Path in kinds):
            words.append(_WORDS[origin])
    return " or ".join(words)
