"""A table as Markdown and a plot as an SVG file: for documents kept beside the code."""

from collections.abc import Iterable

from multiradar.studies.report.cells import numeric_columns, table_texts
from multiradar.studies.report.colours import assign_colours
from multiradar.studies.report.drawing import draw_group, plain_state
from multiradar.studies.report.svg import standalone_svg
from multiradar.studies.result import Plot, StudyResult, Table


def markdown_table(table: Table) -> str:
    """Return a table as GitHub's Markdown, its caption below.

    Parameters
    ----------
    table : Table
        Its title is left to the document.

    Returns
    -------
    str
        Lines, the last one ended.
    """
    ruler = ("---:" if numeric else "---" for numeric in numeric_columns(table))
    lines = [_line(table.header), "|" + "|".join(ruler) + "|"]
    lines += [_line(row) for row in table_texts(table)]
    if table.caption:
        lines += ["", table.caption]
    return "\n".join(lines) + "\n"


def plot_svg(result: StudyResult, plot: Plot) -> str:
    """Return a plot of a result as an SVG file of its own, with title and legend.

    Parameters
    ----------
    result : StudyResult
        Its colours are those of the whole report.
    plot : Plot
        One of its plots.

    Returns
    -------
    str
        The text of the file, the same for the same result.
    """
    with plain_state():
        figure = draw_group([plot], assign_colours(result.plots), titled=True)[0]
        return standalone_svg(figure, plot.title)


def _line(cells: Iterable[str]) -> str:
    told = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "| " + " | ".join(told) + " |"
