"""Findings of the diagnosis of the running service, which hold until several windows refute them.

A window of a minute does not always show what is wrong with a sensor. A finding therefore holds
until `WINDOWS_MAX` windows in a row, in which its sensor delivered, have not repeated it.
"""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from multiradar.diagnosis.model import Diagnosis

#: Windows in a row without a finding after which it no longer holds.
WINDOWS_MAX = 3
#: Findings that hold at once, and changes of them that are retained; the oldest are discarded.
FINDINGS_MAX, CHANGES_MAX = 256, 1024
#: The page rounds the time that it asks for to this, s.
TIME_STEP_S = 1e-3

Findings = tuple[Diagnosis, ...]


@dataclass(frozen=True, slots=True)
class _Held:
    diagnosis: Diagnosis
    missed: int = 0


class HeldFindings:
    """Findings that hold, and those that held earlier; one owner."""

    def __init__(self) -> None:
        self._held: dict[tuple[str, str], _Held] = {}
        # Data time of each change, s, and the findings from then on.
        self._changes: deque[tuple[float, Findings]] = deque(maxlen=CHANGES_MAX)

    def at(self, at_s: float | None = None) -> Findings:
        """Return the findings that hold, or held at a past data time.

        Parameters
        ----------
        at_s : float or None
            The data time, s; None: the present.

        Returns
        -------
        tuple of Diagnosis
            None from before the oldest of the last `CHANGES_MAX` changes.
        """
        if at_s is None:
            return tuple(one.diagnosis for one in self._held.values())
        end_s = at_s + TIME_STEP_S
        return next((found for from_s, found in reversed(self._changes) if from_s < end_s), ())

    def update(
        self, found: Sequence[Diagnosis], delivered: Collection[str], data_time_s: float
    ) -> list[Diagnosis]:
        """Add the findings of a window; discard those that it is the last of several to refute.

        Parameters
        ----------
        found : sequence of Diagnosis
            The findings; one about a sensor with a code that is held has the newest sentence.
        delivered : collection of str
            Sensors, or sources, that delivered in the window.
        data_time_s : float
            The data time from which they hold, s.

        Returns
        -------
        list of Diagnosis
            Those that did not hold before.
        """
        latest = {(one.sensor_id, one.code): _Held(one) for one in found}
        added = [one.diagnosis for key, one in latest.items() if key not in self._held]
        kept = {
            key: _Held(one.diagnosis, one.missed + (key[0] in delivered or not key[0]))
            for key, one in self._held.items()
        }
        kept = {key: one for key, one in kept.items() if one.missed < WINDOWS_MAX or key in latest}
        self._set(kept | latest, data_time_s)
        return added

    def discard(self, sensor_ids: Collection[str], data_time_s: float) -> None:
        """Discard the findings about sensors that have changed."""
        kept = {key: one for key, one in self._held.items() if key[0] not in sensor_ids}
        self._set(kept, data_time_s)

    def clear(self) -> None:
        """Discard everything."""
        self._held.clear()
        self._changes.clear()

    def _set(self, held: dict[tuple[str, str], _Held], data_time_s: float) -> None:
        before = self.at()
        self._held = dict(list(held.items())[-FINDINGS_MAX:])
        if self.at() != before:
            self._changes.append((data_time_s, self.at()))
