"""Cells of a table as text, the same in the terminal, in HTML and in Markdown."""

import math
import re

from multiradar.report.content import Table, Value

#: What stands where there is no value.
NONE = "–"

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
            f"{value:g}" if short and isinstance(value, float) else cell_text(value)
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


def number_text(number: float) -> str:
    """Return a number with three significant digits, all of them before the point."""
    if not math.isfinite(number):
        return NONE
    size = abs(number)
    if size == 0.0:
        return "0"
    if size < 1e-4 or size >= 1e7:
        mantissa, _, exponent = f"{number:.1e}".partition("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{number:.0f}" if size >= 99.95 else f"{number:#.3g}"


def numeric_columns(table: Table) -> tuple[bool, ...]:
    """Return for each column whether it holds numbers, which stand to the right."""
    return tuple(_numeric([row[i] for row in table.rows]) for i in range(len(table.header)))


def _numeric(column: list[Value]) -> bool:
    texts = [cell_text(value) for value in column if not isinstance(value, bool)]
    told = [text for text in texts if text not in {NONE, ""}]
    return bool(told) and all(_NUMBER.fullmatch(text) for text in told)
