"""Wrong values and unknown names in sentences, with the nearest name that is known."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

#: Longest piece of a wrong value that a sentence repeats.
SHOWN_LENGTH_MAX = 60
_QUOTED = re.compile(r"'([^']*)'")
#: How alike two names are at least, from 0 to 1, for one to be meant by the other.
LIKENESS_MIN = 0.6


def unknown(what: str, was: object, known: Iterable[str]) -> str:
    """Return the sentence about a name that is not known.

    Parameters
    ----------
    what : str
        What it should name, such as `command`.
    was : object
        The name given.
    known : iterable of str
        The names there are.

    Returns
    -------
    str
        Of the form "unknown command 'trakc' (did you mean 'track'?); known: track, serve".

    Examples
    --------
    >>> unknown("command", "trakc", ["track", "serve"])
    "unknown command 'trakc' (did you mean 'track'?); known: track, serve"
    """
    names = list(known)
    return f"unknown {what} {shown(was)}{did_you_mean(was, names)}; known: {', '.join(names)}"


def shown(value: object) -> str:
    """Return a value as a short, printable, plain ASCII text."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    try:
        text = ascii(value)
    except (ValueError, RecursionError):  # An integer of thousands of digits, a very deep list.
        text = f"a {type(value).__name__} too large to print"
    return text if len(text) <= SHOWN_LENGTH_MAX else f"{text[:SHOWN_LENGTH_MAX]}…"


def unknown_choice(was: object, expected: str) -> str:
    """Return the sentence about a value that is none of the quoted ones, as pydantic lists them."""
    return unknown("name", was, _QUOTED.findall(expected))


def did_you_mean(was: object, known: Iterable[str]) -> str:
    """Return " (did you mean 'track'?)" where a known name is like the one given, else nothing."""
    near = nearest(was, known)
    return "" if near is None else f" (did you mean '{near}'?)"


def nearest(was: object, known: Iterable[str]) -> str | None:
    """Return the known name that is most like the one given; None where none is like it."""
    if not isinstance(was, str):
        return None
    plain = {_plain(name): name for name in known}
    wanted = _plain(was)
    close = get_close_matches(wanted, plain, n=1, cutoff=LIKENESS_MIN)
    if close:
        return plain[close[0]]
    begun = [name for text, name in plain.items() if wanted and text.startswith(wanted)]
    return begun[0] if len(begun) == 1 else None


# Capitals, dashes and underscores are mixed up more often than letters.
def _plain(name: str) -> str:
    return name.casefold().replace("-", "").replace("_", "")
