"""Frames of the air picture: live tracks, and plots with and without the estimated biases."""

import threading
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.geodesy.polar import polar_to_geodetic
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.queries.track_windows import bias_estimates
from multiradar.tracking.outputs import STATE_NAMES

#: Maximum plots of a frame: a page that was away longer misses the oldest.
PLOTS_MAX = 5_000
#: Height of a plot without one where its track has none either, m.
_HEIGHT_ASSUMED_M = 7_000.0

_NUMBERS = {
    "height_m": "f4", "speed_mps": "f4", "heading_deg": "f4", "vertical_rate_mps": "f4",
    "position_sigma_m": "f4", "age_s": "f4", "turn_right_probability": "f4",
    "turn_left_probability": "f4",
}  # fmt: skip
_EXACT = ("track_id", "time_s", "latitude_deg", "longitude_deg")

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


class AirPicture:
    """Frames for the page; the tracks of one state are encoded once for all readers.

    Parameters
    ----------
    known : Knowledge
        Tracks, plots and biases.
    """

    def __init__(self, known: Knowledge) -> None:
        self._known = known
        self._lock = threading.Lock()
        self._made: tuple[pl.DataFrame, Columns, dict[str, list[str | None]]] | None = None

    def frame(self, after: int | None) -> bytes:
        """Return the picture.

        Parameters
        ----------
        after : int or None
            `next` of the last frame: only plots since then; None: the last `PLOTS_MAX`.

        Returns
        -------
        bytes
            A frame (see `frames`): tables `tracks` and `plots`, and in the header `data_time_s`,
            `next`, `sensors` (identifiers, by their number in `plots`), `states` (names, by number
            in `tracks`), `skipped` (plots that are no longer retained), and the texts of the
            tracks, `callsign`, `mode_3a` and `mode_s_address`.
        """
        known = self._known
        tracks, texts = self._tracks(known.tracks())
        rows, following, skipped = known.plots_after(after, PLOTS_MAX)
        members = {
            "data_time_s": known.data_time_s,
            "next": following,
            "skipped": skipped,
            "sensors": list(known.sensors.ids),
            "states": list(STATE_NAMES),
            **texts,
        }
        return encoded(members, {"tracks": tracks, "plots": self._plots(rows)})

    def _tracks(self, frame: pl.DataFrame) -> tuple[Columns, dict[str, list[str | None]]]:
        with self._lock:
            if self._made is None or self._made[0] is not frame:
                self._made = (frame, _track_columns(frame), _track_texts(frame))
            return self._made[1], self._made[2]

    def _plots(self, rows: NDArray[np.void]) -> Columns:
        sensors = self._known.sensors
        estimates = bias_estimates(self._known.latest_biases(), len(sensors))
        biases = estimates[rows["sensor"]]
        measured = _positions(rows, np.zeros_like(biases), self._known)
        corrected = _positions(rows, biases, self._known)
        return {
            "time_s": rows["time_s"].astype(np.float64),
            "track_id": rows["track_id"].astype(np.float64),
            "sensor": rows["sensor"].astype(np.int32),
            "latitude_deg": np.degrees(measured[0]),
            "longitude_deg": np.degrees(measured[1]),
            "corrected_latitude_deg": np.degrees(corrected[0]),
            "corrected_longitude_deg": np.degrees(corrected[1]),
        }


def _track_columns(frame: pl.DataFrame) -> Columns:
    if frame.is_empty():
        return {}
    columns: Columns = {
        name: frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in _EXACT
    }
    for name, kind in _NUMBERS.items():
        columns[name] = frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy().astype(kind)
    numbers = {name: number for number, name in enumerate(STATE_NAMES)}
    columns["state"] = np.array([numbers[one] for one in frame["state"]], np.int8)
    columns["on_ground"] = frame["on_ground"].cast(pl.Int8).fill_null(-1).to_numpy().astype(np.int8)
    return columns


def _track_texts(frame: pl.DataFrame) -> dict[str, list[str | None]]:
    names = ("callsign", "mode_3a", "mode_s_address")
    return {name: frame[name].to_list() if len(frame) else [] for name in names}


# Latitude and longitude of plots, rad, with biases removed; NaN for bearings and unlocatable plots.
def _positions(rows: NDArray[np.void], biases: Floats, known: Knowledge) -> tuple[Floats, Floats]:
    latitude = np.where(rows["kind"] == KIND_POSITION, rows["latitude_rad"], np.nan)
    longitude = np.where(rows["kind"] == KIND_POSITION, rows["longitude_rad"], np.nan)
    height = np.where(np.isfinite(rows["height_m"]), rows["height_m"], rows["track_height_m"])
    height = np.where(np.isfinite(height), height, _HEIGHT_ASSUMED_M)
    sensors = known.sensors
    range_m, azimuth_rad = polar_without_biases(rows["range_m"], rows["azimuth_rad"], biases)
    for sensor in np.unique(rows["sensor"]).tolist():
        own = (rows["sensor"] == sensor) & (rows["kind"] == KIND_RADAR)
        if not own.any():
            continue
        site = tuple(
            float(column[sensor])
            for column in (sensors.latitude_rad, sensors.longitude_rad, sensors.height_m)
        )
        latitude[own], longitude[own] = polar_to_geodetic(
            (site[0], site[1], site[2]), range_m[own], azimuth_rad[own], height[own]
        )
    return latitude, longitude
