"""Sliding windows over the last measurements of a track, live and offline.

A window ends with the last measurement of a track. It is evaluated with the biases published then,
so that the answer does not depend on the time of the query.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.errors import PlaneError
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_NAMES,
    SensorTable,
)
from multiradar.restoration.geometry.plot_positions import Plots
from multiradar.runtime.engine.plot_rows import PLOT_DTYPE, POINTS_MAX, plot_rows
from multiradar.runtime.memory.bias_board import BiasBoard
from multiradar.runtime.memory.history import TrackHistory
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EngineOutput

#: Evaluates a window: measurements as `PLOT_DTYPE`, its length in s, biases as `BIAS_DTYPE`,
#: sensors. Raises PlaneError if there is no answer.
WindowAnalysis = Callable[[NDArray[np.void], float, NDArray[np.void], SensorTable], dict[str, Any]]


def window_plots(rows: NDArray[np.void], window_s: float) -> Plots:
    """Return the measurements of a window.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The last measurements of a track, by ascending time, at least one.
    window_s : float
        Length of the window before the last measurement, s.

    Returns
    -------
    Plots
        The plots of the window.
    """
    chosen = rows[rows["time_s"] >= rows["time_s"][-1] - window_s]
    return Plots(*(chosen[name] for name in Plots._fields))


def bias_estimates(records: NDArray[np.void], sensors: int) -> NDArray[np.float64]:
    """Return bias records as a table by sensor and parameter, 0 where there is none."""
    estimates = np.zeros((sensors, len(PARAMETER_NAMES)))
    estimates[records["sensor"], records["parameter"]] = records["estimate"]
    return estimates


def azimuth_bias_sigmas(records: NDArray[np.void], sensors: SensorTable) -> NDArray[np.float64]:
    """Return the sigma of the azimuth bias of each sensor, rad.

    Sigma of the record, or of the prior where there is none; 0 where no bias is estimated. Of an
    eccentricity, that of the direction in which it is largest is included.
    """
    sigmas = np.zeros((len(sensors), len(PARAMETER_NAMES)))
    sigmas[sensors.parameter_sensor, sensors.parameter_kind] = sensors.prior_sigma
    sigmas[records["sensor"], records["parameter"]] = records["sigma"]
    waves = sigmas[:, [PARAMETER_AZIMUTH_SINE, PARAMETER_AZIMUTH_COSINE]]
    whole: NDArray[np.float64] = np.hypot(sigmas[:, PARAMETER_AZIMUTH_OFFSET], waves.max(axis=1))
    return whole


class WindowTable:
    """A table by track and epoch: the result at the last update of each track in each epoch.

    Parameters
    ----------
    analyse : callable
        Evaluates a window.
    schema : Schema
        Columns of the table; a column `reason` contains the error code where there is no answer.
    sensors : SensorTable
        The sensors.
    window_s : float
        Length of the windows, s.
    epoch_s : float
        Length of an epoch of the biases, s.
    """

    def __init__(
        self,
        analyse: WindowAnalysis,
        schema: pl.Schema,
        sensors: SensorTable,
        window_s: float,
        epoch_s: float,
    ) -> None:
        # The same bounds as live, so that the windows are identical.
        limits = RuntimeLimits()
        self._analyse, self._schema = analyse, schema
        self._sensors, self._window_s, self._epoch_s = sensors, window_s, epoch_s
        self._plots = TrackHistory(limits.plot_rows_max, PLOT_DTYPE)
        self._biases = BiasBoard(sensors, limits.bias_history_rows_max)
        self._epoch: int | None = None
        self._updated: set[int] = set()

    def update(self, output: EngineOutput) -> pl.DataFrame:
        """Return the rows of the epochs completed by an output of the engine."""
        found: list[dict[str, Any]] = []
        rows = plot_rows(output)
        epochs = np.floor(rows["time_s"] / self._epoch_s).astype(np.int64)
        # The biases of an epoch are published before any output of the next one.
        self._biases.append(output.biases)
        for epoch in np.unique(epochs).tolist():
            if epoch != self._epoch:
                found += self._close()
                self._epoch = epoch
            current = rows[epochs == epoch]
            self._plots.append(current)
            self._updated.update(current["track_id"].tolist())
        return pl.DataFrame(found, schema=self._schema)

    def finish(self) -> pl.DataFrame:
        """Return the rows of the last epoch."""
        return pl.DataFrame(self._close(), schema=self._schema)

    def _close(self) -> list[dict[str, Any]]:
        found = []
        for track_id in sorted(self._updated):
            rows = self._plots.read(track_id, None, POINTS_MAX)
            last_s = float(rows["time_s"][-1])
            biases = self._biases.at(last_s)
            try:
                row = self._analyse(rows, self._window_s, biases, self._sensors)
            except PlaneError as error:
                row = {"track_id": track_id, "time_s": last_s, "window_s": self._window_s}
                row["reason"] = error.code
            found.append({name: row.get(name) for name in self._schema})
        self._updated.clear()
        return found
