"""What queries read: the present data of the service, or those of a past time."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.knowledge import States, TrackWindow
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.settings import TrackingSettings


class Moment(Protocol):
    """The data of one time; for any thread. `Knowledge` is that of the present."""

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        ...

    @property
    def tracking(self) -> TrackingSettings:
        """Settings of the tracker."""
        ...

    @property
    def limits(self) -> RuntimeLimits:
        """Bounds of answers."""
        ...

    @property
    def calibration(self) -> ForecastCalibration:
        """Calibration of forecasts, that of the present."""
        ...

    @property
    def data_time_s(self) -> float | None:
        """The data time, s; None before there is any."""
        ...

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return a track of the time, with `time_s`, `age_s`, `height_m` and `state`, or None."""
        ...

    def states(self) -> States | None:
        """Return the states of the filter and their plane; None where there are none."""
        ...

    def live_rows(self) -> tuple[NDArray[np.void], float | None]:
        """Return the last updates of the tracks, rows of `UPDATE_DTYPE`, and the data time."""
        ...

    def window(self, track_id: int) -> TrackWindow | None:
        """Return the last measurements of a track, and the biases; None for no such track."""
        ...

    def plots_after(self, after: int | None, limit: int) -> tuple[NDArray[np.void], int, int]:
        """Return the last measurements of all tracks; see `TrackHistory.after`."""
        ...

    def trajectory_feed(self) -> TrajectoryFeed:
        """Return the bundles, or raise TrajectoryError."""
        ...
