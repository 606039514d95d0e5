"""The sensors at a past time, from what the service retains or from a recorded run."""

from typing import Any

import numpy as np

from multiradar.runtime.memory.sensor_board import SensorBoard
from multiradar.runtime.picture.past import PictureSource
from multiradar.runtime.picture.sensor_findings import Found, add_findings

#: A sensor without an update for so long before the time has none, s.
SILENT_S = 120.0


def past_sensors(source: PictureSource, at_s: float, found: Found = ()) -> list[dict[str, Any]]:
    """Return the sensors by identifier at a time.

    Parameters
    ----------
    source : PictureSource
        Where it is from.
    at_s : float
        The time, s.
    found : sequence of mapping
        The findings about sensors of then.

    Returns
    -------
    list of dict
        As `LiveView.sensors`, with `health`, `biases`, `last_update_s`, `age_s` (None without an
        update in the last `SILENT_S`) and `diagnoses` of then. What is not retained is None:
        `updates`, `clock_lead_s` and `storm`.
    """
    recent = source.positions(at_s - SILENT_S, at_s)
    last_s = np.full(len(source.sensors), -np.inf)
    known = recent.sensor >= 0
    np.maximum.at(last_s, recent.sensor[known], recent.time_s[known])
    biases = source.bias_records(at_s)
    health = {row["sensor_id"]: row for row in source.health_records(at_s)}
    records = SensorBoard(source.sensors).records(None)
    last = dict(zip(source.sensors.ids, last_s.tolist(), strict=True))
    for record in records:
        time_s = last[record["id"]]
        updated = np.isfinite(time_s)
        record["updates"] = record["clock_lead_s"] = record["storm"] = None
        record["last_update_s"] = time_s if updated else None
        record["age_s"] = at_s - time_s if updated else None
        record["health"] = health.get(record["id"])
        record["biases"] = [bias for bias in biases if bias["sensor_id"] == record["id"]]
    add_findings(records, found)
    return records
