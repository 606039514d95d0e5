"""The sensors as published, with the time and number of their updates."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields
from multiradar.tracking.health.health_records import HealthRecords

#: Names of the kinds of measurement.
KIND_NAMES = ("radar", "position", "bearing")
#: Data time for which a sensor counts as saturated after it was last, s: as long as a track of a
#: single plot lasts.
SATURATED_FOR_S = 60.0


class SensorBoard:
    """Counts the updates of each sensor; one owner."""

    STATE: ClassVar[Fields] = {
        "_updates": np.ndarray,
        "_last_s": np.ndarray,
        "_saturated_s": np.ndarray,
        "_health": HealthRecords,
    }

    def __init__(self, sensors: SensorTable) -> None:
        self._sensors = sensors
        self._updates = np.zeros(len(sensors), np.int64)
        self._last_s = np.full(len(sensors), -np.inf)
        self._saturated_s = np.full(len(sensors), -np.inf)
        self._health = HealthRecords.concatenate([])

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        more = len(sensors) - len(self._updates)
        if more > 0:
            self._updates = np.pad(self._updates, (0, more))
            self._last_s = np.pad(self._last_s, (0, more), constant_values=-np.inf)
            self._saturated_s = np.pad(self._saturated_s, (0, more), constant_values=-np.inf)
        self._sensors = sensors

    def count(self, rows: NDArray[np.void]) -> None:
        """Count updates of tracks, rows of `UPDATE_DTYPE`."""
        sensor = rows["sensor"]
        self._updates += np.bincount(sensor, minlength=len(self._updates))
        np.maximum.at(self._last_s, sensor, rows["time_s"])

    def note_saturated(self, saturated: NDArray[np.bool_], data_time_s: float) -> None:
        """Note which sensors may initiate no more tracks at a data time."""
        self._saturated_s[np.flatnonzero(saturated)] = data_time_s

    def set_back(self, data_time_s: float) -> None:
        """Continue at an earlier data time: the ages of sensors begin with it at the latest."""
        self._last_s = np.minimum(self._last_s, data_time_s)
        # All tracks were terminated.
        self._saturated_s[:] = -np.inf

    def saturated(self, data_time_s: float | None) -> list[str]:
        """Return the sensors that could lately initiate no more tracks."""
        if data_time_s is None:
            return []
        lately = np.flatnonzero(data_time_s - self._saturated_s < SATURATED_FOR_S)
        return [self._sensors.ids[sensor] for sensor in lately.tolist()]

    def update_health(self, records: HealthRecords) -> None:
        """Set the health of radars; the last row of each applies."""
        if len(records):
            radars = len(np.unique(records.sensor))
            self._health = records.select(np.arange(len(records)) >= len(records) - radars)

    def alarms(self) -> dict[str, list[str]]:
        """Return the alarms of each radar with alarms."""
        rows = zip(self._health.sensor.tolist(), self._health.alarms.tolist(), strict=True)
        return {self._sensors.ids[sensor]: wire.alarm_names(bits) for sensor, bits in rows if bits}

    def ages_s(self, data_time_s: float | None) -> dict[str, float]:
        """Return the data time since the last update by each sensor that has one, s."""
        if data_time_s is None:
            return {}
        ages_s = np.maximum(data_time_s - self._last_s, 0.0)
        return {
            name: float(age_s)
            for name, age_s in zip(self._sensors.ids, ages_s, strict=True)
            if np.isfinite(age_s)
        }

    def records(self, data_time_s: float | None) -> list[dict[str, Any]]:
        """Return the sensors by identifier; missing values are None."""
        sensors, ages_s = self._sensors, self.ages_s(data_time_s)
        records = []
        rows = wire.health_frame(self._health, sensors).to_dicts()
        health = {row["sensor_id"]: row for row in rows}
        for number, name in enumerate(sensors.ids):
            records.append(
                {
                    "id": name,
                    "kind": KIND_NAMES[sensors.kinds[number]],
                    "enabled": not sensors.disabled[number],
                    "latitude_deg": _finite(np.degrees(sensors.latitude_rad[number])),
                    "longitude_deg": _finite(np.degrees(sensors.longitude_rad[number])),
                    "height_m": _finite(sensors.height_m[number]),
                    "range_sigma_m": _finite(sensors.range_sigma_m[number]),
                    "azimuth_sigma_deg": _finite(np.degrees(sensors.azimuth_sigma_rad[number])),
                    "position_sigma_m": _finite(sensors.position_sigma_m[number]),
                    "range_max_m": _finite(sensors.range_max_m[number]),
                    "rotation_period_s": _finite(sensors.rotation_period_s[number]),
                    "updates": int(self._updates[number]),
                    "last_update_s": _finite(self._last_s[number]),
                    "age_s": ages_s.get(name),
                    "health": health.get(name),
                }
            )
        # Sensors that were added are last in the table.
        return sorted(records, key=lambda record: str(record["id"]))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
