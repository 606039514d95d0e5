"""Findings of `multiradar doctor`: one for each check."""

import os
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from multiradar.errors import MultiradarError


class Level(StrEnum):
    """How severe a finding is."""

    OK = "ok"
    WARNING = "warning"
    """The service starts, but will have a problem later, or needs more resources than it should."""

    ERROR = "error"
    """The service does not start, or loses data."""


class Finding(NamedTuple):
    """What a check found.

    Attributes
    ----------
    check : str
        Name of the check.
    level : Level
        How severe it is.
    text : str
        What was found.
    advice : str
        What to do; empty if nothing is wrong.
    """

    check: str
    level: Level
    text: str
    advice: str = ""


def ok(check: str, text: str) -> Finding:
    """Return the finding of a check that found nothing wrong."""
    return Finding(check, Level.OK, text)


def warning(check: str, text: str, advice: str) -> Finding:
    """Return a warning."""
    return Finding(check, Level.WARNING, text, advice)


def error(check: str, text: str, advice: str) -> Finding:
    """Return an error."""
    return Finding(check, Level.ERROR, text, advice)


class Unwritable(NamedTuple):
    """Why a folder cannot be written, and what to do."""

    text: str
    advice: str


def unwritable(place: Path) -> Unwritable | None:
    """Return why a folder that exists cannot be written; None if it can."""
    if not place.is_dir():
        return Unwritable("is a file, not a folder", "move this file, or change the path")
    if os.access(place, os.W_OK | os.X_OK):
        return None
    return Unwritable(
        "not writable by this user",
        "make it writable by the user of the service, and run doctor as that user",
    )


def found(check: str, advice: str, look: Callable[[], Finding]) -> Finding:
    """Return what a check finds; an error with this advice if it fails."""
    try:
        return look()
    except MultiradarError as failure:
        return error(check, " ".join(str(failure).split()), advice)
    except OSError as failure:
        return error(check, f"{failure.filename or check}: {failure.strerror or failure}", advice)
