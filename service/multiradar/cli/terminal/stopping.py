"""SIGTERM and Ctrl-C: a command exits at once and removes partial output."""

import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType

from multiradar_converters.leftovers import remove_leftovers

#: Exit status of a command stopped by Ctrl-C: 128 + SIGINT.
EXIT_INTERRUPTED = 130
#: The same for SIGTERM.
EXIT_TERMINATED = 143

_STATUS = {signal.SIGTERM: EXIT_TERMINATED, signal.SIGINT: EXIT_INTERRUPTED}
# Clears a progress bar and shows the cursor.
_CLEAR_LINE = b"\r\x1b[2K\x1b[?25h"


def end_on_signals() -> None:
    """End the process on SIGTERM and SIGINT from now on; ignored ones stay ignored.

    No exception is raised. Python runs handlers between any two steps of the main thread, so an
    exception could be raised inside a call from compiled code, which drops it, continues with an
    error of its own, or crashes.
    """
    for number in _STATUS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def leave(status: int) -> None:
    """End the process without waiting for its threads.

    Python would wait for threads in compiled code, which cannot be stopped, for minutes in a study.

    Parameters
    ----------
    status : int
        Its exit status.
    """
    # The reader may have gone, or the signal may have interrupted a write.
    with suppress(OSError, RuntimeError, ValueError):
        sys.stdout.flush()
    os._exit(status)


def _end(number: int, _frame: FrameType | None) -> None:
    for each in _STATUS:
        # A second signal terminates even when cleaning up hangs.
        signal.signal(each, signal.SIG_DFL)
    # Remaining threads fail when their files are removed; that is expected.
    threading.excepthook = _ignore_failure
    remove_leftovers()
    with suppress(OSError):
        if os.isatty(2):
            os.write(2, _CLEAR_LINE)
        os.write(2, b"multiradar: stopped\n")
    leave(_STATUS[signal.Signals(number)])


def _ignore_failure(_failure: threading.ExceptHookArgs) -> None:
    pass
