"""A table as Markdown, for documents in the repository."""

from collections.abc import Iterable

from multiradar.report.cells import numeric_columns, table_texts
from multiradar.report.content import Table


def markdown_table(table: Table) -> str:
    """Return a table as GitHub Markdown, with its caption below.

    Parameters
    ----------
    table : Table
        Its title is left to the document.

    Returns
    -------
    str
        Lines, with a final newline.
    """
    ruler = ("---:" if numeric else "---" for numeric in numeric_columns(table))
    lines = [_line(table.header), "|" + "|".join(ruler) + "|"]
    lines += [_line(row) for row in table_texts(table)]
    if table.caption:
        lines += ["", table.caption]
    return "\n".join(lines) + "\n"


def _line(cells: Iterable[str]) -> str:
    escaped = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "| " + " | ".join(escaped) + " |"
