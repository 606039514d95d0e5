"""A service whose threads have their names in the system, for `live_stages`.

    python -m validation.service.named_threads serve …

Python 3.11 gives a thread its name for itself alone; `/proc/PID/task/*/comm` has that of the
process for all.
"""

import ctypes
import threading
from typing import Any

from multiradar.__main__ import main

_PR_SET_NAME = 15
# Without the null at the end.
_LENGTH_MAX = 15


def _named(run: Any) -> Any:
    system = ctypes.CDLL(None)

    def with_name(thread: threading.Thread) -> None:
        system.prctl(_PR_SET_NAME, thread.name.encode()[:_LENGTH_MAX], 0, 0, 0)
        run(thread)

    return with_name


if __name__ == "__main__":
    threading.Thread.run = _named(threading.Thread.run)  # type: ignore[method-assign]
    main()
