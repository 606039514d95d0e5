"""What the service retains of past times, in rings of fixed size.

The engine's thread appends, any thread reads; see `TrackHistory`.
"""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.runtime.engine.plot_rows import PLOT_DTYPE, POINTS_MAX
from multiradar.runtime.memory.bias_board import BiasBoard
from multiradar.runtime.memory.health_board import HealthBoard
from multiradar.runtime.memory.history import SPREAD_DTYPE, TrackHistory
from multiradar.runtime.memory.set_backs import TrackStep, joined_steps
from multiradar.runtime.memory.state_board import StateBoard
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import Fields
from multiradar.tracking.columns import row_type
from multiradar.tracking.lifecycle.transitions import ENDED, STARTED, TrackTransitions
from multiradar.tracking.outputs import TrackStates


class PastRows:
    """Updates, transitions and measurements of tracks, with the states of samples.

    Parameters
    ----------
    limits : RuntimeLimits
        Sizes of the rings.
    biases : BiasBoard
        Biases of past epochs.
    healths : HealthBoard
        Health of past epochs.
    """

    STATE: ClassVar[Fields] = {
        "updates": TrackHistory,
        "transitions": TrackHistory,
        "plots": TrackHistory,
        "steps": list[TrackStep],
    }

    def __init__(self, limits: RuntimeLimits, biases: BiasBoard, healths: HealthBoard) -> None:
        self.updates = TrackHistory(limits.history_rows_max, SPREAD_DTYPE)
        self.transitions = TrackHistory(limits.transition_rows_max, row_type(TrackTransitions))
        self.plots = TrackHistory(limits.plot_rows_max, PLOT_DTYPE)
        self.samples = StateBoard(limits.state_bytes_max)
        #: When the data time was set back; see `joined_steps`.
        self.steps: list[TrackStep] = []
        self._biases, self._healths = biases, healths

    def set_back(self, time_s: float) -> None:
        """Expect earlier times: the data time was set back, and all tracks were terminated."""
        for one in (
            self.updates, self.transitions, self.plots, self._biases, self._healths,
        ):  # fmt: skip
            one.set_back(time_s)
        self.steps = joined_steps(self.steps, [(self.updates.last_track, time_s)])

    @property
    def oldest_s(self) -> float | None:
        """Time of the oldest retained update, s; None without updates."""
        return self.updates.oldest_s

    def complete_from_s(self, *tables: str) -> float:
        """Return the time from which tables are retained completely, s.

        Parameters
        ----------
        *tables : str
            `updates`, `transitions`, `plots`, `biases` or `health`.

        Returns
        -------
        float
            -inf if nothing was discarded.
        """
        held: dict[str, TrackHistory | BiasBoard | HealthBoard] = {
            "updates": self.updates, "transitions": self.transitions, "plots": self.plots,
            "biases": self._biases, "health": self._healths,
        }  # fmt: skip
        while True:
            try:
                return max(held[table].complete_from_s for table in tables)
            except StateError:
                # The oldest bias was overwritten meanwhile.
                continue

    def complete_of_s(self, table: str, subject: int | str) -> float:
        """Return the time from which the rows of a track or a sensor are retained completely, s.

        Parameters
        ----------
        table : str
            `updates` or `transitions` for a track, `biases` for a sensor.
        subject : int or str
            The track or the sensor.

        Returns
        -------
        float
            -inf if nothing was discarded, inf if all may have been.
        """
        if isinstance(subject, str):
            return self.complete_from_s(table)
        held = {"updates": self.updates, "transitions": self.transitions}
        return held[table].complete_of_s(subject)

    def updates_between(self, after_s: float, until_s: float) -> NDArray[np.void]:
        """Return the retained updates of a span of time, rows of `SPREAD_DTYPE`, by time."""
        return self.updates.between(after_s, until_s)

    def plots_between(self, after_s: float, until_s: float) -> NDArray[np.void]:
        """Return the retained measurements of a span of time, rows of `PLOT_DTYPE`, by time."""
        return self.plots.between(after_s, until_s)

    def plots_before(self, until_s: float, limit: int) -> NDArray[np.void]:
        """Return the last retained measurements up to a time, rows of `PLOT_DTYPE`, by time."""
        return self.plots.last_until(until_s, limit)

    def plots_until(self, track_id: int, until_s: float) -> NDArray[np.void]:
        """Return the last measurements of a track up to a time, rows of `PLOT_DTYPE`."""
        return self.plots.read_until(track_id, None, until_s, POINTS_MAX)

    def started_s(self, track_id: int) -> float | None:
        """Return when a track was initiated, s; None if that is not retained."""
        rows = self.transitions.read(track_id, None, self.transitions.capacity)
        times: NDArray[np.float64] = rows["time_s"][rows["transition"] == STARTED]
        return float(times[0]) if len(times) else None

    def ended_between(self, after_s: float, until_s: float) -> NDArray[np.int64]:
        """Return the tracks that ended in a span of time."""
        # Also those that a step back of the data time has terminated.
        rows = self.transitions.between(after_s, until_s, superseded=True)
        ended: NDArray[np.int64] = rows["track_id"][rows["transition"] == ENDED]
        return ended

    def states_between(self, after_s: float, until_s: float) -> TrackStates | None:
        """Return the last retained state of each confirmed track in a span of time."""
        return self.samples.at(after_s, until_s)
