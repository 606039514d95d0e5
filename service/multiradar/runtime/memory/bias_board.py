"""Bias estimates of the present and of the last epochs."""

from typing import ClassVar

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.set_backs import SetBacks
from multiradar.runtime.row_ring import RowRing
from multiradar.state import Fields
from multiradar.tracking.columns import row_type, rows_of, table_of
from multiradar.tracking.outputs import BiasRecords

#: A row of `BiasRecords`; field names are the same.
BIAS_DTYPE = row_type(BiasRecords)

#: Epochs searched before older ones.
EPOCHS_FIRST = 16


class BiasBoard:
    """Bias estimates in a ring of fixed size; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    rows_max : int
        Number of retained records.
    """

    STATE: ClassVar[Fields] = {
        "_latest": dict[int, dict[int, np.ndarray]],
        "_epoch": int | None,
        "_set_backs": SetBacks,
    }

    def __init__(self, sensors: SensorTable, rows_max: int) -> None:
        self.use(sensors)
        #: The last records of all sensors.
        self.ring = RowRing(rows_max, BIAS_DTYPE)
        self._latest: dict[int, dict[int, NDArray[np.void]]] = {}
        self._epoch: int | None = None
        self._set_backs = SetBacks()

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        self._sensor = {name: number for number, name in enumerate(sensors.ids)}

    @property
    def epoch(self) -> int | None:
        """Number of the last completed epoch; None before the first."""
        return self._epoch

    @property
    def complete_from_s(self) -> float:
        """Time from which all records are retained, s; -inf if none was discarded."""
        first = self.ring.oldest
        if not first:
            return -np.inf
        # The epoch of the oldest record may be incomplete.
        oldest_s = float(np.nextafter(self.ring.rows(first, first + 1)["time_s"][0], np.inf))
        return min(oldest_s, self._set_backs.limit_s(first))

    def set_back(self, time_s: float) -> None:
        """Expect records from an earlier time on."""
        self._set_backs.add(self.ring.appended, time_s, self.ring.oldest)

    def append(self, records: BiasRecords) -> None:
        """Add records, in order."""
        if not len(records):
            return
        rows = rows_of(records, BIAS_DTYPE)
        self.ring.append(rows)
        self._epoch = int(rows["epoch"][-1])
        for k, (sensor, parameter) in enumerate(
            zip(rows["sensor"].tolist(), rows["parameter"].tolist(), strict=True)
        ):
            self._latest.setdefault(sensor, {})[parameter] = rows[k : k + 1]

    def latest(self, sensor_id: str | None = None) -> NDArray[np.void]:
        """Return the latest record of each parameter of a sensor, or of all; a copy."""
        sensors = sorted(self._latest) if sensor_id is None else [self._sensor.get(sensor_id, -1)]
        rows = [
            row for sensor in sensors for _, row in sorted(self._latest.get(sensor, {}).items())
        ]
        return np.concatenate(rows) if rows else np.empty(0, BIAS_DTYPE)

    def at(self, time_s: float) -> NDArray[np.void]:
        """Return the record of each parameter that was the latest at a data time; a copy."""
        held = min(self.ring.appended, self.ring.capacity)
        parameters = sum(map(len, self._latest.values()))
        newest = min(held, EPOCHS_FIRST * parameters)
        found = self._at(time_s, newest)
        # The newest rows suffice for the present; the publishing thread waits meanwhile.
        while len(found) < parameters and newest < held:
            newest = min(held, 4 * newest)
            found = self._at(time_s, newest)
        return found

    def history(
        self, sensor_id: str, since_s: float | None, limit: int, until_s: float | None = None
    ) -> NDArray[np.void]:
        """Return records of a sensor, oldest first; a copy.

        The first ones since a time, or the last ones; with `until_s` the last ones up to that time.
        """
        rows: NDArray[np.void] = self.ring.last(self.ring.capacity)
        rows = rows[rows["sensor"] == self._sensor.get(sensor_id, -1)]
        if since_s is None and until_s is None:
            return rows[-limit:]
        # The data time may have been set back.
        rows = rows[np.argsort(rows["time_s"], kind="stable")]
        if since_s is not None:
            rows = rows[rows["time_s"] >= since_s]
        return rows[:limit] if until_s is None else rows[rows["time_s"] <= until_s][-limit:]

    def _at(self, time_s: float, newest: int) -> NDArray[np.void]:
        """Return the result of `at` from the newest rows alone."""
        rows: NDArray[np.void] = self.ring.last(newest)
        rows = rows[rows["time_s"] <= time_s][::-1]
        named = np.stack([rows["sensor"], rows["parameter"]])
        found: NDArray[np.void] = rows[np.unique(named, axis=1, return_index=True)[1]]
        return found


def bias_rows_frame(rows: NDArray[np.void], sensors: SensorTable) -> pl.DataFrame:
    """Return rows of a board as rows of `biases.parquet`."""
    return wire.biases_frame(table_of(BiasRecords, rows), sensors)
