"""The legend of plots as HTML, which wraps on narrow screens."""

import html
from collections.abc import Iterable, Mapping

from multiradar.report.colours import FAINT, Colour, is_wide, series_colour
from multiradar.report.content import Plot, Series

# Line samples, as SVG attributes.
_LINES = {
    "line": 'stroke-width="2.5"',
    "wide": 'stroke-width="6" stroke-opacity="0.45"',
    "track": 'stroke-width="2"',
    "thin": 'stroke-width="1.2" stroke-opacity="0.55"',
    "dashed": 'stroke-width="2.5" stroke-dasharray="7 3.5"',
    "dotted": 'stroke-width="2.5" stroke-dasharray="2 2.6"',
    "reference": 'stroke-width="1.5" stroke-dasharray="4 3"',
}


def legend_html(plots: Iterable[Plot], colours: Mapping[str, Colour]) -> str:
    """Return the common legend of plots.

    Parameters
    ----------
    plots : iterable of Plot
        Each label is listed once.
    colours : mapping of str to Colour
        By the key of a series.

    Returns
    -------
    str
        A list; empty without labelled series.
    """
    labelled: dict[str, tuple[Series, Colour, bool]] = {}
    for plot in plots:
        for series in (one for one in plot.series if one.label):
            entry = series, series_colour(series, colours), is_wide(series, plot)
            first, known, wide = labelled.setdefault(series.label, entry)
            if known is not entry[1]:
                # The same label in several colours: only its style is significant.
                labelled[series.label] = first, FAINT, wide
    entries = "".join(_entry(*entry) for entry in labelled.values())
    return f'<ul class="legend">{entries}</ul>\n' if entries else ""


def _entry(series: Series, colour: Colour, wide: bool) -> str:
    paint = f"var({colour.variable})"
    if series.style == "band":
        sample = f'<rect y="2" width="28" height="10" style="fill:{paint}" fill-opacity="0.25"/>'
    elif series.style == "points":
        sample = f'<circle cx="14" cy="7" r="4" style="fill:{paint}"/>'
    elif series.style == "rings":
        ring = 'fill="none" stroke-width="1.8"'
        sample = f'<circle cx="14" cy="7" r="5" style="stroke:{paint}" {ring}/>'
    else:
        line = _LINES["wide" if wide else series.style]
        sample = f'<path d="M1 7H27" style="stroke:{paint}" {line}/>'
    picture = f'<svg viewBox="0 0 28 14" width="28" height="14" aria-hidden="true">{sample}</svg>'
    return f"<li>{picture}{html.escape(series.label)}</li>"
