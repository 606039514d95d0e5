"""Contents of a report: tables and plots with titles, captions and notes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

#: A value of a row or of a table's cell; None if missing.
Value = float | str | bool | None

#: Style of a series: ``line`` solid, ``dashed``, ``dotted``, ``thin`` (one run of many, faint),
#: ``band`` (filled from `y` to `y2`, faint), ``points``, ``rings`` (hollow points), ``track``
#: (solid, its start marked), ``reference`` (thin and grey: expected values).
Style = Literal["line", "dashed", "dotted", "thin", "band", "points", "rings", "track", "reference"]
#: ``time`` is linear, with ticks at times of day.
Scale = Literal["linear", "log", "time"]


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A line, band or cloud of points of a plot.

    Attributes
    ----------
    label : str
        Name in the legend; empty for none. Series with the same label share one entry.
    x, y : array, shape (n,)
        Points in the units of the plot's axes; NaN leaves a gap.
    style : Style
        Style of the series.
    y2 : array, shape (n,), optional
        The other edge of a band; for bands only.
    key : str
        Series with the same key have the same colour in all plots of a report, such as the name
        of a filter; by default the label. The key ``ink`` is the colour of text, such as for
        theory; the line of the key ``joint`` is wide and pale, so that coinciding lines show.
    text : str
        Text beside the first point, such as the name of a site; empty for none.

    Raises
    ------
    ValueError
        Shapes differ, or `y2` and the style do not match.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: Style = "line"
    y2: NDArray[np.float64] | None = None
    key: str = ""
    text: str = ""

    def __post_init__(self) -> None:
        shapes = [np.shape(values) for values in (self.x, self.y, self.y2) if values is not None]
        if len(shapes[0]) != 1 or len(set(shapes)) != 1:
            msg = f"series {self.label!r}: expected arrays of equal length, found {shapes}"
            raise ValueError(msg)
        if (self.y2 is not None) != (self.style == "band"):
            msg = f"series {self.label!r}: expected y2 for a band, and for no other style"
            raise ValueError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class Plot:
    """One pair of axes with its series.

    Attributes
    ----------
    title, x_label, y_label, caption : str
        Plain text; labels include the unit, the caption says what to look for.
    series : tuple of Series
        Drawn in this order.
    x_scale, y_scale : Scale
        Logarithmic where values span decades; non-positive values are then left out. Data times
        are shown as times of day; see `multiradar.report.times.axis_label` for the label.
    equal_axes : bool
        Whether both axes have the same scale, as on a map.
    group : str
        Heading of a group: consecutive plots of one group are shown side by side with one legend,
        and with common limits of axes with the same label. Empty: the plot stands alone.
    x_limits, y_limits : tuple of float, optional
        Limits of the axes; None for those of the series. Points beyond them are marked at the edge
        and counted.
    name : str
        Base name of the file of the plot, such as ``range-bias``.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    x_scale: Scale = "linear"
    y_scale: Scale = "linear"
    equal_axes: bool = False
    caption: str = ""
    group: str = ""
    x_limits: tuple[float, float] | None = None
    y_limits: tuple[float, float] | None = None
    name: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """A table for readers.

    Attributes
    ----------
    title, caption : str
        Plain text.
    header : tuple of str
        Names of the columns, with units.
    rows : tuple of tuples
        Of the length of the header. Floats have three significant digits (columns of round values,
        such as times, only the digits needed), None and non-finite values are a dash, True and
        False yes and no; strings are shown unchanged.

    Raises
    ------
    ValueError
        A row is longer or shorter than the header.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]
    caption: str = ""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.header):
                msg = f"table {self.title!r}: expected {len(self.header)} cells, found {row}"
                raise ValueError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """Contents of a page, in order: main table, plots, further tables, notes.

    Attributes
    ----------
    title, summary : str
        Heading and one paragraph below it; plain text. The summary may be empty.
    command : str
        The command line that reproduces it.
    tables : sequence of Table
        The first is the main one.
    plots : sequence of Plot
        The first is the main one.
    notes : sequence of str
        Readings, limits and findings, one plain paragraph each.
    """

    title: str
    summary: str
    command: str
    tables: Sequence[Table]
    plots: Sequence[Plot]
    notes: Sequence[str] = ()
