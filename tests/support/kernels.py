"""Compiled functions and their plain forms."""

from collections.abc import Callable
from typing import Any


def plain(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The function that was compiled; with NUMBA_DISABLE_JIT=1 that is the kernel itself."""
    found: Callable[..., Any] = getattr(kernel, "py_func", kernel)
    return found
