"""Observability of a track's position from its last measurements."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.restoration.geometry.observability import observability
from multiradar.restoration.geometry.straight_flight import Sightings
from multiradar.runtime.queries.track_windows import (
    azimuth_bias_sigmas,
    bias_estimates,
    window_plots,
)


def observability_of_track(
    rows: NDArray[np.void], window_s: float, biases: NDArray[np.void], sensors: SensorTable
) -> dict[str, Any]:
    """Return the observability of the position from the measurements of a window.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The last measurements of a track, by ascending time, at least one.
    window_s : float
        Length of the window before the last measurement, s.
    biases : (k,) ndarray of `BIAS_DTYPE`
        The biases published at the time of the last measurement.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.products.observability.Observability`.
    """
    last = rows[-1]
    height_m = float(last["track_height_m"])
    position = (
        float(last["track_latitude_rad"]), float(last["track_longitude_rad"]),
        0.0 if np.isnan(height_m) else height_m,
    )  # fmt: skip
    plots = window_plots(rows, window_s)
    found = observability(
        plots,
        sensors,
        bias_estimates(biases, len(sensors)),
        position,
        _directions(rows[-len(plots.time_s) :]),
        bias_sigma_rad=azimuth_bias_sigmas(biases, sensors),
    )
    return {
        "track_id": int(last["track_id"]),
        "time_s": float(last["time_s"]),
        "window_s": float(window_s),
        **found._asdict(),
        "lines_cross": found.lines_cross,
        "is_observable": found.is_observable,
    }


def _directions(rows: NDArray[np.void]) -> Sightings | None:
    directions = rows["directions"]
    if np.isnan(directions).all():
        return None
    positions = [
        rows[name] for name in ("track_latitude_rad", "track_longitude_rad", "track_height_m")
    ]
    return Sightings(directions[:, 0], directions[:, 1:], np.nan_to_num(np.column_stack(positions)))
