"""A diagnosis: one sentence about one sensor."""

from dataclasses import asdict, dataclass
from typing import Literal

#: An error makes the result doubtful; with a warning it can be used.
Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is probably wrong.

    Attributes
    ----------
    sensor_id : str
        The sensor, or the name of a source that is not configured; empty when it is about all.
    code : str
        The cause, for programs, such as `range_unit`.
    sentence : str
        The cause and what to do; starts with the sensor's name.
    severity : str
        ``error`` or ``warning``.
    """

    sensor_id: str
    code: str
    sentence: str
    severity: Severity = "error"

    def document(self) -> dict[str, str]:
        """Return it as a JSON object."""
        return asdict(self)


def first_of(*found: Diagnosis | None) -> list[Diagnosis]:
    """Return the first error, else the first warning."""
    known = [one for one in found if one is not None]
    return sorted(known, key=lambda one: one.severity != "error")[:1]
