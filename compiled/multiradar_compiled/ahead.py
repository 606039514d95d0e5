"""Ahead-of-time compilation of kernels that a command needs, in as many processes as cores.

Type inference and lowering, which take most of the time, hold Python's lock, so threads would not
help. Of several commands started at once, one compiles and the others wait for it.
"""

import fcntl
import hashlib
import json
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO

from multiradar_compiled.cache import kernel_folder
from multiradar_compiled.kernel_list import TypedKernel

#: Called with the number of compiled kernels and their total number.
Progress = Callable[[int, int], None]

_MARKS = "compiled"
_LOCK = "lock"
#: Interval of progress reports and of polling while waiting, s.
_POLL_PERIOD_S = 0.2
#: A process uses 300 MB; more processes would wait for the longest kernel anyway.
_WORKERS_MAX = 8


def compile_ahead(kernels: Iterable[TypedKernel], on_progress: Progress) -> int:
    """Compile kernels that are not yet in the cache.

    Parameters
    ----------
    kernels : iterable of TypedKernel
        As of `kernel_list.kernels_for`; the first are compiled first.
    on_progress : callable
        Called several times a second with the number of compiled kernels and their total number;
        not called if there is nothing to compile.

    Returns
    -------
    int
        Number of kernels missing at the start. Kernels that could not be compiled ahead are
        compiled at their first call.
    """
    folder = kernel_folder()
    if folder is None or os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return 0
    missing = missing_kernels(kernels)
    if missing:
        marks = folder / _MARKS
        marks.mkdir(exist_ok=True)
        with (folder / _LOCK).open("w") as lock:
            _compile_or_wait(lock, marks, missing, on_progress)
    return len(missing)


def missing_kernels(kernels: Iterable[TypedKernel]) -> list[TypedKernel]:
    """Return those kernels that are not in the cache."""
    folder = kernel_folder()
    if folder is None:
        return list(kernels)
    return [one for one in kernels if not _mark(folder / _MARKS, one).exists()]


def _mark(marks: Path, one: TypedKernel) -> Path:
    # An empty file marks a kernel as cached: numba's own index has no public reader.
    text = f"{one.kernel} {' '.join(one.arguments)}"
    return marks / hashlib.sha256(text.encode()).hexdigest()[:16]


def _compile_or_wait(
    lock: IO[str], marks: Path, missing: list[TypedKernel], on_progress: Progress
) -> None:
    total = len(missing)

    def left() -> list[TypedKernel]:
        return [one for one in missing if not _mark(marks, one).exists()]

    wait = threading.Event()
    while not _locked(lock):
        # The other process may compile other kernels; these are then compiled after it.
        waiting = left()
        on_progress(total - len(waiting), total)
        if not waiting:
            return
        wait.wait(_POLL_PERIOD_S)
    workers = _Workers(left(), marks)
    try:
        while workers.running():
            on_progress(total - len(left()), total)
            wait.wait(_POLL_PERIOD_S)
        on_progress(total - len(left()), total)
    finally:
        workers.stop()


def _locked(lock: IO[str]) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


class _Workers:
    # Worker processes, each with a thread that sends it one kernel after another.
    def __init__(self, missing: list[TypedKernel], marks: Path) -> None:
        self._waiting = deque(missing)
        self._marks = marks
        count = min(len(missing), len(os.sched_getaffinity(0)), _WORKERS_MAX)
        self._workers = [_start_worker() for _ in range(count)]
        self._threads = [
            threading.Thread(target=self._serve, args=(worker,), daemon=True)
            for worker in self._workers
        ]
        for thread in self._threads:
            thread.start()

    def running(self) -> bool:
        return any(thread.is_alive() for thread in self._threads)

    def stop(self) -> None:
        self._waiting.clear()
        for worker in self._workers:
            worker.kill()
            worker.wait()
        for thread in self._threads:
            thread.join()

    def _serve(self, worker: "subprocess.Popen[str]") -> None:
        assert worker.stdin is not None
        assert worker.stdout is not None
        with worker.stdin as requests, worker.stdout as answers:
            while self._waiting:
                try:
                    one = self._waiting.popleft()
                    request = {"kernel": one.kernel, "arguments": one.arguments}
                    requests.write(json.dumps(request) + "\n")
                    requests.flush()
                    answer = answers.readline()
                except (IndexError, OSError):
                    return
                if answer == "\n":
                    _mark(self._marks, one).touch()
                if not answer:
                    return


def _start_worker() -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "multiradar_compiled.worker", str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        # Modules of the working directory must not be imported (`-P`). Ctrl-C is for the command.
        process_group=0,
    )
