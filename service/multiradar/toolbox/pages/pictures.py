"""Plots of reports as one figure of matplotlib, for scripts and notebooks."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from multiradar.errors import ArgumentError
from multiradar.report.colours import FAINT, GRID, Colour, assign_colours
from multiradar.report.content import Plot
from multiradar.report.drawing import draw_plot, finish_axes, plain_state
from multiradar.report.plot_files import recolour
from multiradar_schemas.documents.names import unknown

#: Inches of one plot.
_WIDTH, _HEIGHT = 6.4, 3.6
_MAP_HEIGHT = 6.4


def picture(plots: Sequence[Plot], names: Sequence[str] = ()) -> Figure:
    """Draw plots as one figure, maps first, two in a row, each with title and legend.

    Parameters
    ----------
    plots : sequence of Plot
        All plots.
    names : sequence of str
        Names of those to draw; all by default.

    Returns
    -------
    Figure
        Independent of pyplot.

    Raises
    ------
    ArgumentError
        There is no plot of this name, or none at all.
    """
    by_name = {plot.name: plot for plot in plots}
    for name in names:
        if name not in by_name:
            raise ArgumentError(unknown("plot", name, by_name))
    chosen = [by_name[name] for name in names] or list(plots)
    if not chosen:
        raise ArgumentError("nothing to plot: no confirmed tracks")
    maps = [plot for plot in chosen if plot.equal_axes]
    others = [plot for plot in chosen if not plot.equal_axes]
    columns = min(max(len(maps), len(others)), 2)
    rows = [
        some[start : start + columns]
        for some in (maps, others)
        for start in range(0, len(some), columns)
    ]
    heights = [_MAP_HEIGHT if any(one.equal_axes for one in row) else _HEIGHT for row in rows]
    colours = {key: _light(colour) for key, colour in assign_colours(plots).items()}
    with plain_state():
        figure = _Picture(figsize=(_WIDTH * columns, sum(heights)), layout="constrained")
        grid = figure.add_gridspec(len(rows), columns, height_ratios=heights)
        for at, row in enumerate(rows):
            for column, plot in enumerate(row):
                # A plot alone in its row has all of it.
                cells = slice(None) if len(row) == 1 else column
                _draw(figure.add_subplot(grid[at, cells]), plot, colours)
        recolour(figure)
    return figure


class _Picture(Figure):
    # Notebooks show it by this method, and plain figures only once pyplot has drawn one.
    def _repr_png_(self) -> bytes:
        shown = io.BytesIO()
        self.savefig(shown, format="png")
        return shown.getvalue()


def _light(colour: Colour) -> Colour:
    return replace(colour, mark=colour.light)


def _draw(axes: Axes, plot: Plot, colours: Mapping[str, Colour]) -> None:
    draw_plot(axes, plot, colours, _WIDTH)
    finish_axes(axes, plot)
    # Ticks are made when the figure is drawn.
    axes.tick_params(which="both", colors=FAINT.light)
    axes.grid(color=GRID.light)
    axes.set_title(plot.title, loc="left")
    axes.set_ylabel(plot.y_label)
    handles, labels = axes.get_legend_handles_labels()
    unique = {label: handle for handle, label in zip(handles, labels, strict=True)}
    if unique:
        # Points may fill the whole plot: the legend is legible over them.
        axes.legend(
            list(unique.values()), list(unique), fontsize="small", framealpha=0.85, edgecolor="none"
        )
