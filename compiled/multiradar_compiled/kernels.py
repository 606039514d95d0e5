"""Decorators of compiled functions (kernels)."""

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba import config, njit, types
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload, register_jitable
from numpy.typing import NDArray

from multiradar_compiled.cache import keep_in_folder
from multiradar_compiled.parts import PartCompiler

Kernel = TypeVar("Kernel", bound=Callable[..., object])

# Without `fastmath`: fused products would depend on what was compiled before, and with them the
# last bits. The wrapper for C is never called.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
# Without reference counting of arrays (`_nrt`), which took more than half of the time. Such a
# function cannot create arrays, and its caller must keep references to those it passes.
_UNCOUNTED: dict[str, Any] = {**_OPTIONS, "_nrt": False}
# numba has no type annotations of it.
_unliteral: Any = types.unliteral
# A wrapper for Python is a tenth of the compilation time.
_PART: dict[str, Any] = {**_UNCOUNTED, "no_cpython_wrapper": True}
#: Options of functions inlined in their caller.
IN_LOOP: Any = {"forceinline": True, "_nrt": False}


def kernel(function: Kernel) -> Kernel:
    """Compile a function that may create arrays.

    Parameters
    ----------
    function : callable
        Called from Python, or from another kernel.

    Returns
    -------
    callable
        Compiled at its first call, or ahead of time (`multiradar_compiled.ahead`).
    """
    return _compiled(function, _OPTIONS)


def inlined_kernel(function: Kernel) -> Kernel:
    """Inline a function whose types depend on its caller.

    Parameters
    ----------
    function : callable
        May create arrays.

    Returns
    -------
    callable
        Compiled with its caller.
    """
    return _compiled(function, {**_OPTIONS, "inline": "always"})


def in_loop(function: Kernel) -> Kernel:
    """Compile a function that runs at least once per plot.

    Parameters
    ----------
    function : callable
        Creates no arrays except views. It is inlined in its caller, as a call with twenty arrays
        costs as much as the arithmetic; best with a single `return`.

    Returns
    -------
    callable
        Compiled at its first call.
    """
    return _part(function, {**_PART, "forceinline": True})


def inner_loop(function: Kernel) -> Kernel:
    """Compile a function that is only called from compiled functions, and is not inlined.

    Parameters
    ----------
    function : callable
        Creates no arrays except views.

    Returns
    -------
    callable
        Compiled with its caller.
    """
    return _part(function, _PART)


def loop(function: Kernel) -> Kernel:
    """Compile a loop over plots.

    Parameters
    ----------
    function : callable
        Creates no arrays except views.

    Returns
    -------
    callable
        Compiled at its first call, or ahead of time.
    """
    return _compiled(function, _UNCOUNTED)


class _Kernel(CPUDispatcher):
    # numba compiles a function once more for each constant that a compiled caller passes; one form
    # for each type does.
    def get_call_template(self, arguments: Any, named: Any) -> Any:
        plain = [_unliteral(one) for one in arguments]
        return super().get_call_template(
            plain, {name: _unliteral(one) for name, one in named.items()}
        )


class _Part(_Kernel):
    # A function that is compiled with its caller. For calls from Python, as in tests, another form
    # is compiled.
    def add_overload(self, result: Any) -> None:
        # numba would call a wrapper, of which there is none.
        self.overloads[tuple(result.signature.args)] = result

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return self._for_python(*arguments, **named)

    @cached_property
    def _for_python(self) -> Any:
        compiled = njit(**_UNCOUNTED)(self.py_func)
        keep_in_folder(compiled, "-for-python")
        return compiled


def _compiled(
    function: Kernel, options: dict[str, Any], form: type[CPUDispatcher] = _Kernel, **named: Any
) -> Kernel:
    numba_config: Any = config
    if numba_config.DISABLE_JIT:
        return function
    targetoptions = {**options, "nopython": True, "boundscheck": None}
    compiled: Any = form(function, targetoptions=targetoptions, **named)
    if form is _Kernel:
        keep_in_folder(compiled)
    return cast(Kernel, compiled)


def _part(function: Kernel, options: dict[str, Any]) -> Kernel:
    return _compiled(function, options, _Part, pipeline_class=PartCompiler)


def in_both(function: Kernel) -> Kernel:
    """Make a function callable from compiled functions; it remains a Python function.

    Parameters
    ----------
    function : callable
        Creates no arrays when compiled.

    Returns
    -------
    callable
        The function.
    """
    same: Kernel = register_jitable(**IN_LOOP)(function)
    return same


def fetch_ahead(array: NDArray[np.generic], row: int, line: int) -> None:
    """Prefetch one cache line of a row; changes nothing.

    Parameters
    ----------
    array : ndarray
        The array, contiguous along its first axis.
    row : int
        Index of the row.
    line : int
        Index of the 64-byte line in it.

    Notes
    -----
    The states of thousands of aircraft exceed the processor's inner cache, and plots arrive in any
    order; but the next aircraft are known.
    """


@overload(fetch_ahead, jit_options=IN_LOOP)
def _fetch_ahead(array: Any, row: Any, line: Any) -> Any:
    def compiled(array: Any, row: Any, line: Any) -> None:
        _prefetch(array, row, line)

    return compiled


def _write_prefetch(typing: Any, array: Any, row: Any, line: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, given[0])
        byte = ir.IntType(8).as_pointer()
        stride = builder.extract_value(view.strides, 0)
        shift = builder.mul(given[2], ir.Constant(given[2].type, 64))
        offset = builder.add(builder.mul(stride, given[1]), shift)
        address = builder.gep(builder.bitcast(view.data, byte), [offset])
        integer = ir.IntType(32)
        function = builder.module.declare_intrinsic(
            "llvm.prefetch",
            [byte],
            ir.FunctionType(ir.VoidType(), [byte, integer, integer, integer]),
        )
        # Read access, high locality, data cache.
        builder.call(function, [address, integer(0), integer(3), integer(1)])
        return context.get_dummy_value()

    return types.void(array, types.int64, types.int64), generate


_prefetch: Any = intrinsic(_write_prefetch)


def fused(first: float, second: float, third: float) -> float:
    """Return first · second + third, rounded once.

    Parameters
    ----------
    first, second, third : float
        The numbers. Uncompiled, the result is rounded twice.

    Returns
    -------
    float
        The same on every processor: fusing is explicit, not left to the compiler.
    """
    return first * second + third


@overload(fused, jit_options=IN_LOOP)
def _fused(first: Any, second: Any, third: Any) -> Any:
    def compiled(first: Any, second: Any, third: Any) -> Any:
        return _fuse(first, second, third)

    return compiled


def _write_fused(typing: Any, first: Any, second: Any, third: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.fma(*given)

    return types.float64(types.float64, types.float64, types.float64), generate


_fuse: Any = intrinsic(_write_fused)
