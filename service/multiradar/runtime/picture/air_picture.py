"""Frames of the air picture: live tracks, and plots with and without the estimated biases."""

import threading
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.picture.frames import encoded
from multiradar.runtime.queries.plot_coordinates import plot_coordinates
from multiradar.runtime.queries.track_windows import bias_estimates
from multiradar.tracking.outputs import STATE_NAMES

#: Maximum plots of a frame: a page that was away longer misses the oldest.
PLOTS_MAX = 5_000

_NUMBERS = {
    "height_m": "f4", "speed_mps": "f4", "heading_deg": "f4", "vertical_rate_mps": "f4",
    "position_sigma_m": "f4", "age_s": "f4", "turn_right_probability": "f4",
    "turn_left_probability": "f4",
}  # fmt: skip
_EXACT = ("track_id", "time_s", "latitude_deg", "longitude_deg")

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
        measured = plot_coordinates(rows, np.zeros_like(estimates), sensors)
        corrected = plot_coordinates(rows, estimates, sensors)
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
