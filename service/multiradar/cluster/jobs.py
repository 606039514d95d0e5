"""Jobs that run beside each other in processes of their own, behind one protocol."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any, NamedTuple, Protocol

#: Time for a process to remove its partial output when its command fails, s.
END_WAIT_S = 10.0

Job = Mapping[str, Any]


class JobEvent(NamedTuple):
    """What became of a job: progress, an answer, or the loss of its process.

    Attributes
    ----------
    name : str
        The job.
    done, total : int
        Its progress.
    answer : dict, optional
        What it returned.
    lost : str
        Why its process ended without an answer.
    """

    name: str
    done: int = 0
    total: int = 0
    answer: dict[str, Any] | None = None
    lost: str = ""

    @property
    def ended(self) -> bool:
        """Whether the job runs no longer."""
        return self.answer is not None or bool(self.lost)


class Jobs(Protocol):
    """Runs jobs; owned by one thread."""

    def start(self, name: str, job: Job) -> None:
        """Start a job, without waiting for it."""
        ...

    def next(self) -> JobEvent:
        """Wait for the next event of any job that runs."""
        ...

    def close(self) -> None:
        """End all jobs that run."""
        ...


class JobProcesses:
    """Runs each job in a process of this host, which ends with this process.

    The process reads the job as a line of JSON from its standard input, and ends when that closes.
    It writes lines of JSON: ``[done, total]``, or an object with the answer.

    Parameters
    ----------
    module : str
        The program of the process, as for ``python -m``.
    environment : mapping of str to str
        Of the processes, in addition to that of this one.
    """

    def __init__(self, module: str, environment: Mapping[str, str]) -> None:
        self._module, self._environment = module, dict(environment)
        self._events: SimpleQueue[JobEvent] = SimpleQueue()
        self._running: dict[str, subprocess.Popen[str]] = {}

    def start(self, name: str, job: Job) -> None:
        """Start a job, without waiting for it."""
        errors = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115  # closed by the thread
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", self._module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=os.environ | self._environment,
            # Ctrl-C is for the command, with which the process ends.
            process_group=0,
        )
        self._running[name] = process
        assert process.stdin is not None
        # If it has ended, the thread reports it.
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps(job) + "\n")
            process.stdin.flush()
        reading = (name, process, errors)
        threading.Thread(target=self._read, args=reading, daemon=True).start()

    def next(self) -> JobEvent:
        """Wait for the next event of any job that runs."""
        event = self._events.get()
        if event.ended:
            process = self._running.pop(event.name)
            assert process.stdin is not None
            with suppress(BrokenPipeError):
                process.stdin.close()
        return event

    def close(self) -> None:
        """End all jobs that run."""
        for process in self._running.values():
            assert process.stdin is not None
            with suppress(BrokenPipeError):
                process.stdin.close()
        for process in self._running.values():
            try:
                process.wait(END_WAIT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._running.clear()

    def _read(self, name: str, process: "subprocess.Popen[str]", errors: IO[str]) -> None:
        assert process.stdout is not None
        answer = None
        with errors, process.stdout as lines:
            for line in lines:
                try:
                    found = json.loads(line)
                except ValueError:
                    break  # Its end came within the line.
                if isinstance(found, dict):
                    answer = found
                else:
                    self._events.put(JobEvent(name, *found))
            status = process.wait()
            lost = "" if answer is not None else _lost(status, errors)
        self._events.put(JobEvent(name, answer=answer, lost=lost))


def _lost(status: int, errors: IO[str]) -> str:
    if status < 0:
        ended = f"its process was terminated by {signal.Signals(-status).name}"
        return f"{ended} (out of memory?)" if -status == signal.SIGKILL else ended
    errors.seek(0)
    last = next((line.strip() for line in reversed(errors.readlines()) if line.strip()), "")
    return f"its process exited with status {status}" + (f": {last}" if last else "")
