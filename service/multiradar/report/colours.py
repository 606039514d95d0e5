"""Colours of a report, light and dark, consistent for each filter in every plot."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from multiradar.report.content import Plot, Series


@dataclass(frozen=True, slots=True)
class Colour:
    """A colour of a report.

    Attributes
    ----------
    mark : str
        Placeholder for drawing with matplotlib, replaced afterwards.
    variable : str
        Name of the CSS variable.
    light, dark : str
        The colour on white and on black, with a contrast of at least 3:1.
    """

    mark: str
    variable: str
    light: str
    dark: str


INK = Colour("#0a0b00", "--ink", "#1f2933", "#e6eaef")
FAINT = Colour("#0a0b01", "--faint", "#5f6c7b", "#9aa5b1")
GRID = Colour("#0a0b02", "--grid", "#e3e7ec", "#323a44")
PAPER = Colour("#0a0b03", "--paper", "#ffffff", "#14181d")

#: Colours of series, distinguishable for the colour-blind.
PALETTE = tuple(
    Colour(f"#0a0b{16 + index:02x}", f"--series-{index}", light, dark)
    for index, (light, dark) in enumerate(
        (
            ("#1c63d0", "#6ea8ff"),
            ("#d1481c", "#ff8a5c"),
            ("#157a48", "#4cc38a"),
            ("#7d3cb8", "#c49bff"),
            ("#9a6700", "#e3b341"),
            ("#0b7f8c", "#45c6d4"),
            ("#c2257a", "#ff7ab8"),
            ("#4a5563", "#b4bec9"),
        )
    )
)
ALL = (INK, FAINT, GRID, PAPER, *PALETTE)

#: Key of series in the colour of text, such as theory behind coloured results.
INK_KEY = "ink"
#: The reference filter is drawn wide and pale, so that coinciding lines stay visible.
WIDE_KEY = "joint"

#: Filters have the same colours in all studies.
_FILTERS = {"two-stage": 0, "blom": 1, "ci": 3, "blom-macro": 4, "joint": 7}


def key_of(series: Series) -> str:
    """Return the colour key of a series."""
    return series.key or series.label


def assign_colours(plots: Iterable[Plot]) -> Mapping[str, Colour]:
    """Assign a colour to each key of the plots: fixed for filters, others in order.

    Parameters
    ----------
    plots : iterable of Plot
        All plots of a report, in order.

    Returns
    -------
    mapping of str to Colour
        By key; colours repeat if there are more keys than colours.
    """
    keys = dict.fromkeys(
        key_of(series) for plot in plots for series in plot.series if _is_coloured(series)
    )
    used = {_FILTERS[key] for key in keys if key in _FILTERS}
    free = [index for index in range(len(PALETTE)) if index not in used]
    free = free or list(range(len(PALETTE)))
    others = [key for key in keys if key not in _FILTERS]
    chosen = {key: _FILTERS[key] for key in keys if key in _FILTERS}
    chosen |= {key: free[rank % len(free)] for rank, key in enumerate(others)}
    return {key: PALETTE[index] for key, index in chosen.items()}


def series_colour(series: Series, colours: Mapping[str, Colour]) -> Colour:
    """Return the colour of a series; reference lines are grey, theory may have that of text."""
    if series.style == "reference":
        return FAINT
    return INK if series.key == INK_KEY else colours[key_of(series)]


def is_wide(series: Series, plot: Plot) -> bool:
    """Return whether a series is the line of the reference filter among others."""
    compared = {key_of(one) for one in plot.series if _is_coloured(one) and one.style == "line"}
    return key_of(series) == WIDE_KEY and series.style == "line" and len(compared) > 1


def _is_coloured(series: Series) -> bool:
    return series.style != "reference" and series.key != INK_KEY
