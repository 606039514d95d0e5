"""Diagnoses that a service makes of a recording replayed to it."""

from collections.abc import Callable, Collection

from multiradar.diagnosis.model import Diagnosis
from multiradar.ingest.replay.replaying import Destination

#: How long to wait for the diagnosis of the last measurements, s; it takes a second or two.
PENDING_MAX_S = 30.0
_PAUSE_S = 0.2


def service_diagnoses(
    destination: Destination, sensor_ids: Collection[str], pause: Callable[[float], None]
) -> list[Diagnosis]:
    """Return what the service has found in the measurements of some sensors.

    Parameters
    ----------
    destination : Destination
        The service; the stream has ended there.
    sensor_ids : collection of str
        Sensors of the recording; the service may have others, too.
    pause : callable
        Waits for a number of seconds, while the diagnosis is pending.

    Returns
    -------
    list of Diagnosis
        Empty if the service does not report any, or takes longer than `PENDING_MAX_S`.
    """
    status = destination.status()
    for _ in range(int(PENDING_MAX_S / _PAUSE_S)):
        if not status.get("diagnosis_pending"):
            break
        pause(_PAUSE_S)
        status = destination.status()
    found = [_diagnosis(one) for one in status.get("diagnoses") or () if isinstance(one, dict)]
    return [one for one in found if not one.sensor_id or one.sensor_id in sensor_ids]


def _diagnosis(document: dict[str, str]) -> Diagnosis:
    return Diagnosis(
        sensor_id=document.get("sensor_id", ""),
        code=document.get("code", ""),
        sentence=document.get("sentence", ""),
        severity="warning" if document.get("severity") == "warning" else "error",
    )
