"""Kernel compilation ahead of a command, with a progress line."""

import sys
from collections.abc import Iterable

from multiradar.clock import SystemClock

#: Interval between lines where standard error is not a terminal, s.
_LINE_PERIOD_S = 10.0


def compile_kernels(purposes: Iterable[str]) -> int:
    """Compile what is not yet in the cache, in parallel, and show the progress on standard error.

    Parameters
    ----------
    purposes : iterable of str
        Of `multiradar_compiled.kernel_list`.

    Returns
    -------
    int
        How many kernels were missing.
    """
    from multiradar_compiled.ahead import compile_ahead
    from multiradar_compiled.kernel_list import kernels_for

    line = _Line()
    missing = compile_ahead(kernels_for(purposes), line.show)
    line.end()
    return missing


class _Line:
    def __init__(self) -> None:
        self._clock = SystemClock()
        self._started_s = self._clock.monotonic_s()
        self._shown_s: float | None = None
        self._terminal = sys.stderr.isatty()
        self._text = ""

    def show(self, done: int, total: int) -> None:
        now_s = self._clock.monotonic_s()
        self._text = (
            f"compiling kernels (first use): {done} of {total}, {now_s - self._started_s:.0f} s"
        )
        if self._terminal:
            print(f"\r\x1b[2K{self._text}", end="", file=sys.stderr, flush=True)
        elif self._shown_s is None or now_s - self._shown_s >= _LINE_PERIOD_S:
            print(f"multiradar: {self._text}", file=sys.stderr, flush=True)
        else:
            return
        self._shown_s = now_s

    def end(self) -> None:
        if self._shown_s is None:
            return
        if self._terminal:
            print("\r\x1b[2K", end="", file=sys.stderr, flush=True)
        else:
            print(f"multiradar: {self._text}", file=sys.stderr, flush=True)
