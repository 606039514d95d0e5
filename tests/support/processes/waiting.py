"""The one bound for everything that tests wait for, and the ways of waiting."""

import subprocess
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

#: It only ends a test that waits for what never comes, s. Compiling all kernels takes minutes of
#: one core, and ten times as long beside other work.
WAIT_TIMEOUT_S = 600.0
_POLL_S = 0.01


def wait_until(condition: Callable[[], object], what: str, *, fail: bool = True) -> None:
    """Wait until a condition holds.

    Parameters
    ----------
    condition : callable
        Called again and again until it returns something true.
    what : str
        What is waited for, for the message of a time-out.
    fail : bool
        Whether that is an error here; without it, the caller checks the result.
    """
    end_s = time.monotonic() + WAIT_TIMEOUT_S
    while not condition():
        if time.monotonic() > end_s:
            assert not fail, f"waited {WAIT_TIMEOUT_S:.0f} s for {what}"
            return
        time.sleep(_POLL_S)


def pause(seconds: float) -> None:
    """Let time pass where it is the matter of a test: a rate of messages, the moment of a kill.

    That nothing came is not seen by waiting, but by something that had to come after it.
    """
    time.sleep(seconds)


def join(thread: threading.Thread) -> None:
    """Wait for the end of a thread."""
    thread.join(WAIT_TIMEOUT_S)
    assert not thread.is_alive(), f"waited {WAIT_TIMEOUT_S:.0f} s for the end of {thread.name}"


def run_to_end(
    line: Sequence[str | Path],
    env: Mapping[str, str] | None = None,
    cwd: Path | None = None,
    preexec_fn: Callable[[], object] | None = None,
    input: str | None = None,
) -> "subprocess.CompletedProcess[str]":
    """Run a command and return what it said, whatever its exit status."""
    return subprocess.run(
        line, capture_output=True, text=True, check=False, env=env, cwd=cwd, preexec_fn=preexec_fn,
        input=input, timeout=WAIT_TIMEOUT_S,
    )  # fmt: skip
