"""A command that a signal breaks into, in places where an exception would be lost.

Run as a program: the signal, the place, a folder for its output. It would go on for ever.
"""

import ctypes
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from time import sleep

import typer

from multiradar.cli.main import main
from multiradar.storage.output_file import new_file
from multiradar.storage.output_folder import new_folder
from multiradar_converters.leftovers import temporary_folder


class _Signalled:
    def __init__(self, number: int) -> None:
        self._number = number

    def send_signal(self) -> None:
        os.kill(os.getpid(), self._number)
        sleep(0.0)

    def in_plain_code(self) -> None:
        self.send_signal()

    def in_a_callback_of_compiled_code(self) -> None:
        ctypes.CFUNCTYPE(None)(self.send_signal)()

    def in_a_destructor(self) -> None:
        signalled = self

        class Dropped:
            def __del__(self) -> None:
                signalled.send_signal()

        Dropped()

    def in_code_that_drops_whatever_is_raised(self) -> None:
        try:
            self.send_signal()
        except BaseException:
            return

    def in_code_that_fails_in_its_own_way(self) -> None:
        try:
            self.send_signal()
        except BaseException:
            msg = "not a type"
            raise TypeError(msg) from None


CASES: dict[str, Callable[[_Signalled], None]] = {
    name: case for name, case in vars(_Signalled).items() if name.startswith("in_")
}


def serve_deaf(name: str, options: Sequence[str]) -> None:
    """Serve, with a start that drops the exception of a signal, as compiled code may."""
    # Imported here: the commands above start many times, without it.
    from multiradar.app import Application

    def start(_application: Application) -> None:
        with suppress(BaseException):
            _Signalled(signal.Signals[name]).send_signal()
        Event().wait()

    Application.start = start  # type: ignore[assignment,method-assign]
    sys.argv = ["multiradar", "serve", *options]
    main()


def _write_on(folder: Path) -> None:
    number = 0
    while True:
        with (folder / f"{number % 1000}.part").open("w") as part:
            part.write("octets")
        number += 1


def _command(case: Callable[[_Signalled], None], number: int, parent: Path) -> typer.Typer:
    app = typer.Typer()

    @app.command()
    def work() -> None:
        with (
            new_folder(parent / "folder") as folder,
            new_file(parent / "page.html") as page,
            temporary_folder("multiradar-stopped-") as temporary,
        ):
            page.write_text("<html>")
            (temporary / "table").write_text("1,2")
            # Threads do not stop, and write to what is being removed.
            Thread(target=_write_on, args=(folder,), daemon=True).start()
            case(_Signalled(number))
            Event().wait()

    return app


if __name__ == "__main__":
    number, case, folder = signal.Signals[sys.argv[1]], CASES[sys.argv[2]], Path(sys.argv[3])
    del sys.argv[1:]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main(_command(case, number, folder))
