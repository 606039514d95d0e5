"""The plots of the last seconds; their positions are computed once, when a reader asks for them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.engine.plot_rows import PLOT_DTYPE
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.picture.bearing_lines import marks
from multiradar.runtime.queries.track_windows import bias_estimates

#: Plots that are retained, whatever the number of readers: as many as a page shows.
PLOTS_KEPT = 32_768
_ROW = np.dtype(
    [
        ("time_s", np.float64), ("track_id", np.float64), ("latitude_deg", np.float64),
        ("longitude_deg", np.float64), ("corrected_latitude_deg", np.float64),
        ("corrected_longitude_deg", np.float64), ("sensor", np.int32),
        ("source_latitude_deg", np.float64), ("source_longitude_deg", np.float64),
    ]
)  # fmt: skip


class RecentPlots:
    """The last plots, with and without biases; one owner.

    Positions are computed for the first reader of a plot, with the biases of that time: far above
    real time most plots are overwritten before any page asks for them.

    Parameters
    ----------
    known : Knowledge
        Plots and biases.
    """

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self._allocate(0)
        # Numbers of the plots retained: from `_begin` to below `_end`.
        self._begin = self._end = 0
        self._read: int | None = None

    @property
    def next(self) -> int:
        """Number of the next plot."""
        return self._end

    def update(self) -> None:
        """Add the plots since the last call, at most the last `PLOTS_KEPT`."""
        rows, following, skipped = self._known.plots_after(self._read, PLOTS_KEPT)
        if self._read is None or following < self._read or skipped:
            self._begin = following - len(rows)
        self._read = self._end = following
        self._begin = max(self._begin, self._end - PLOTS_KEPT)
        if len(rows):
            if not len(self._measured):
                self._allocate(PLOTS_KEPT)
            slots = np.arange(self._end - len(rows), self._end) % PLOTS_KEPT
            self._measured[slots] = rows
            self._placed[slots] = False

    def after(
        self, number: int | None, limit: int, since_s: float
    ) -> tuple[dict[str, NDArray[Any]], int]:
        """Return plots in the order of their arrival.

        Parameters
        ----------
        number : int or None
            `next` of an earlier call: plots from then on. None, or a number that does not exist
            yet: the last ones.
        limit : int
            Maximum number of plots, the last.
        since_s : float
            Plots before this data time are omitted where `number` is None.

        Returns
        -------
        columns : dict of (n,) ndarray
            `time_s`, `track_id`, `sensor` (number), and positions in degrees as measured and
            without biases; NaN where there is none. Of bearings see `marks`.
        skipped : int
            Plots since `number` that are missing.
        """
        known = number is not None and number <= self._end
        first = max(self._begin, self._known.past.plots.first_since_set_back)
        wanted = number if known and number is not None else first
        start = max(wanted, self._begin, self._end - limit)
        slots = np.arange(start, self._end) % PLOTS_KEPT
        if not known:
            slots = slots[self._measured["time_s"][slots] >= since_s]
        self._place(slots[~self._placed[slots]])
        rows = self._rows[slots]
        columns = {name: rows[name] for name in _ROW.names or ()}
        return columns, start - wanted if known else 0

    # No memory before a page asks for the first plots.
    def _allocate(self, plots: int) -> None:
        self._measured = np.zeros(plots, PLOT_DTYPE)
        self._rows = np.zeros(plots, _ROW)
        # Which of `_rows` have been computed from `_measured`.
        self._placed = np.zeros(plots, np.bool_)

    def _place(self, slots: NDArray[np.int64]) -> None:
        if len(slots) == 0:
            return
        sensors = self._known.sensors
        biases = bias_estimates(self._known.latest_biases(), len(sensors))
        columns = marks(self._measured[slots], biases, sensors)
        for name in _ROW.names or ():
            self._rows[name][slots] = columns.get(name, np.nan)
        self._placed[slots] = True
