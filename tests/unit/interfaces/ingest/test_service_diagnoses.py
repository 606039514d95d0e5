"""What a replay reports of the diagnosis of the service."""

from typing import Any

from multiradar.ingest.replay.memory import MemoryDestination
from multiradar.ingest.replay.service_diagnoses import PENDING_MAX_S, service_diagnoses

FOUND = {"sensor_id": "1-1", "code": "site", "sentence": "1-1: its site", "severity": "error"}


def status(pending: bool, *found: dict[str, str]) -> dict[str, Any]:
    """Return the status of a service."""
    return {"diagnosis_pending": pending, "diagnoses": list(found)}


def test_a_pending_diagnosis_is_awaited() -> None:
    pauses: list[float] = []
    destination = MemoryDestination(statuses=[status(True), status(True), status(False, FOUND)])
    (one,) = service_diagnoses(destination, {"1-1"}, pauses.append)
    assert one.document() == FOUND
    assert len(pauses) == 2


def test_a_diagnosis_that_does_not_come_is_not_awaited_for_ever() -> None:
    pauses: list[float] = []
    assert service_diagnoses(MemoryDestination(statuses=[status(True)]), (), pauses.append) == []
    assert PENDING_MAX_S - 1.0 < sum(pauses) <= PENDING_MAX_S + 1e-6


def test_findings_of_other_sensors_of_the_service_are_not_reported() -> None:
    warning = FOUND | {"severity": "warning"}
    of_all = FOUND | {"sensor_id": ""}
    other = FOUND | {"sensor_id": "9-9"}
    destination = MemoryDestination(statuses=[status(False, warning, other, of_all)])
    found = service_diagnoses(destination, {"1-1"}, lambda _seconds: None)
    assert [one.document() for one in found] == [warning, of_all]


def test_a_service_without_a_status_has_no_findings() -> None:
    assert service_diagnoses(MemoryDestination(), {"1-1"}, lambda _seconds: None) == []
