"""Findings of a diagnosis in the records of sensors, now, at a past time and of a recorded run."""

from collections.abc import Mapping, Sequence
from typing import Any

#: The code of a wrong site, and the alarm.
_SITE = "site"

Found = Sequence[Mapping[str, Any]]


def add_findings(records: Sequence[dict[str, Any]], found: Found) -> None:
    """Set the `diagnoses` of sensors, and remove their alarms that have another cause.

    Parameters
    ----------
    records : sequence of dict
        The sensors, as in `LiveView.sensors`; changed in place.
    found : sequence of mapping
        The findings, as of `Diagnosis.document`.
    """
    for record in records:
        sensor_id, health = record["id"], record["health"]
        record["diagnoses"] = [one for one in found if one.get("sensor_id") == sensor_id]
        if health is not None and health["alarms"]:
            alarms = confirmed(sensor_id, health["alarms"].split(","), found)
            record["health"] = {**health, "alarms": ",".join(alarms)}


def confirmed(sensor_id: str, alarms: Sequence[str], found: Found) -> list[str]:
    """Return the alarms of a sensor without `site` while the wrong site is that of another.

    Tracks follow the most accurate radar; if its site is wrong, the others seem displaced.
    """
    sites = {one.get("sensor_id") for one in found if one.get("code") == _SITE}
    is_other = bool(sites) and sensor_id not in sites
    return [one for one in alarms if not (is_other and one == _SITE)]
