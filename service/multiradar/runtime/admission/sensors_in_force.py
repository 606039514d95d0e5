"""The sensors at one place of the journal: those of the sensors file, with the changes since.

A change is an entry of the journal: the whole description of one sensor, as in the sensors file,
and whether its biases start from their priors. Sensors are never removed, and new ones come last:
the number of a sensor means the same in the whole journal.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

from multiradar import wire
from multiradar.errors import ConfigurationError, JournalError
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable
from multiradar_schemas.errors import DocumentError
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile, with_sensor

#: Changes of sensors listed in the status, the last ones.
CHANGES_MAX = 50
_SENSOR, _RESET = "sensor", "reset_biases"


class SensorPlan(NamedTuple):
    """A change of a sensor, before it is made.

    Attributes
    ----------
    change : bytes
        For the journal; empty if nothing changes.
    added : bool
        Whether the sensor is new.
    changes : list of dict
        `field`, and its values `before` and `after`; of a new sensor those that are given.
    biases_reset : list of str
        Its bias parameters that start from their priors.
    health_reset : bool
        Whether its health (noise, site, detection) is learnt again.
    """

    change: bytes
    added: bool
    changes: list[dict[str, Any]]
    biases_reset: list[str]
    health_reset: bool


@dataclass(frozen=True, slots=True)
class SensorsInForce:
    """Sensors, as a table and as they are described.

    Attributes
    ----------
    table : SensorTable
        The table.
    file : SensorsFile or None
        Their descriptions, in the order of the table; None where they cannot change.
    """

    table: SensorTable
    file: SensorsFile | None = None

    @classmethod
    def of(cls, table: SensorTable, file: SensorsFile | None) -> Self:
        """Return the sensors of a sensors file, in any order."""
        return cls(table, None if file is None else wire.in_order_of_ids(file))

    def plan(
        self, sensor_id: str, values: Mapping[str, Any], *, reset_biases: bool = False
    ) -> SensorPlan:
        """Return what a change of a sensor would do.

        Parameters
        ----------
        sensor_id : str
            The sensor; one that is unknown is added.
        values : mapping
            Its description: the keys of a sensor in the sensors file, without those left out.
        reset_biases : bool
            Whether its biases start from their priors even if its site is the same.

        Raises
        ------
        ConfigurationError
            If the description is invalid, or something cannot change while the service runs.
        """
        given = values.get("id", sensor_id)
        if given != sensor_id:
            raise ConfigurationError(
                f"id: expected {sensor_id}, the sensor in the URL, was {given!r:.80}"
            )
        document = _document(sensor_id, values, reset_biases)
        new, change = self._changed(document)
        row = new.table.ids.index(sensor_id)
        before, after, names = self._difference(new, row, values)
        added = not before
        reset = not added and bool(change.reset[row])
        own = new.table.parameter_kind[new.table.parameter_sensor == row].tolist()
        return SensorPlan(
            _encoded(document) if names or reset else b"",
            added,
            [{"field": n, "before": before.get(n), "after": after[n]} for n in names],
            [PARAMETER_NAMES[kind] for kind in own] if reset or added else [],
            added or bool(change.relearnt[row]),
        )

    def changed(self, change: bytes) -> tuple["SensorsInForce", SensorChange]:
        """Return the sensors after a change of the journal, and what it means.

        Raises
        ------
        ConfigurationError
            As `plan`.
        JournalError
            If it is no change of a sensor.
        """
        try:
            document = json.loads(change)
            return self._changed(document)
        except (KeyError, TypeError, ValueError) as error:
            raise JournalError(f"expected a sensor change, found {change!r:.200}") from error

    def record(self, new: "SensorsInForce", what: SensorChange, change: bytes) -> dict[str, Any]:
        """Return what a change did, for the status.

        Returns
        -------
        dict
            `sensor_id`; `added`; `fields` that differ, of a new sensor those given; `biases_reset`:
            whether its biases started from their priors.
        """
        given = json.loads(change)[_SENSOR]
        row = new.table.ids.index(given["id"])
        before, _, names = self._difference(new, row, given)
        return {
            "sensor_id": given["id"],
            "added": not before,
            "fields": sorted(names),
            "biases_reset": not before or bool(what.reset[row]),
        }

    def texts(self) -> list[str]:
        """Return the given values of all sensors, for a snapshot."""
        sensors = () if self.file is None else self.file.sensor
        return [one.model_dump_json(exclude_unset=True) for one in sensors]

    def with_texts(self, texts: Sequence[str]) -> "SensorsInForce":
        """Return the sensors of a snapshot."""
        file = SensorsFile(sensor=tuple(Sensor.model_validate_json(one) for one in texts))
        return SensorsInForce(wire.sensor_table(file, in_order=True), file)

    def description(self, sensor_id: str) -> dict[str, Any] | None:
        """Return the given values of a sensor, as in the sensors file; None for no such sensor."""
        for one in () if self.file is None else self.file.sensor:
            if one.id == sensor_id:
                return one.model_dump(mode="json", exclude_unset=True)
        return None

    # All values of a sensor before and after a change, before is empty if it is new; and the fields
    # that differ, of a new sensor those that are given.
    def _difference(
        self, new: "SensorsInForce", row: int, given: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
        after = _described(new, row)
        if row >= len(self.table):
            return {}, after, [name for name in after if name in given]
        before = _described(self, row)
        return before, after, [name for name in after if before[name] != after[name]]

    def _changed(self, document: Any) -> tuple["SensorsInForce", SensorChange]:
        if self.file is None:
            raise ConfigurationError(
                "sensors cannot be changed: the service was started without sensor descriptions"
            )
        values, reset = document[_SENSOR], document[_RESET]
        try:
            file = with_sensor(self.file, values)
        except DocumentError as error:
            raise ConfigurationError("; ".join(error.reasons)) from error
        new = SensorsInForce(wire.sensor_table(file, in_order=True), file)
        row = new.table.ids.index(values["id"])
        again = row if reset and row < len(self.table) else -1
        return new, SensorChange.between(self.table, new.table, again)


def _described(sensors: SensorsInForce, row: int) -> dict[str, Any]:
    assert sensors.file is not None, "only sensors with a description can be changed"
    return sensors.file.sensor[row].model_dump(mode="json")


def sensor_change(sensor_id: str, values: Mapping[str, Any], *, reset_biases: bool) -> bytes:
    """Return the change of the journal after which a sensor is as described.

    Parameters
    ----------
    sensor_id, values, reset_biases
        See `SensorsInForce.plan`.

    Raises
    ------
    ConfigurationError
        If a number is not finite.
    """
    try:
        return _encoded(_document(sensor_id, values, reset_biases))
    except ValueError as error:
        raise ConfigurationError("expected finite numbers") from error


def changed_sensor(change: bytes) -> str:
    """Return the sensor of a change of the journal."""
    return str(json.loads(change)[_SENSOR]["id"])


def change_to(sensor: Sensor) -> bytes:
    """Return the change after which a sensor is as described."""
    values = sensor.model_dump(mode="json", exclude_unset=True)
    return _encoded({_SENSOR: values, _RESET: False})


def _document(sensor_id: str, values: Mapping[str, Any], reset_biases: bool) -> dict[str, Any]:
    return {_SENSOR: {**values, "id": sensor_id}, _RESET: reset_biases}


def _encoded(document: Mapping[str, Any]) -> bytes:
    return json.dumps(document, sort_keys=True, ensure_ascii=False, allow_nan=False).encode()
