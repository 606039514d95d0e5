"""Messages about invalid values and unknown names, with the most similar known name."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

#: Maximum length of an invalid value in a message.
SHOWN_LENGTH_MAX = 60
#: Words of the field for the known names.
SYNONYMS = {
    "ssr": "radar",
    "psr": "radar",
    "mssr": "radar",
    "modes": "radar",
    "primary": "radar",
    "secondary": "radar",
    "cat021": "adsb",
    "wam": "mlat",
    "multilateration": "mlat",
    "df": "direction-finder",
    "rdf": "direction-finder",
}
_QUOTED = re.compile(r"'([^']*)'")
#: Minimum similarity, from 0 to 1, of a suggested name.
LIKENESS_MIN = 0.6
#: Times of recordings, Unix seconds.
YEAR_2000_S, YEAR_2100_S = 946_684_800.0, 4_102_444_800.0
#: Units that are taken for seconds, and how many of each make one.
PER_SECOND = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}


def unknown(what: str, was: object, known: Iterable[str]) -> str:
    """Return the message about an unknown name.

    Parameters
    ----------
    what : str
        What it names, such as `command`.
    was : object
        The name given.
    known : iterable of str
        The known names.

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
    """Return a value as a short, printable ASCII text."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    try:
        text = ascii(value)
    except (ValueError, RecursionError):  # An integer of thousands of digits, a very deep list.
        text = f"a {type(value).__name__} too large to print"
    return text if len(text) <= SHOWN_LENGTH_MAX else f"{text[:SHOWN_LENGTH_MAX]}…"


def unknown_choice(was: object, expected: str) -> str:
    """Return the message about a value that is not one of those quoted by pydantic."""
    return unknown("name", was, _QUOTED.findall(expected))


def time_unit(value: object) -> str:
    """Return " (milliseconds?)" for a time of these years that is not in seconds, else ""."""
    if not isinstance(value, int | float):
        return ""
    for unit, per_s in PER_SECOND.items():
        if YEAR_2000_S <= abs(value) / per_s < YEAR_2100_S:
            return f" ({unit}?)"
    return ""


def did_you_mean(was: object, known: Iterable[str]) -> str:
    """Return " (did you mean 'track'?)" if a known name is similar to the given one, else ""."""
    near = nearest(was, known)
    return "" if near is None else f" (did you mean '{near}'?)"


def nearest(was: object, known: Iterable[str]) -> str | None:
    """Return the known name most similar to the given one; None if none is similar."""
    if not isinstance(was, str):
        return None
    plain = {_plain(name): name for name in known}
    wanted = _plain(was)
    if (meant := SYNONYMS.get(wanted)) in plain.values():
        return meant
    close = get_close_matches(wanted, plain, n=1, cutoff=LIKENESS_MIN)
    if close:
        return plain[close[0]]
    completions = [name for text, name in plain.items() if wanted and text.startswith(wanted)]
    return completions[0] if len(completions) == 1 else None


# Case, dashes and underscores are confused more often than letters; a bias is an offset.
def _plain(name: str) -> str:
    return name.casefold().replace("-", "").replace("_", "").replace("bias", "offset")
