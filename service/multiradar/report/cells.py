"""Cells of a table as text, identical in the terminal, in HTML and in Markdown."""

import math
import re

from multiradar.report.content import Table, Value

#: Text of a missing value.
NONE = "–"
_NOTHING = 1e-9
_SIGMA_DIGITS = 2

# Numbers, also combined: a range, a value with its error.
_NUMBER = re.compile(r"(?=.*\d)[-+−±\d\s.,…–e%°()<>≤≥]+")


def table_texts(table: Table) -> list[list[str]]:
    """Return the cells of a table as text, row by row.

    Parameters
    ----------
    table : Table
        Columns of floats that need at most two digits, such as a time or a configured noise, are
        shown without trailing zeros; others with three significant digits.

    Returns
    -------
    list of list of str
        Of the shape of the rows and the header.
    """
    chosen = [_is_chosen([row[i] for row in table.rows]) for i in range(len(table.header))]
    return [
        [
            plain_text(value) if short and isinstance(value, float) else cell_text(value)
            for value, short in zip(row, chosen, strict=True)
        ]
        for row in table.rows
    ]


def _is_chosen(column: list[Value]) -> bool:
    # Configured values are round; in a column of results at least one is not.
    floats = [value for value in column if isinstance(value, float)]
    return all(
        abs(value) < 1e5 and (value.is_integer() or float(f"{value:.2g}") == value)
        for value in floats
    )


def cell_text(value: Value) -> str:
    """Return a value as text.

    Parameters
    ----------
    value : float, str, bool or None
        Floats have three significant digits, integers all of them.

    Returns
    -------
    str
        A dash for None and for non-finite numbers.
    """
    if value is None:
        return NONE
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) if isinstance(value, int) else number_text(float(value))


def number_text(number: float, digits: int = 3) -> str:
    """Return a number with the given significant digits, and all digits before the point.

    Parameters
    ----------
    number : float
        Any; a dash for a non-finite one.
    digits : int
        Significant digits.

    Returns
    -------
    str
        Without exponent, so that digits can be compared. Below 1e-9 it is rounding of a
        computation and shown as 0.
    """
    if not math.isfinite(number):
        return NONE
    if abs(number) < _NOTHING:
        return "0"
    exponent = int(f"{number:.{digits - 1}e}".partition("e")[2])
    return f"{number:.{max(0, digits - 1 - exponent)}f}"


def plain_text(number: float, digits: int = 6) -> str:
    """Return a number like `number_text`, without trailing zeros of its decimals."""
    text = number_text(number, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text


def estimate_texts(estimate: float, sigma: float) -> tuple[str, str]:
    """Return an estimate and its standard deviation, to the second digit of the latter."""
    if not (math.isfinite(sigma) and sigma > _NOTHING):
        return plain_text(estimate), number_text(sigma)
    exponent = int(f"{sigma:.{_SIGMA_DIGITS - 1}e}".partition("e")[2])
    decimals = max(0, _SIGMA_DIGITS - 1 - exponent)
    return f"{estimate:.{decimals}f}", f"{sigma:.{decimals}f}"


def numeric_columns(table: Table) -> tuple[bool, ...]:
    """Return for each column whether it is numeric, and so right-aligned."""
    return tuple(_numeric([row[i] for row in table.rows]) for i in range(len(table.header)))


def _numeric(column: list[Value]) -> bool:
    texts = [cell_text(value) for value in column if not isinstance(value, bool)]
    shown = [text for text in texts if text not in {NONE, ""}]
    return bool(shown) and all(_NUMBER.fullmatch(text) for text in shown)
