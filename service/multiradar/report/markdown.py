"""A table as Markdown and a plot as an SVG file, for documents in the repository."""

from collections.abc import Iterable, Sequence

from multiradar.report.cells import numeric_columns, table_texts
from multiradar.report.colours import assign_colours
from multiradar.report.content import Plot, Table
from multiradar.report.drawing import draw_group, plain_state
from multiradar.report.svg import standalone_svg


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


def plot_svg(plots: Sequence[Plot], plot: Plot) -> str:
    """Return a plot of a report as a separate SVG file, with title and legend.

    Parameters
    ----------
    plots : sequence of Plot
        All plots of the report, for common colours.
    plot : Plot
        One of its plots.

    Returns
    -------
    str
        The text of the file, reproducible.
    """
    with plain_state():
        figure = draw_group([plot], assign_colours(plots), titled=True)[0]
        return standalone_svg(figure, plot.title)


def _line(cells: Iterable[str]) -> str:
    escaped = (cell.replace("|", "\\|").replace("\n", " ") for cell in cells)
    return "| " + " | ".join(escaped) + " |"
