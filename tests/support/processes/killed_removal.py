"""Removal of entries of a journal in a process that is killed at a call of the system.

Run as a program under strace: one for many journals. Each removal is in a process of its own, which
first makes calls of the kind, so that the one to be killed at has the same number in all of them.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from multiradar.storage.snapshots import Position
from multiradar.storage.sqlite import shortening

#: More than a removal makes of any kind.
FATAL = 400
#: Entries that one transaction removes.
ENTRIES_MAX = 8

#: Calls that a removal may make.
CALLS = ("pwrite64", "write", "fdatasync", "fsync", "ftruncate", "unlink")

#: Removes from a journal, killed before the call of a kind with a number; returns whether it was
#: not killed.
Removal = Callable[[str, int, Path], bool]


@contextmanager
def removing(until: Position) -> Iterator[Removal]:
    """Yield what removes the entries of a journal up to one."""
    calls = ",".join(CALLS)
    line = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", f"trace={calls}"]
    line += ["-e", f"inject={calls}:signal=SIGKILL:when={FATAL}"]
    line += [sys.executable, __file__, str(until.sequence), until.digest.hex()]
    environment = {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONDONTWRITEBYTECODE": "1"}
    pipe = subprocess.PIPE
    with subprocess.Popen(line, stdin=pipe, stdout=pipe, text=True, env=environment) as running:
        to, said = running.stdin, running.stdout
        assert to is not None
        assert said is not None

        def remove(kind: str, number: int, path: Path) -> bool:
            assert number < FATAL
            print(kind, number, path, file=to, flush=True)
            status = int(said.readline())
            assert status in (0, signal.SIGKILL)
            return status == 0

        yield remove


def _serve(until: Position) -> None:
    shortening.ENTRIES_MAX, shortening.PAUSE_S = ENTRIES_MAX, 0.0
    file = os.memfd_create("calls")
    # The same calls in a form that does nothing.
    idle: dict[str, Callable[[], object]] = {
        "pwrite64": lambda: os.pwrite(file, b"", 0),
        "write": lambda: os.write(file, b""),
        "fdatasync": lambda: os.fdatasync(file),
        "fsync": lambda: os.fsync(file),
        "ftruncate": lambda: os.ftruncate(file, 0),
        "unlink": lambda: os.unlink(""),
    }
    for line in sys.stdin:
        kind, number, path = line.rstrip("\n").split(maxsplit=2)
        process = os.fork()
        if process == 0:
            for _ in range(FATAL - int(number)):
                with suppress(FileNotFoundError):
                    idle[kind]()
            shortening.remove_until(Path(path), until)
            os._exit(0)
        # `write` is counted.
        os.writev(1, [b"%d\n" % os.waitpid(process, 0)[1]])


if __name__ == "__main__":
    _serve(Position(int(sys.argv[1]), bytes.fromhex(sys.argv[2])))
