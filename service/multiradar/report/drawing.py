"""Plots drawn by matplotlib on separate figures, independent of its global state."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from multiradar.report.clipping import mark_beyond
from multiradar.report.colours import (
    FAINT,
    GRID,
    INK,
    Colour,
    is_wide,
    key_of,
    series_colour,
)
from multiradar.report.content import Plot, Series
from multiradar.report.thinning import thin
from multiradar.report.time_axis import set_times

#: Inches at 72 points each: the viewBox of a single plot, of one in a group, of a single map, of a
#: map in a group.
ALONE, IN_GROUP, MAP, MAP_IN_GROUP = (11.0, 5.4), (6.4, 4.0), (8.0, 8.0), (6.4, 6.0)

#: Columns of a thinned line per inch of a figure: at most two points wide.
_COLUMNS_PER_INCH = 36

# matplotlib's line styles, and widths in points.
_DASHES = {"dashed": (0, (5, 2.2)), "dotted": (0, (1.2, 1.6)), "reference": (0, (3, 2))}
# Of solid lines in print, in turn; none of those above.
_IN_PRINT: tuple[Any, ...] = (
    "-", (0, (9, 2)), (0, (9, 2, 1.5, 2)), (0, (3, 1)), (0, (9, 2, 1.5, 2, 1.5, 2)),
    (0, (3, 1, 1, 1)),
)  # fmt: skip
_WIDTHS = {"thin": 0.9, "reference": 1.2, "track": 1.4}
_OPACITIES = {"thin": 0.55, "band": 0.16, "points": 0.75}
_LINE_WIDTH = 1.9
_FEW_POINTS = 60
_WIDE_WIDTH, _WIDE_OPACITY = 5.0, 0.45
_FONT_POINTS = 12.0


def plain_state() -> AbstractContextManager[None]:
    """Return a context with matplotlib's defaults and the settings of this module."""
    settings = {
        "svg.fonttype": "none",
        "svg.hashsalt": "multiradar",
        "path.simplify": True,
        "path.simplify_threshold": 0.25,
        "font.family": ["DejaVu Sans"],
        "font.size": _FONT_POINTS,
        "axes.unicode_minus": True,
        # Dollar signs in labels are literal.
        "text.parse_math": False,
    }
    # The backend does not affect the output, and its change would outlive the context.
    defaults = {name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"}
    return mpl.rc_context({**defaults, **settings})  # type: ignore[dict-item]


def draw_group(
    plots: Sequence[Plot],
    colours: Mapping[str, Colour],
    *,
    titled: bool = False,
    for_print: bool = False,
) -> list[Figure]:
    """Draw plots side by side, with common limits of their axes.

    Parameters
    ----------
    plots : sequence of Plot
        One plot, or several of one group.
    colours : mapping of str to Colour
        Drawing placeholders by the key of a series.
    titled : bool
        Whether title and legend are part of the picture.
    for_print : bool
        Whether solid lines differ by their dashes too, for print without colours.

    Returns
    -------
    list of Figure
        One for each plot.
    """
    size, map_size = (IN_GROUP, MAP_IN_GROUP) if len(plots) > 1 else (ALONE, MAP)
    figures = []
    for plot in plots:
        figure = Figure(figsize=map_size if plot.equal_axes else size)
        axes = figure.add_subplot()
        draw_plot(axes, plot, colours, figure.get_figwidth())
        if for_print:
            _dash(axes, plot)
        figures.append(figure)
    _share_limits([figure.axes[0] for figure in figures], plots)
    for figure, plot in zip(figures, plots, strict=True):
        mark_beyond(figure.axes[0], plot, colours)
        _finish(figure, plot, titled=titled)
    return figures


def draw_plot(axes: Axes, plot: Plot, colours: Mapping[str, Colour], width_in: float) -> None:
    """Draw the series of a plot.

    Parameters
    ----------
    axes : Axes
        Where to draw.
    plot : Plot
        The plot.
    colours : mapping of str to Colour
        Drawing placeholders by the key of a series.
    width_in : float
        Width, inches: lines are thinned to it.
    """
    columns = int(width_in * _COLUMNS_PER_INCH)
    for scale, put in ((plot.x_scale, axes.set_xscale), (plot.y_scale, axes.set_yscale)):
        if scale == "log":
            put("log", nonpositive="mask")
    for series in plot.series:
        mark = series_colour(series, colours).mark
        _draw_series(axes, thin(series, columns), mark, wide=is_wide(series, plot))
    axes.margins(x=0.0 if _runs_in_time(plot) else 0.04, y=0.06)
    if plot.equal_axes:
        axes.set_aspect("equal", adjustable="box")
    axes.autoscale_view()


# Lines in the order of the series; those of one key are alike, and the first key stays solid.
def _dash(axes: Axes, plot: Plot) -> None:
    solid = [series for series in plot.series if series.style == "line"]
    ranks = {key: rank for rank, key in enumerate(dict.fromkeys(map(key_of, solid)))}
    by_label = {series.label or "_": ranks[key_of(series)] for series in solid}
    for line in axes.lines:
        rank = by_label.get(str(line.get_label()))
        if rank is not None and line.get_linestyle() == "-" and line.get_marker() == "None":
            line.set_linestyle(_IN_PRINT[rank % len(_IN_PRINT)])


def _runs_in_time(plot: Plot) -> bool:
    drawn = [series.style for series in plot.series]
    return not plot.equal_axes and not {"points", "rings", "track"} & set(drawn)


def _draw_series(axes: Axes, series: Series, mark: str, *, wide: bool) -> None:
    label = series.label or "_"
    if series.text and len(series.x):
        axes.annotate(
            series.text, (series.x[0], series.y[0]), (6.0, 4.0), textcoords="offset points",
            color=INK.mark, fontsize=_FONT_POINTS * 0.75, zorder=2.4,
        )  # fmt: skip
    opacity = _OPACITIES.get(series.style, 1.0)
    if series.y2 is not None:
        axes.fill_between(
            series.x, series.y, series.y2, color=mark, alpha=opacity, linewidth=0.0, label=label
        )
        return
    if series.style in {"points", "rings"}:
        # A few points are table values and must be visible; many are a cloud.
        size = 6.5 if len(series.x) <= _FEW_POINTS else 3.5
        hollow = series.style == "rings"
        axes.plot(
            series.x, series.y, "o", color=mark, alpha=opacity, label=label, zorder=2.2,
            ms=size + 2.0 if hollow else size, mew=1.5 if hollow else 0.0,
            mfc="none" if hollow else mark,
        )  # fmt: skip
        return
    axes.plot(
        series.x,
        series.y,
        color=mark,
        alpha=_WIDE_OPACITY if wide else opacity,
        label=label,
        linewidth=_WIDE_WIDTH if wide else _WIDTHS.get(series.style, _LINE_WIDTH),
        linestyle=_DASHES.get(series.style, "-"),
        solid_capstyle="round",
        solid_joinstyle="round",
        zorder=1.9 if series.style in {"reference", "thin"} else 2.0,
    )
    if series.style == "track" and len(series.x):
        axes.plot(series.x[:1], series.y[:1], "o", color=mark, ms=5.0, mec="none", label="_")


def _share_limits(all_axes: Sequence[Axes], plots: Sequence[Plot]) -> None:
    # Axes with the same label are comparable; so are maps.
    pairs = list(zip(all_axes, plots, strict=True))
    for label in {plot.x_label for plot in plots}:
        _share(Axes.get_xlim, Axes.set_xlim, [a for a, plot in pairs if plot.x_label == label])
    for label in {plot.y_label for plot in plots}:
        _share(Axes.get_ylim, Axes.set_ylim, [a for a, plot in pairs if plot.y_label == label])
    for axes, plot in pairs:
        _settle_limits(axes, plot)


def _settle_limits(axes: Axes, plot: Plot) -> None:
    if plot.equal_axes:
        _make_square(axes)
    if plot.x_limits is not None:
        axes.set_xlim(*plot.x_limits)
    if plot.y_limits is not None:
        axes.set_ylim(*plot.y_limits)


def _make_square(axes: Axes) -> None:
    # Maps side by side have the same width.
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    half = max(east - west, north - south) / 2.0
    axes.set_xlim((west + east) / 2.0 - half, (west + east) / 2.0 + half)
    axes.set_ylim((south + north) / 2.0 - half, (south + north) / 2.0 + half)


def _share(
    get: Callable[[Axes], tuple[float, float]], put: Callable[..., object], same: Sequence[Axes]
) -> None:
    limits = [get(axes) for axes in same]
    for axes in same:
        put(axes, min(low for low, _ in limits), max(high for _, high in limits))


def _finish(figure: Figure, plot: Plot, *, titled: bool) -> None:
    axes = figure.axes[0]
    style_axes(axes, plot)
    # Horizontal text above the axis, for readability.
    figure.text(0.012, 1.0, plot.y_label, color=FAINT.mark, ha="left", va="top")
    top = 0.925
    if titled:
        top = _add_title_and_legend(figure, plot)
    figure.tight_layout(rect=(0.0, 0.0, 1.0, top), pad=0.6)


def finish_axes(axes: Axes, plot: Plot) -> None:
    """Set limits, ticks and label of a plot that stands alone among others.

    Parameters
    ----------
    axes : Axes
        With its series.
    plot : Plot
        The plot.
    """
    _settle_limits(axes, plot)
    style_axes(axes, plot)


def style_axes(axes: Axes, plot: Plot) -> None:
    """Set spines, grid, ticks and the label of the horizontal axis.

    Parameters
    ----------
    axes : Axes
        With its series.
    plot : Plot
        The plot.
    """
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(FAINT.mark)
    axes.grid(visible=True, color=GRID.mark, linewidth=0.9)
    axes.set_axisbelow(True)
    axes.tick_params(colors=FAINT.mark, length=0, pad=6)
    axes.tick_params(axis="x", which="major", length=4, color=FAINT.mark)
    axes.tick_params(which="minor", length=0)
    for axis, scale in ((axes.xaxis, plot.x_scale), (axes.yaxis, plot.y_scale)):
        axis.set_major_formatter(FuncFormatter(_tick_text))
        if scale == "log":
            _set_decades(axes, "x" if axis is axes.xaxis else "y")
        elif scale == "time":
            set_times(axis)
        else:
            axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 2.5, 5, 10]))
    axes.set_xlabel(plot.x_label, color=FAINT.mark, labelpad=6)


def _set_decades(axes: Axes, which: str) -> None:
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axis.get_view_interval()
    decades = np.log10(high / low)
    # A few decades need intermediate ticks; many decades do not need a tick each.
    subs = (1.0,) if decades > 2.2 else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=subs, numticks=9))
    axis.set_minor_formatter(NullFormatter())


def _tick_text(value: float, _position: int | None = None) -> str:
    if value != 0.0 and (abs(value) >= 1e6 or abs(value) < 1e-5):
        return f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    return f"{value:.10g}".replace("-", "−")


def _add_title_and_legend(figure: Figure, plot: Plot) -> float:
    title = f"{plot.title} – {plot.group}" if plot.group else plot.title
    height = figure.get_figheight() * 72.0
    figure.texts[-1].set_y(1.0 - 34.0 / height)
    figure.text(
        0.012, 1.0 - 4.0 / height, title, color=INK.mark, ha="left", va="top",
        fontsize=_FONT_POINTS * 1.2, fontweight="bold",
    )  # fmt: skip
    handles, labels = figure.axes[0].get_legend_handles_labels()
    unique = {label: handle for handle, label in zip(handles, labels, strict=True)}
    if unique:
        figure.axes[0].legend(
            list(unique.values()), list(unique), loc="upper left", bbox_to_anchor=(1.01, 1.0),
            frameon=False, labelcolor=INK.mark, fontsize=_FONT_POINTS * 0.9, borderaxespad=0.0,
        )  # fmt: skip
    return 1.0 - 54.0 / height
