"""SIGTERM and Ctrl-C: a command ends where it is, and leaves nothing half done."""

import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType

from multiradar_converters.leftovers import remove_leftovers

#: What a shell reports of a command stopped by Ctrl-C: 128 + SIGINT.
EXIT_INTERRUPTED = 130
#: The same of SIGTERM.
EXIT_TERMINATED = 143

_STATUS = {signal.SIGTERM: EXIT_TERMINATED, signal.SIGINT: EXIT_INTERRUPTED}
# Back to the beginning of a line without a progress bar, with a cursor.
_CLEAR_LINE = b"\r\x1b[2K\x1b[?25h"


def end_on_signals() -> None:
    """End the process on SIGTERM and SIGINT from now on; ignored ones stay ignored.

    No exception is raised for it. Python runs handlers between any two steps of the main thread,
    so an exception may rise inside a call that compiled code makes, which drops it, goes on with
    an error of its own, or crashes.
    """
    for number in _STATUS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def leave(status: int) -> None:
    """End the process without waiting for its threads.

    Python would wait for those whose compiled work nothing can stop, for minutes in a long study.

    Parameters
    ----------
    status : int
        Its exit status.
    """
    # A reader that has gone, or a write that the signal came into.
    with suppress(OSError, RuntimeError, ValueError):
        sys.stdout.flush()
    os._exit(status)


def _end(number: int, _frame: FrameType | None) -> None:
    for each in _STATUS:
        # Told twice, it ends even when cleaning up hangs.
        signal.signal(each, signal.SIG_DFL)
    # Threads that go on fail for want of what is removed; that is no news.
    threading.excepthook = _say_nothing
    remove_leftovers()
    with suppress(OSError):
        if os.isatty(2):
            os.write(2, _CLEAR_LINE)
        if number == signal.SIGTERM:
            # Who pressed Ctrl-C need not be told.
            os.write(2, b"multiradar: stopped\n")
    leave(_STATUS[signal.Signals(number)])


def _say_nothing(_failure: threading.ExceptHookArgs) -> None:
    pass
