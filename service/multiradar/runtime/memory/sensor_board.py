"""The sensors as readers see them, with what was heard of each."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.health.health_records import HealthRecords

#: Names of what a sensor measures, by kind.
KIND_NAMES = ("radar", "position", "bearing")


class SensorBoard:
    """Counts what each sensor contributed; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    """

    def __init__(self, sensors: SensorTable) -> None:
        self._sensors = sensors
        self._updates = np.zeros(len(sensors), np.int64)
        self._last_s = np.full(len(sensors), -np.inf)
        self._health = HealthRecords.concatenate([])

    def count(self, rows: NDArray[np.void]) -> None:
        """Count updates of tracks, rows of `UPDATE_DTYPE`."""
        sensor = rows["sensor"]
        self._updates += np.bincount(sensor, minlength=len(self._updates))
        np.maximum.at(self._last_s, sensor, rows["time_s"])

    def hear(self, records: HealthRecords) -> None:
        """Take what was said of the health of radars; the last row of each counts."""
        if len(records):
            radars = len(np.unique(records.sensor))
            self._health = records.select(np.arange(len(records)) >= len(records) - radars)

    def alarms(self) -> dict[str, list[str]]:
        """Return what is wrong with each radar of which something is."""
        said = zip(self._health.sensor.tolist(), self._health.alarms.tolist(), strict=True)
        return {self._sensors.ids[sensor]: wire.alarm_names(bits) for sensor, bits in said if bits}

    def records(self, data_time_s: float | None) -> list[dict[str, Any]]:
        """Return the sensors by identifier; what a sensor has not is None."""
        sensors = self._sensors
        records = []
        said = wire.health_frame(self._health, sensors).to_dicts()
        health = {row["sensor_id"]: row for row in said}
        for number, name in enumerate(sensors.ids):
            last_s = _finite(self._last_s[number])
            age_s = None
            if last_s is not None and data_time_s is not None:
                age_s = max(data_time_s - last_s, 0.0)
            records.append(
                {
                    "id": name,
                    "kind": KIND_NAMES[sensors.kinds[number]],
                    "latitude_deg": _finite(np.degrees(sensors.latitude_rad[number])),
                    "longitude_deg": _finite(np.degrees(sensors.longitude_rad[number])),
                    "height_m": _finite(sensors.height_m[number]),
                    "range_sigma_m": _finite(sensors.range_sigma_m[number]),
                    "azimuth_sigma_deg": _finite(np.degrees(sensors.azimuth_sigma_rad[number])),
                    "position_sigma_m": _finite(sensors.position_sigma_m[number]),
                    "range_max_m": _finite(sensors.range_max_m[number]),
                    "rotation_period_s": _finite(sensors.rotation_period_s[number]),
                    "updates": int(self._updates[number]),
                    "last_update_s": last_s,
                    "age_s": age_s,
                    "health": health.get(name),
                }
            )
        return records


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
