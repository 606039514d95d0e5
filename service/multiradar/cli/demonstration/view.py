"""What the demo shows: tracks, and biases settling against the truth."""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from multiradar.report.times import clock_text as time_of_day

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

_BARS = "▁▂▃▄▅▆▇█"
_TREND_WIDTH = 13
_CELL_WIDTH = 17
_PLAIN_DIGITS_MAX = 3
#: An estimate farther from the truth than this many sigmas is shown in another colour.
_COVERED_SIGMAS = 2.0
_NAMES = {
    "range_offset_m": ("range", "m", 1),
    "azimuth_offset_deg": ("azimuth", "°", 4),
    "range_gain": ("range gain", "", 6),
    "time_offset_s": ("time", "s", 4),
}


@dataclass(slots=True)
class BiasLine:
    """One bias as it settles.

    Attributes
    ----------
    sensor, parameter : str
        The sensor and the parameter.
    truth : float or None
        Its true value.
    estimate, sigma : float or None
        Current estimate; None before the first epoch.
    sigmas : list of float
        Sigma at every poll, oldest first.
    """

    sensor: str
    parameter: str
    truth: float | None
    estimate: float | None = None
    sigma: float | None = None
    sigmas: list[float] = field(default_factory=list)

    def update(self, estimate: float, sigma: float) -> None:
        """Set the current estimate."""
        self.estimate, self.sigma = estimate, sigma
        self.sigmas.append(sigma)

    @property
    def error(self) -> float | None:
        """Estimate minus truth."""
        if self.estimate is None or self.truth is None:
            return None
        return self.estimate - self.truth


@dataclass(slots=True)
class View:
    """The contents of the display.

    Attributes
    ----------
    total : int
        Plots in the recording.
    lines : list of BiasLine
        The biases.
    sent, tracks, tracks_confirmed, tracks_initiated : int
        Plots acknowledged; confirmed tracks now; confirmed tracks so far; all tracks so far.
    data_time_s : float or None
        Current data time.
    """

    total: int
    lines: list[BiasLine]
    sent: int = 0
    tracks: int = 0
    tracks_confirmed: int = 0
    tracks_initiated: int = 0
    data_time_s: float | None = None


def plain_head(lines: list[BiasLine], *, dated: bool) -> list[str]:
    """Return the head of the lines of `plain_line`: names, and the truth where it is known.

    Parameters
    ----------
    lines : list of BiasLine
        The biases.
    dated : bool
        Whether the date is known: times are UTC then, else times of day.
    """
    names, truths = [], []
    for line in lines:
        name, unit, digits = _NAMES[line.parameter]
        names.append(f"{line.sensor} {name}, {unit}".rjust(_CELL_WIDTH))
        digits = min(digits, _PLAIN_DIGITS_MAX)
        truth = "" if line.truth is None else f"{line.truth:+.{digits}f}"
        truths.append(truth.rjust(_CELL_WIDTH))
    time = "UTC" if dated else "time"
    return [f"{time:9} tracks {' '.join(names)}", f"truth            {' '.join(truths)}"]


def plain_line(view: View) -> str:
    """Return the view as one line of text: time, tracks, each bias with its sigma."""
    cells = []
    for line in view.lines:
        digits = min(_NAMES[line.parameter][2], _PLAIN_DIGITS_MAX)
        known = line.estimate is not None and line.sigma is not None
        cell = f"{line.estimate:+.{digits}f} ± {line.sigma:.{digits}f}" if known else ""
        cells.append(cell.rjust(_CELL_WIDTH))
    return f"{clock_text(view.data_time_s)}  {view.tracks:6d} {' '.join(cells)}"


def live_view(view: View) -> "Group":
    """Return the view for a terminal."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.text import Text

    head = Text.assemble(
        (clock_text(view.data_time_s), "bold cyan"),
        f"   {view.sent:,} of {view.total:,} plots   ",
        (f"{view.tracks}", "bold green"),
        " confirmed tracks now, ",
        (f"{view.tracks_confirmed}", "bold green"),
        " so far",
    )
    bar = ProgressBar(total=max(view.total, 1), completed=view.sent, width=78)
    return Group(head, bar, bias_table(view.lines))


def bias_table(lines: list[BiasLine]) -> "Table":
    """Return the biases as a table."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("radar", style="bold")
    table.add_column("bias")
    for column in ("truth", "estimate", "± sigma", "error"):
        table.add_column(column, justify="right")
    table.add_column("settling")
    before = None
    for line in lines:
        name, unit, digits = _NAMES[line.parameter]

        def number(value: float | None, digits: int = digits, unit: str = unit) -> str:
            return "" if value is None else f"{value:+.{digits}f} {unit}"

        sigma = "" if line.sigma is None else f"{line.sigma:.{digits}f} {unit}"
        table.add_row(
            line.sensor if line.sensor != before else "",
            name,
            number(line.truth),
            number(line.estimate),
            sigma,
            f"[{_colour(line)}]{number(line.error)}[/]",
            f"[cyan]{trend(line.sigmas)}[/]",
        )
        before = line.sensor
    return table


def trend(values: list[float], width: int = _TREND_WIDTH) -> str:
    """Return values as bars, on a logarithmic scale from the least to the greatest.

    Parameters
    ----------
    values : list of float
        Positive, oldest first.
    width : int
        Maximum number of bars.
    """
    if not values:
        return ""
    step = max(1, math.ceil(len(values) / width))
    logs = [math.log(max(value, 1e-12)) for value in values[::-1][::step][::-1]]
    low, high = min(logs), max(logs)
    span = high - low
    if span == 0.0:
        return _BARS[0] * len(logs)
    return "".join(_BARS[round((log - low) / span * (len(_BARS) - 1))] for log in logs)


def clock_text(data_time_s: float | None) -> str:
    """Return a data time as a time of day; dashes before the first plot."""
    return "--:--:--" if data_time_s is None else time_of_day(data_time_s)


def _colour(line: BiasLine) -> str:
    if line.error is None or line.sigma is None:
        return "dim"
    return "green" if abs(line.error) <= _COVERED_SIGMAS * line.sigma else "yellow"
