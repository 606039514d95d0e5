"""Time formats, detected from the majority of the first rows of a column.

=================== ===========================================================================
form                text
=================== ===========================================================================
seconds-of-day      a number up to 31 days
unix-s, -ms, -us,   a number: seconds, milliseconds, microseconds or nanoseconds since
-ns                 1970-01-01, between 1990 and 2100
iso8601             2018-08-01T08:00:00.5Z, 2018-08-01 08:00:00+00:00; UTC without an offset
clock               08:00:00.5, a time of day
=================== ===========================================================================
"""

import re
from collections import Counter
from collections.abc import Sequence
from typing import Literal

from multiradar_converters.errors import LayoutError

TimeForm = Literal["seconds-of-day", "unix-s", "unix-ms", "unix-us", "unix-ns", "iso8601", "clock"]

#: Maximum duration of a recording without a date, s.
OF_DAY_MAX_S = 31 * 86_400.0
#: 1990-01-01 and 2100-01-01, Unix time, s.
UNIX_MIN_S, UNIX_MAX_S = 631_152_000.0, 4_102_444_800.0

#: Divisor of a number to give seconds.
DIVISOR: dict[str, float] = {
    "seconds-of-day": 1.0,
    "unix-s": 1.0,
    "unix-ms": 1e3,
    "unix-us": 1e6,
    "unix-ns": 1e9,
    "iso8601": 1.0,
    "clock": 1.0,
}

DECIMAL = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
ISO_8601 = re.compile(
    r"([0-9]{4})-([0-9]{2})-([0-9]{2})[T ]([0-9]{2}):([0-9]{2}):([0-9]{2})(?:\.([0-9]{1,9}))?"
    r"(?:Z|([+-])([0-9]{2}):?([0-9]{2}))?"
)
CLOCK = re.compile(r"([0-9]{2}):([0-9]{2}):([0-9]{2}(?:\.[0-9]{1,9})?)")


def of_day(form: TimeForm) -> bool:
    """Return whether a form has no date."""
    return form in ("seconds-of-day", "clock")


def time_form(file: str, column: str, texts: Sequence[str]) -> TimeForm:
    """Detect the form of the times of a column.

    Parameters
    ----------
    file, column : str
        Names, for messages.
    texts : sequence of str
        Text of the times of the first rows; empty ones are skipped.

    Returns
    -------
    TimeForm
        The form of the majority.

    Raises
    ------
    LayoutError
        The majority has no known form.
    """
    said = [text for text in texts if text]
    forms = Counter(_form(text) for text in said)
    best, count = forms.most_common(1)[0] if forms else (None, 0)
    if best is None or 2 * count <= len(said):
        shown = next((text for text in said if _form(text) is None), said[0] if said else "")
        msg = (
            f"{file}: expected times in the column {column!r} (seconds of day, Unix seconds to "
            f"nanoseconds, ISO 8601 or hh:mm:ss), was {shown[:40]!r}"
        )
        raise LayoutError(msg)
    return best


def _form(text: str) -> TimeForm | None:
    if ISO_8601.fullmatch(text):
        return "iso8601"
    if CLOCK.fullmatch(text):
        return "clock"
    if not DECIMAL.fullmatch(text):
        return None
    value = float(text)
    for form in ("unix-s", "unix-ms", "unix-us", "unix-ns"):
        if UNIX_MIN_S <= value / DIVISOR[form] <= UNIX_MAX_S:
            return form
    return "seconds-of-day" if 0.0 <= value <= OF_DAY_MAX_S else None
