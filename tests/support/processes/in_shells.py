"""The command `multiradar` for shell scripts, in processes forked by `support.processes.commands`.

A program of this name on the path hands over its arguments, environment, folder and streams, and
ends as the command does. Signals reach the command, and SIGKILL of the program kills it.
"""

import json
import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread

from support.processes.commands import ended, start_command

# It imports so little that it starts in a fiftieth of a second.
_PROGRAM = """#!{python} -IS
import json, os, signal, socket, sys
link = socket.socket(socket.AF_UNIX)
link.connect({address!r})
given = json.dumps([sys.argv[1:], dict(os.environ), os.getcwd()]).encode()
socket.send_fds(link, [len(given).to_bytes(4, "big")], [1, 2])
for number in (signal.SIGTERM, signal.SIGINT):
    signal.signal(number, lambda one, _: link.send(bytes([one])))
link.sendall(given)
os._exit(link.recv(1)[0])
"""


@contextmanager
def multiradar_in_shells(folder: Path) -> Iterator[None]:
    """Write the program `multiradar` to a folder, and run what it is asked for."""
    # The address of a socket has at most 107 characters.
    address = f"\0multiradar-in-shells-{os.getpid()}"
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen()
        Thread(target=_serve, args=(listening,), daemon=True).start()
        program = folder / "multiradar"
        program.write_text(_PROGRAM.format(python=sys.executable, address=address))
        program.chmod(0o755)
        try:
            yield
        finally:
            listening.shutdown(socket.SHUT_RDWR)


def _serve(listening: socket.socket) -> None:
    with suppress(OSError):
        while True:
            link, _ = listening.accept()
            Thread(target=_run, args=(link,), daemon=True).start()


def _run(link: socket.socket) -> None:
    with link:
        size, streams, _, _ = socket.recv_fds(link, 4, 2)
        given = link.recv(int.from_bytes(size, "big"), socket.MSG_WAITALL)
        arguments, environment, folder = json.loads(given)
        out, errors = streams
        process = start_command(arguments, environment, out, errors, folder)
        for stream in streams:
            os.close(stream)
        assert process.pid is not None
        while process.sentinel not in wait([process.sentinel, link]):
            # It ends without a word when it is killed.
            number = (link.recv(1) or bytes([signal.SIGKILL]))[0]
            os.kill(process.pid, number)
            if number == signal.SIGKILL:
                break
        status = ended(process)
        with suppress(BrokenPipeError):
            link.sendall(bytes([status % 256]))
