"""A command that a signal breaks into where exceptions get lost; run as a program.

Arguments: the signal, the case and a folder that stands for what a command cleans up.
"""

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from time import sleep

import typer

from multiradar.cli.main import main

_LONG_S = 60.0
# Longer than a signal waits before it raises again.
_CLEAN_UP_S = 0.4


class _Told:
    def __init__(self, number: int) -> None:
        self._number = number

    def tell(self) -> None:
        os.kill(os.getpid(), self._number)
        sleep(0.0)

    def in_plain_code(self) -> None:
        self.tell()

    def in_a_callback_of_compiled_code(self) -> None:
        ctypes.CFUNCTYPE(None)(self.tell)()

    def in_a_destructor(self) -> None:
        told = self

        class Dropped:
            def __del__(self) -> None:
                told.tell()

        Dropped()

    def in_code_that_drops_it(self) -> None:
        try:
            self.tell()
        except BaseException:
            return

    def in_code_that_fails_in_its_own_way(self) -> None:
        try:
            self.tell()
        except BaseException:
            msg = "not a type"
            raise TypeError(msg) from None

    def while_an_error_is_dealt_with(self) -> None:
        try:
            int("nine")
        except ValueError:
            self.tell()


CASES: dict[str, Callable[[_Told], None]] = {
    name: case for name, case in vars(_Told).items() if name.startswith(("in_", "while_"))
}


def _command(case: Callable[[_Told], None], number: int, folder: Path) -> typer.Typer:
    app = typer.Typer()

    @app.command()
    def work() -> None:
        folder.mkdir()
        try:
            case(_Told(number))
            sleep(_LONG_S)
        finally:
            sleep(_CLEAN_UP_S)
            folder.rmdir()

    return app


if __name__ == "__main__":
    number, case, folder = signal.Signals[sys.argv[1]], CASES[sys.argv[2]], Path(sys.argv[3])
    del sys.argv[1:]
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main(_command(case, number, folder))
