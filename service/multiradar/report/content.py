"""What a report holds: tables and plots for readers, with titles, captions and notes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

#: A value of a row or of a table's cell; None where there is none.
Value = float | str | bool | None

#: How a series is drawn: ``line`` solid, ``dashed``, ``dotted``, ``thin`` (one run of many, faint),
#: ``band`` (filled from `y` to `y2`, faint), ``points``, ``rings`` (hollow
#: points), ``track`` (solid, its start marked),
#: ``reference`` (thin and grey: what is expected).
Style = Literal["line", "dashed", "dotted", "thin", "band", "points", "rings", "track", "reference"]
#: ``time`` is linear, with data times of day for marks.
Scale = Literal["linear", "log", "time"]


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """A line, band or cloud of points of a plot.

    Attributes
    ----------
    label : str
        Name in the legend; empty for none. Series of one label share one entry.
    x, y : array, shape (n,)
        Points in the units of the plot's axes; NaN leaves a gap.
    style : Style
        How it is drawn.
    y2 : array, shape (n,), optional
        The other edge of a band; a band needs it, nothing else has it.
    key : str
        Series of one key have one colour in all plots of a report, such as the name of a filter;
        empty takes the label. The key ``ink`` is the colour of text, such as for theory; the line
        of the key ``joint`` is drawn wide and pale, so that one that equals it is seen on it.

    Raises
    ------
    ValueError
        Shapes differ, or `y2` and the style do not go together.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: Style = "line"
    y2: NDArray[np.float64] | None = None
    key: str = ""

    def __post_init__(self) -> None:
        shapes = [np.shape(values) for values in (self.x, self.y, self.y2) if values is not None]
        if len(shapes[0]) != 1 or len(set(shapes)) != 1:
            msg = f"series {self.label!r}: expected arrays of one length, was {shapes}"
            raise ValueError(msg)
        if (self.y2 is not None) != (self.style == "band"):
            msg = f"series {self.label!r}: expected y2 for a band and for nothing else"
            raise ValueError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class Plot:
    """One pair of axes with what is drawn in it.

    Attributes
    ----------
    title, x_label, y_label, caption : str
        Texts; the labels carry the unit, the caption says what to see. Plain text.
    series : tuple of Series
        Drawn in this order.
    x_scale, y_scale : Scale
        Logarithmic where values span decades; what is not positive is left out then. Data times
        are shown as times of day; `multiradar.report.times.axis_label` names their axis.
    equal_axes : bool
        Whether a metre is as long on both axes, as on a map.
    group : str
        Heading of a group: plots of one group that follow each other stand side by side with one
        legend, and with the same limits where axes have the same label. Empty stands alone.
    x_limits, y_limits : tuple of float, optional
        Ends of the axes; None takes those of the series. Points beyond them are marked at the edge
        and counted.
    name : str
        Name of the picture's file where the plot is written to one, such as ``range-bias``.
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
        As long as the header. A float is shown with three significant digits (a column of round
        values, such as times, as short as they are), None and what is not finite as a dash, True
        and False as yes and no; a string is shown as it is.

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
                msg = f"table {self.title!r}: expected {len(self.header)} cells, was {row}"
                raise ValueError(msg)


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """What a page shows, in its order: main table, plots, further tables, notes.

    Attributes
    ----------
    title, summary : str
        Heading and one paragraph below it; plain text. The summary may be empty.
    command : str
        The command line that makes the same again.
    tables : sequence of Table
        The first is the main one.
    plots : sequence of Plot
        The first is the main one.
    notes : sequence of str
        Readings, limits and what to see, one plain paragraph each.
    """

    title: str
    summary: str
    command: str
    tables: Sequence[Table]
    plots: Sequence[Plot]
    notes: Sequence[str] = ()
