"""The command `multiradar` in a process of its own, forked from one that has its modules loaded.

A process that starts from nothing spends two seconds on imports. What a start itself does is seen
with `support.waiting.run_to_end` and `RUN`.
"""

import multiprocessing
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from multiprocessing.reduction import DupFd
from typing import Any

from support.waiting import WAIT_TIMEOUT_S

RUN = [sys.executable, "-m", "multiradar"]

_PROCESSES = multiprocessing.get_context("forkserver")
_PROCESSES.set_forkserver_preload(["multiradar.app", "multiradar.cli.main"])


class Command:
    """A running command; `stdout` reads what it prints, standard error is that of the tests.

    Parameters
    ----------
    *arguments : object
        What follows the name of the program.
    env : mapping, optional
        The environment; that of this process when absent.
    """

    def __init__(self, *arguments: object, env: Mapping[str, str] | None = None) -> None:
        reading, writing = os.pipe()
        self.stdout = open(reading, encoding="utf-8")  # noqa: SIM115
        self._process = start(arguments, env, writing, 2)
        os.close(writing)

    def poll(self) -> int | None:
        """Return the exit status, None while it runs."""
        status: int | None = self._process.exitcode
        return status

    def wait(self) -> int:
        """Return the exit status once it has ended."""
        return ended(self._process)

    def read_to_end(self) -> str:
        """Return all that it still prints until it ends."""
        said = self.stdout.read()
        self.wait()
        self.stdout.close()
        return said

    def signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if self._process.pid is not None and self.poll() is None:
            os.kill(self._process.pid, number)


def run_command(
    *arguments: object, env: Mapping[str, str] | None = None
) -> "subprocess.CompletedProcess[str]":
    """Run a command to its end and return what it said, whatever its exit status."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        status = ended(start(arguments, env, out.fileno(), errors.fileno()))
        for one in (out, errors):
            one.seek(0)
        return subprocess.CompletedProcess(
            [*map(str, arguments)], status, out.read(), errors.read()
        )


def start(
    arguments: tuple[object, ...], env: Mapping[str, str] | None, out: int, errors: int
) -> Any:
    """Start the command with open files as its standard output and standard error."""
    environment = dict(os.environ if env is None else env)
    process = _PROCESSES.Process(
        target=_run, args=([*map(str, arguments)], environment, _Stream(out), _Stream(errors))
    )
    process.start()
    return process


def ended(process: Any) -> int:
    """Return the exit status of a process once it has ended."""
    process.join(WAIT_TIMEOUT_S)
    assert process.exitcode is not None, f"waited {WAIT_TIMEOUT_S:.0f} s for the end of a command"
    return int(process.exitcode)


class _Stream:
    """An open file that goes with what is started."""

    def __init__(self, number: int) -> None:
        self._number = number

    def __reduce__(self) -> tuple[Any, ...]:
        return _inherited, (DupFd(self._number),)


def _inherited(handed: Any) -> int:
    return int(handed.detach())


# In the process that was forked.
def _run(arguments: list[str], environment: dict[str, str], out: int, errors: int) -> None:
    os.environ.clear()
    os.environ.update(environment)
    for number, stream in ((1, out), (2, errors)):
        os.dup2(stream, number)
        os.close(stream)
    sys.argv = ["multiradar", *arguments]
    from multiradar.cli.main import main

    main()
