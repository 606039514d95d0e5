"""The tables and notes of a report in the terminal."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from multiradar.report.cells import numeric_columns, table_texts
from multiradar.report.content import Document
from multiradar.report.content import Table as ReportTable


def print_document(document: Document, console: Console) -> None:
    """Print a report: its tables, then its notes.

    Parameters
    ----------
    document : Document
        The report; its plots are omitted.
    console : Console
        Where to print.
    """
    console.print(Text(document.title, style="bold"))
    if document.summary:
        console.print(Text(document.summary))
    for table in document.tables:
        console.print()
        console.print(_drawn(table))
        if table.caption:
            console.print(Text(table.caption, style="dim"))
    if document.notes:
        console.print()
    for note in document.notes:
        console.print(Text(f"* {note}"))


def _drawn(table: ReportTable) -> Table:
    drawn = Table(title=Text(table.title, style="bold"), title_justify="left", box=None)
    for name, numeric in zip(table.header, numeric_columns(table), strict=True):
        drawn.add_column(Text(name), justify="right" if numeric else "left")
    for row in table_texts(table):
        drawn.add_row(*map(Text, row))
    return drawn
