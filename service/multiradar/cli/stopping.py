"""SIGTERM and Ctrl-C: a command ends wherever it is, and cleans up on its way."""

import signal
import sys
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

# Long beside the steps between an exception and what cleans up after it, short for who waits.
_AGAIN_S = 0.1


class Terminated(BaseException):
    """SIGTERM came: everything is cleaned up as after Ctrl-C, which typer keeps to itself."""


class StopSignals:
    """Turns SIGTERM and SIGINT into exceptions that do not get lost.

    Python runs a handler between any two steps of the main thread, so its exception may rise
    inside a call that compiled code made and that cannot pass it on: such code drops it, or goes
    on with an error of its own. The exception is therefore raised again until it arrives
    (`arrived`), though never while another one is being dealt with, as that cleans up already.
    """

    def __init__(self) -> None:
        self._told: int | None = None
        self._before = sys.unraisablehook

    @property
    def told(self) -> BaseException | None:
        """The exception of the signal that came, if one did."""
        if self._told is None:
            return None
        return Terminated() if self._told == signal.SIGTERM else KeyboardInterrupt()

    def install(self) -> None:
        """Handle both signals from now on; an ignored SIGINT, as behind `&`, stays ignored."""
        signal.signal(signal.SIGTERM, self._tell)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._tell)
        signal.signal(signal.SIGALRM, self._tell_again)
        sys.unraisablehook = self._on_unraisable

    def arrived(self) -> None:
        """Raise no more: the command has ended."""
        if self._told is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _tell(self, number: int, _frame: FrameType | None) -> None:
        first, self._told = self._told is None, number
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S, _AGAIN_S)
        # Told twice, it ends even a clean-up that hangs.
        if not first or sys.exception() is None:
            self._raise()

    def _tell_again(self, _number: int, _frame: FrameType | None) -> None:
        if sys.exception() is None:
            self._raise()

    def _raise(self) -> None:
        if (told := self.told) is not None:
            raise told

    def _on_unraisable(self, args: "UnraisableHookArgs") -> None:
        if self._told is None or not isinstance(args.exc_value, KeyboardInterrupt | Terminated):
            self._before(args)
