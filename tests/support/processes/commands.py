"""The command `multiradar` in a process of its own, forked from one that has loaded what it needs.

A process that starts from nothing spends seconds on modules and compiled kernels. What a start
itself does is seen with `support.processes.waiting.run_to_end` and `RUN`.
"""

import functools
import multiprocessing
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess
from multiprocessing.reduction import DupFd
from typing import Any

from multiradar.cli.main import main
from support.processes.waiting import WAIT_TIMEOUT_S

RUN = [sys.executable, "-m", "multiradar"]

Forked = ForkServerProcess

_PROCESSES = multiprocessing.get_context("forkserver")
_PROCESSES.set_forkserver_preload(["support.processes.preloaded"])


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
        self._process = start_command(arguments, env, writing, 2)
        os.close(writing)

    @property
    def pid(self) -> int:
        """Its number."""
        assert self._process.pid is not None
        return self._process.pid

    def poll(self) -> int | None:
        """Return the exit status, None while it runs."""
        return self._process.exitcode

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
    environment = dict(os.environ if env is None else env)
    return run_forked(_command, [*map(str, arguments)], environment)


def run_forked(
    function: Callable[..., object], *arguments: object
) -> "subprocess.CompletedProcess[str]":
    """Call a function in a process of its own and return what it said, whatever its status."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        streams = {1: out.fileno(), 2: errors.fileno()}
        status = ended(fork(function, *arguments, streams=streams))
        for one in (out, errors):
            one.seek(0)
        return subprocess.CompletedProcess(
            [*map(str, arguments)], status, out.read(), errors.read()
        )


def start_command(
    arguments: Sequence[object],
    env: Mapping[str, str] | None,
    out: int,
    errors: int,
    folder: str | None = None,
) -> Forked:
    """Start the command with open files as its standard output and standard error.

    In a folder, or in that of this process.
    """
    environment = dict(os.environ if env is None else env)
    streams = {1: out, 2: errors}
    return fork(_command, [*map(str, arguments)], environment, folder, streams=streams)


def fork(function: Callable[..., object], *arguments: object, streams: Mapping[int, int]) -> Forked:
    """Call a function in a process of its own.

    Parameters
    ----------
    function : callable
        Of a module that can be imported.
    *arguments : object
        Its arguments.
    streams : mapping of int to int
        Standard streams of the process, by the files that are open here.
    """
    inherited = {number: _Stream(file) for number, file in streams.items()}
    _start_server()
    process = _PROCESSES.Process(target=_call, args=(function, arguments, inherited))
    process.start()
    return process


# It imports what is preloaded before it knows the paths of this process.
@functools.cache
def _start_server() -> None:
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(sys.path)
    try:
        forkserver.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before


def ended(process: Forked) -> int:
    """Return the exit status of a process once it has ended."""
    process.join(WAIT_TIMEOUT_S)
    assert process.exitcode is not None, f"waited {WAIT_TIMEOUT_S:.0f} s for the end of a process"
    return process.exitcode


class _Stream:
    """An open file that goes with what is started."""

    def __init__(self, file: int) -> None:
        self._file = file

    def __reduce__(self) -> tuple[Any, ...]:
        return _inherited, (DupFd(self._file),)


def _inherited(handed: Any) -> int:
    return int(handed.detach())


# In the process that was forked.
def _call(
    function: Callable[..., object], arguments: tuple[object, ...], streams: dict[int, int]
) -> None:
    for number, file in streams.items():
        os.dup2(file, number)
        os.close(file)
    function(*arguments)


def _command(arguments: list[str], environment: dict[str, str], folder: str | None = None) -> None:
    if folder is not None:
        os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    # It is searched for again, as TMPDIR may differ.
    tempfile.tempdir = None
    sys.argv = ["multiradar", *arguments]
    main()
