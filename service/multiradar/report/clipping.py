"""Points beyond the limits of an axis: marked at the edge and counted."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from multiradar.report.colours import FAINT, Colour, series_colour
from multiradar.report.content import Plot, Series

Floats = NDArray[np.float64]

#: Maximum number of marks along one edge.
_MARKS_MAX = 80
#: Tolerance of the limits, as a fraction of the axis.
_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True)
class _Edge:
    # An edge of the axes: marker, and position and alignment of the note, as fractions of the axes.
    marker: str
    position: tuple[float, float]
    horizontal: str
    vertical: str


_EDGES = {
    "top": _Edge("^", (0.995, 0.975), "right", "top"),
    "bottom": _Edge("v", (0.995, 0.025), "right", "bottom"),
    "right": _Edge(">", (0.975, 0.5), "right", "center"),
    "left": _Edge("<", (0.025, 0.5), "left", "center"),
}


def mark_beyond(axes: Axes, plot: Plot, colours: Mapping[str, Colour]) -> None:
    """Mark the points of a plot beyond its axes, with their number.

    Parameters
    ----------
    axes : Axes
        With its final limits.
    plot : Plot
        What was drawn; bands and reference lines are not counted.
    colours : mapping of str to Colour
        By the key of a series.
    """
    counts = dict.fromkeys(_EDGES, 0)
    for series in plot.series:
        if series.style in {"band", "reference"}:
            continue
        x, y = np.asarray(series.x, np.float64), np.asarray(series.y, np.float64)
        for side, beyond in _beyond(axes, plot, x, y).items():
            if beyond.any():
                counts[side] += int(np.count_nonzero(beyond))
                _draw_marks(axes, side, x[beyond], y[beyond], _mark(series, colours))
    for side, count in counts.items():
        if count:
            _write_note(axes, side, count)


# Each point is beyond one edge at most: top or bottom first, then the sides.
def _beyond(axes: Axes, plot: Plot, x: Floats, y: Floats) -> dict[str, NDArray[np.bool_]]:
    west, east = _bounds(axes.get_xlim(), plot.x_scale == "log")
    south, north = _bounds(axes.get_ylim(), plot.y_scale == "log")
    known = np.isfinite(x) & np.isfinite(y)
    above, below = known & (y > north), known & (y < south)
    inside = known & ~above & ~below
    return {
        "top": above, "bottom": below, "right": inside & (x > east), "left": inside & (x < west)
    }  # fmt: skip


def _bounds(limits: tuple[float, float], logarithmic: bool) -> tuple[float, float]:
    low, high = min(limits), max(limits)
    slack = _TOLERANCE * (low if logarithmic else high - low)
    return low - slack, high + slack


def _draw_marks(axes: Axes, side: str, x: Floats, y: Floats, colour: str) -> None:
    level = side in {"top", "bottom"}
    part = _along(axes, x, 0) if level else _along(axes, y, 1)
    # One mark for adjacent points; those beyond a corner are marked there.
    marks = np.unique(np.round(part * _MARKS_MAX)) / _MARKS_MAX
    edge = np.full(len(marks), 1.0 if side in {"top", "right"} else 0.0)
    axes.plot(
        *((marks, edge) if level else (edge, marks)), _EDGES[side].marker, color=colour, ms=5.0,
        mec="none", transform=axes.transAxes, clip_on=False, zorder=3.0, label="_",
    )  # fmt: skip


# Positions along an axis, from 0 at its low end to 1; values without a logarithm at 0.
def _along(axes: Axes, values: Floats, axis: int) -> Floats:
    limits = axes.get_xlim() if axis == 0 else axes.get_ylim()
    logarithmic = (axes.get_xscale() if axis == 0 else axes.get_yscale()) == "log"
    if logarithmic:
        values, limits = np.maximum(values, min(limits)), (np.log(limits[0]), np.log(limits[1]))
        values = np.log(values)
    part: Floats = np.clip((values - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0)
    return part


def _write_note(axes: Axes, side: str, count: int) -> None:
    edge = _EDGES[side]
    axes.text(
        *edge.position, f"{count} off scale", transform=axes.transAxes, color=FAINT.mark,
        ha=edge.horizontal, va=edge.vertical, fontsize=10.0, zorder=3.0,
    )  # fmt: skip


def _mark(series: Series, colours: Mapping[str, Colour]) -> str:
    return series_colour(series, colours).mark
