"""Warnings that point at the line of the user."""

import sys
import warnings
from types import FrameType

_OWN = ("multiradar.", "contextlib")


def warn(sentence: str, category: type[Warning]) -> None:
    """Warn, at the first caller outside this package.

    Parameters
    ----------
    sentence : str
        The warning.
    category : type
        Its class.
    """
    frame: FrameType | None = sys._getframe(1)
    level = 2
    while frame is not None and str(frame.f_globals.get("__name__", "")).startswith(_OWN):
        frame, level = frame.f_back, level + 1
    warnings.warn(sentence, category, stacklevel=level)
