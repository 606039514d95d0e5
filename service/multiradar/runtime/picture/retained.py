"""What the service retains of the past, as a source of pictures."""

from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.bias_board import bias_rows_frame
from multiradar.runtime.memory.history import update_rows_frame
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.picture.past import ENDING_S, Positions, last_of_each
from multiradar.runtime.picture.track_columns import system_plane
from multiradar.runtime.queries.track_windows import bias_estimates
from multiradar.tracking.outputs import SPREAD_COUNT


class RetainedPast:
    """The tracks, plots and biases that the service still has; oldest rows are overwritten first.

    Parameters
    ----------
    known : Knowledge
        Tracks, plots and biases.
    """

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self._plane = system_plane(known.sensors)

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        return self._known.sensors

    @property
    def coast_after_s(self) -> float:
        """Age from which a confirmed track is coasting, s."""
        return self._known.tracking.coast_after_s

    @property
    def acceleration_density(self) -> float:
        """Spectral density of the acceleration between updates, m²/s³."""
        return self._known.tracking.acceleration_density

    @property
    def has_plots(self) -> bool:
        """True: the service retains plots."""
        return True

    def latest(self, at_s: float) -> NDArray[np.void]:
        """Return the last update of each track at a time."""
        silent_s = self._known.tracking.drop_after_s + ENDING_S
        rows = self._known.past.updates_between(at_s - silent_s, at_s)
        rows = rows[last_of_each(rows["track_id"])]
        ended = self._known.past.ended_between(at_s - silent_s, at_s)
        live: NDArray[np.void] = rows[~np.isin(rows["track_id"], ended)]
        return live

    def tracks(self, at_s: float) -> pl.DataFrame:
        """Return the last update of each track at a time, rows of `tracks.parquet`."""
        return update_rows_frame(self.latest(at_s), self.sensors)

    def spread(self, rows: NDArray[np.void]) -> tuple[SystemPlane | None, NDArray[np.float64]]:
        """Return the covariances of rows of `latest`, and their plane."""
        if self._plane is None:
            return None, np.full((len(rows), SPREAD_COUNT), np.nan)
        place = self._plane.to_plane(rows["latitude_rad"], rows["longitude_rad"])
        return self._plane, np.column_stack([*place, rows["spread"]])

    def positions(self, after_s: float, at_s: float) -> Positions:
        """Return the positions of the updates of a span."""
        rows = self._known.past.updates_between(after_s, at_s)
        return Positions(
            rows["track_id"], rows["time_s"], rows["sensor"],
            np.degrees(rows["latitude_rad"]), np.degrees(rows["longitude_rad"]),
        )  # fmt: skip

    def plots(self, after_s: float, at_s: float, limit: int) -> tuple[NDArray[np.void], int]:
        """Return the last plots of a span, and the number of the others."""
        rows = self._known.past.plots_between(after_s, at_s)
        return rows[-limit:], max(len(rows) - limit, 0)

    def biases(self, at_s: float) -> NDArray[np.float64]:
        """Return the biases published at a time."""
        return bias_estimates(self._known.biases_at(at_s), len(self.sensors))

    def bias_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the biases published at a time, as rows of `biases.parquet`."""
        return bias_rows_frame(self._known.biases_at(at_s), self.sensors).to_dicts()

    def health_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the health of the radars at a time."""
        return wire.health_frame(self._known.healths.at(at_s), self.sensors).to_dicts()
