"""What the service retains of a past time, for its queries."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.knowledge import Knowledge, States, TrackWindow
from multiradar.runtime.memory.live_tracks import ages_and_states
from multiradar.runtime.picture.retained import RetainedPast
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.outputs import STATE_NAMES
from multiradar.tracking.settings import TrackingSettings


class PastKnowledge:
    """A `Moment` of the past: rows and samples of states that are still retained.

    A state is that of the last sample, taken every 8 s of data time; forecasts from it are as long
    ahead as the sample is old. Regions are those of the present calibration.

    Parameters
    ----------
    known : Knowledge
        Present data, with what is retained of the past.
    past : RetainedPast
        The same, as a source of pictures.
    at_s : float
        The time, s.
    """

    def __init__(self, known: Knowledge, past: RetainedPast, at_s: float) -> None:
        self._known, self._past, self._at_s = known, past, at_s

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        return self._known.sensors

    @property
    def tracking(self) -> TrackingSettings:
        """Settings of the tracker."""
        return self._known.tracking

    @property
    def limits(self) -> RuntimeLimits:
        """Bounds of answers."""
        return self._known.limits

    @property
    def calibration(self) -> ForecastCalibration:
        """Calibration of forecasts, that of the present."""
        return self._known.calibration

    @property
    def data_time_s(self) -> float:
        """The time, s."""
        return self._at_s

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return time, age, height and state of a track that was live."""
        rows = self._past.latest(self._at_s)
        rows = rows[rows["track_id"] == track_id]
        if not len(rows):
            return None
        age_s, state = ages_and_states(rows, self._at_s, self.tracking.coast_after_s)
        height_m = float(rows["height_m"][0])
        return {
            "time_s": float(rows["time_s"][0]),
            "age_s": float(age_s[0]),
            "height_m": height_m if np.isfinite(height_m) else None,
            "state": STATE_NAMES[state[0]],
        }

    def states(self) -> States | None:
        """Return the last states of confirmed tracks, and their plane."""
        now, after_s = self._known.states(), self._at_s - self.tracking.drop_after_s
        states = self._known.past.states_between(after_s, self._at_s)
        return None if now is None or states is None else (states, now[1])

    def live_rows(self) -> tuple[NDArray[np.void], float | None]:
        """Return the last updates of the tracks that were live, and the time."""
        return self._past.latest(self._at_s), self._at_s

    def window(self, track_id: int) -> TrackWindow | None:
        """Return the last measurements of a track that was live."""
        track = self.track(track_id)
        if track is None:
            return None
        rows = self._known.past.plots_until(track_id, self._at_s)
        return TrackWindow(rows, self._known.biases_at(track["time_s"])) if len(rows) else None

    def plots_after(self, after: int | None, limit: int) -> tuple[NDArray[np.void], int, int]:
        """Return the last measurements up to the time; they have no numbers."""
        del after
        return self._known.past.plots_before(self._at_s, limit), 0, 0

    def trajectory_feed(self) -> TrajectoryFeed:
        """Raise TrajectoryError: trajectory sets of the past are not retained."""
        raise TrajectoryError("NOT_RETAINED", "past trajectory sets are not retained")
