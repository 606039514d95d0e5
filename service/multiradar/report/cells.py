"""Cells of a table as text, the same in the terminal, in HTML and in Markdown."""

import math
import re

from multiradar.report.content import Table, Value

#: What stands where there is no value.
NONE = "–"
_NOTHING = 1e-9
_SIGMA_DIGITS = 2

# Numbers, also several of them: a range, a value with its error.
_NUMBER = re.compile(r"(?=.*\d)[-+−±\d\s.,…–e%°()<>≤≥]+")


def table_texts(table: Table) -> list[list[str]]:
    """Return the cells of a table as they are shown, row by row.

    Parameters
    ----------
    table : Table
        Its columns of floats that need no more than two digits, such as a time or a noise that was
        chosen, are shown without zeros behind; others with three significant digits.

    Returns
    -------
    list of list of str
        As long as the rows and the header.
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
    # Nobody chooses 0.187; a result that is 0.20 by chance is not all of its column.
    floats = [value for value in column if isinstance(value, float)]
    return all(
        abs(value) < 1e5 and (value.is_integer() or float(f"{value:.2g}") == value)
        for value in floats
    )


def cell_text(value: Value) -> str:
    """Return a value as a table shows it.

    Parameters
    ----------
    value : float, str, bool or None
        A float is given three significant digits, a whole number all of them.

    Returns
    -------
    str
        A dash for None and for what is not finite.
    """
    if value is None:
        return NONE
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) if isinstance(value, int) else number_text(float(value))


def number_text(number: float, digits: int = 3) -> str:
    """Return a number with so many significant digits, all of those before its point kept.

    Parameters
    ----------
    number : float
        Any; a dash stands for what is not finite.
    digits : int
        Significant digits.

    Returns
    -------
    str
        Never with an exponent: readers of tables compare digits, not powers. What is smaller than
        1e-9 is the rounding of a computation and shown as 0.
    """
    if not math.isfinite(number):
        return NONE
    if abs(number) < _NOTHING:
        return "0"
    exponent = int(f"{number:.{digits - 1}e}".partition("e")[2])
    return f"{number:.{max(0, digits - 1 - exponent)}f}"


def plain_text(number: float, digits: int = 6) -> str:
    """Return a number as `number_text` does, without zeros at the end of its decimals."""
    text = number_text(number, digits)
    return text.rstrip("0").rstrip(".") if "." in text else text


def estimate_texts(estimate: float, sigma: float) -> tuple[str, str]:
    """Return an estimate and its standard deviation, both to the second digit of the latter."""
    if not (math.isfinite(sigma) and sigma > _NOTHING):
        return plain_text(estimate), number_text(sigma)
    exponent = int(f"{sigma:.{_SIGMA_DIGITS - 1}e}".partition("e")[2])
    decimals = max(0, _SIGMA_DIGITS - 1 - exponent)
    return f"{estimate:.{decimals}f}", f"{sigma:.{decimals}f}"


def numeric_columns(table: Table) -> tuple[bool, ...]:
    """Return for each column whether it holds numbers, which stand to the right."""
    return tuple(_numeric([row[i] for row in table.rows]) for i in range(len(table.header)))


def _numeric(column: list[Value]) -> bool:
    texts = [cell_text(value) for value in column if not isinstance(value, bool)]
    told = [text for text in texts if text not in {NONE, ""}]
    return bool(told) and all(_NUMBER.fullmatch(text) for text in told)
