"""The bias estimates of now and of the last epochs."""

from typing import Any

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.outputs import BiasRecords

_DTYPE = np.dtype(
    [
        ("epoch", np.int64),
        ("time_s", np.float64),
        ("sensor", np.int32),
        ("parameter", np.int8),
        ("estimate", np.float64),
        ("sigma", np.float64),
    ]
)


class BiasBoard:
    """Bias estimates in a ring of fixed size; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    rows_max : int
        Number of records that are kept.
    """

    def __init__(self, sensors: SensorTable, rows_max: int) -> None:
        self._sensors = sensors
        self._sensor = {name: number for number, name in enumerate(sensors.ids)}
        self._rows = np.empty(rows_max, _DTYPE)
        self._count = 0
        self._latest: dict[int, dict[int, np.ndarray[Any, Any]]] = {}
        self._epoch: int | None = None

    @property
    def epoch(self) -> int | None:
        """Number of the last epoch that ended; None before the first."""
        return self._epoch

    def append(self, records: BiasRecords) -> None:
        """Add records, in order."""
        if not len(records):
            return
        rows = np.empty(len(records), _DTYPE)
        for name in _DTYPE.names or ():
            rows[name] = getattr(records, name)
        kept = rows[-len(self._rows) :]
        first = self._count + len(rows) - len(kept)
        self._rows[np.arange(first, first + len(kept)) % len(self._rows)] = kept
        self._count += len(rows)
        self._epoch = int(rows["epoch"][-1])
        for place, (sensor, parameter) in enumerate(
            zip(rows["sensor"].tolist(), rows["parameter"].tolist(), strict=True)
        ):
            self._latest.setdefault(sensor, {})[parameter] = rows[place : place + 1]

    def latest(self, sensor_id: str) -> list[dict[str, Any]]:
        """Return the latest record of each parameter of a sensor."""
        by_parameter = self._latest.get(self._sensor.get(sensor_id, -1), {})
        rows = [by_parameter[parameter] for parameter in sorted(by_parameter)]
        return self._frame(np.concatenate(rows)).to_dicts() if rows else []

    def history(self, sensor_id: str, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return records of a sensor, oldest first: the first since a time, or the last."""
        held = min(self._count, len(self._rows))
        order = np.arange(self._count - held, self._count) % len(self._rows)
        chosen = order[self._rows["sensor"][order] == self._sensor.get(sensor_id, -1)]
        if since_s is None:
            chosen = chosen[-limit:]
        else:
            chosen = chosen[self._rows["time_s"][chosen] >= since_s][:limit]
        return self._frame(self._rows[chosen])

    def _frame(self, rows: np.ndarray[Any, Any]) -> pl.DataFrame:
        records = BiasRecords(
            **{name: np.ascontiguousarray(rows[name]) for name in _DTYPE.names or ()}
        )
        return wire.biases_frame(records, self._sensors)
