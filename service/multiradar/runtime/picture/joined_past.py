"""A past time of which memory has a part of the tables, and the history on disk the others."""

from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.picture.past import Positions, RecordedSource


class JoinedPast:
    """A source of pictures from others.

    Parameters
    ----------
    tracks : RecordedSource
        Has the updates and the ends of tracks.
    plots : RecordedSource
        Has the plots.
    biases : RecordedSource
        Has the biases.
    health : RecordedSource
        Has the health of the radars.
    """

    def __init__(
        self, tracks: RecordedSource, plots: RecordedSource, biases: RecordedSource,
        health: RecordedSource,
    ) -> None:  # fmt: skip
        self._tracks, self._plots, self._biases, self._health = tracks, plots, biases, health

    @property
    def sensors(self) -> SensorTable:
        """The sensors."""
        return self._tracks.sensors

    @property
    def coast_after_s(self) -> float:
        """Age from which a confirmed track is coasting, s."""
        return self._tracks.coast_after_s

    @property
    def acceleration_density(self) -> float:
        """Spectral density of the acceleration between updates, m²/s³."""
        return self._tracks.acceleration_density

    @property
    def has_plots(self) -> bool:
        """Whether it has plots."""
        return self._plots.has_plots

    def latest(self, at_s: float) -> NDArray[np.void]:
        """Return the last update of each track at a time."""
        return self._tracks.latest(at_s)

    def tracks(self, at_s: float) -> pl.DataFrame:
        """Return the last update of each track at a time, rows of `tracks.parquet`."""
        return self._tracks.tracks(at_s)

    def spread(self, rows: NDArray[np.void]) -> tuple[SystemPlane | None, NDArray[np.float64]]:
        """Return the covariances of rows of `latest`, and their plane."""
        return self._tracks.spread(rows)

    def positions(self, after_s: float, at_s: float) -> Positions:
        """Return the positions of the updates of a span."""
        return self._tracks.positions(after_s, at_s)

    def plots(self, after_s: float, at_s: float, limit: int) -> tuple[NDArray[np.void], int]:
        """Return the last plots of a span, and the number of the others."""
        return self._plots.plots(after_s, at_s, limit)

    def biases(self, at_s: float) -> NDArray[np.float64]:
        """Return the biases estimated at a time."""
        return self._biases.biases(at_s)

    def bias_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the latest estimate of each bias at a time."""
        return self._biases.bias_records(at_s)

    def health_records(self, at_s: float) -> list[dict[str, Any]]:
        """Return the health of the radars at a time."""
        return self._health.health_records(at_s)
