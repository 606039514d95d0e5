"""Compiled functions and their plain forms."""

from collections.abc import Callable
from types import FunctionType
from typing import Any

_PLAIN: dict[Any, Callable[..., Any]] = {}


def plain(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The function that was compiled, which calls such functions alone; none is compiled.

    Parameters
    ----------
    kernel : callable
        With NUMBA_DISABLE_JIT=1 the function itself.
    """
    if kernel in _PLAIN:
        return _PLAIN[kernel]
    function = getattr(kernel, "py_func", kernel)
    names = dict(function.__globals__)
    found = FunctionType(
        function.__code__, names, function.__name__, function.__defaults__, function.__closure__
    )
    _PLAIN[kernel] = found
    for name in function.__code__.co_names:
        if _is_of_kernels(names.get(name)):
            names[name] = plain(names[name])
    return found


def _is_of_kernels(value: object) -> bool:
    ours = str(getattr(value, "__module__", "")).startswith("multiradar")
    return ours and (hasattr(value, "py_func") or isinstance(value, FunctionType))
