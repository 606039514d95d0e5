"""The tables and notes of a study in the terminal."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from multiradar.studies.report.cells import numeric_columns, table_texts
from multiradar.studies.result import StudyResult
from multiradar.studies.result import Table as StudyTable


def print_study(result: StudyResult, console: Console) -> None:
    """Print what a study found: its tables, then its notes.

    Parameters
    ----------
    result : StudyResult
        What it found.
    console : Console
        Where to print.
    """
    console.print(Text(result.title, style="bold"))
    if result.summary:
        console.print(Text(result.summary))
    for table in result.tables:
        console.print()
        console.print(_drawn(table))
        if table.caption:
            console.print(Text(table.caption, style="dim"))
    if result.notes:
        console.print()
    for note in result.notes:
        console.print(Text(f"* {note}"))


def _drawn(table: StudyTable) -> Table:
    drawn = Table(title=Text(table.title, style="bold"), title_justify="left", box=None)
    for name, numeric in zip(table.header, numeric_columns(table), strict=True):
        drawn.add_column(Text(name), justify="right" if numeric else "left")
    for row in table_texts(table):
        drawn.add_row(*map(Text, row))
    return drawn
