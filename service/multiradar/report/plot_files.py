"""A plot as a file of its own, SVG or PDF, for documents and papers."""

import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from multiradar.report.colours import ALL, assign_colours
from multiradar.report.content import Plot
from multiradar.report.drawing import draw_group, plain_state
from multiradar.report.svg import standalone_svg

#: From the first "symbol = value" of a title on: no letters of a file name.
_SETTING = re.compile(r"[:,(]?\s*\S+\s*=.*")


def plot_svg(plots: Sequence[Plot], plot: Plot, *, for_print: bool = False) -> str:
    """Return a plot of a report as a separate SVG file, with title and legend.

    Parameters
    ----------
    plots : sequence of Plot
        All plots of the report, for common colours.
    plot : Plot
        One of its plots.
    for_print : bool
        Whether lines differ by their dashes too, for print without colours.

    Returns
    -------
    str
        The text of the file, reproducible.
    """
    with plain_state():
        return standalone_svg(_drawn(plots, plot, for_print), plot.title)


def write_plots(plots: Sequence[Plot], folder: Path) -> list[str]:
    """Write each plot for print, as SVG and as PDF.

    Parameters
    ----------
    plots : sequence of Plot
        All plots of a report, in its order.
    folder : Path
        Where to; it exists.

    Returns
    -------
    list of str
        Base names of the files: number in the report, and name of the plot, or its title without
        values.
    """
    names = []
    for number, plot in enumerate(plots, start=1):
        words = plot.name or _SETTING.sub("", plot.title)
        name = re.sub(r"[^a-z0-9]+", "-", words.lower()).strip("-")
        names.append(f"{number:03d}-{name}")
        svg, pdf = (folder / f"{names[-1]}.{kind}" for kind in ("svg", "pdf"))
        svg.write_text(plot_svg(plots, plot, for_print=True), encoding="utf-8")
        pdf.write_bytes(_pdf(plots, plot))
    return names


def recolour(figure: Figure) -> None:
    """Replace the placeholders of `multiradar.report.colours` by the colours on white.

    Parameters
    ----------
    figure : Figure
        Drawn with the placeholders; changed.
    """
    for artist in figure.findobj():
        _recolour(artist)


def _drawn(plots: Sequence[Plot], plot: Plot, for_print: bool) -> Figure:
    return draw_group([plot], assign_colours(plots), titled=True, for_print=for_print)[0]


def _pdf(plots: Sequence[Plot], plot: Plot) -> bytes:
    buffer = io.BytesIO()
    # Type 42: text remains text, with the font in the file.
    with plain_state(), mpl.rc_context({"pdf.fonttype": 42}):
        figure = _drawn(plots, plot, for_print=True)
        # Ticks are made when the figure is drawn.
        figure.draw_without_rendering()
        recolour(figure)
        metadata = {"Title": plot.title, "CreationDate": None, "Producer": None, "Creator": None}
        figure.savefig(buffer, format="pdf", bbox_inches="tight", metadata=metadata)
    return buffer.getvalue()


_SHOWN = {one.mark: one.light for one in ALL}


def _recolour(artist: Artist) -> None:
    for part in ("color", "facecolor", "edgecolor", "markerfacecolor", "markeredgecolor"):
        get, put = getattr(artist, f"get_{part}", None), getattr(artist, f"set_{part}", None)
        if get is None or put is None:
            continue
        found = _hex(get())
        if found in _SHOWN:
            put(_SHOWN[found])


# A colour, or the first of several, as a hexadecimal text; None without one.
def _hex(colour: Any) -> str | None:
    if isinstance(colour, str):
        return colour
    found = np.asarray(colour)
    if found.dtype.kind != "f" or not found.size:
        return None
    return to_hex(tuple(found if found.ndim == 1 else found[0]))
