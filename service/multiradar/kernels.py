"""How the compiled functions in the loop over plots are made."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])

# Arrays are not counted (`_nrt`): counting took more than half of the time. Such a function cannot
# make an array that lasts, and its caller must hold on to those it hands in. Products may be fused
# with sums (`contract`), in the same way wherever a plot comes in a batch.
_OPTIONS: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "_nrt": False,
}


def in_loop(function: Kernel) -> Kernel:
    """Compile what is called once a plot or more.

    Parameters
    ----------
    function : callable
        Makes no arrays but views. It becomes part of its caller, for a call with twenty arrays
        costs as much as the arithmetic; with one `return` it does so best.

    Returns
    -------
    callable
        Compiled at its first call.
    """
    compiled: Kernel = njit(forceinline=True, **_OPTIONS)(function)
    return compiled


def loop(function: Kernel) -> Kernel:
    """Compile the loop over plots itself.

    Parameters
    ----------
    function : callable
        Makes no arrays but views.

    Returns
    -------
    callable
        Compiled at its first call.
    """
    compiled: Kernel = njit(**_OPTIONS)(function)
    return compiled
