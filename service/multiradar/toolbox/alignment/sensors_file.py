"""A sensors file with the biases of a registration as priors."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from multiradar_schemas import bounds
from multiradar_schemas.alignment import AlignedBias
from multiradar_schemas.bounds import ParameterBounds
from multiradar_schemas.sensors.sensor import SensorsFile

#: Significant digits of a sigma; an estimate ends with the same decimal.
_DIGITS = 3


def aligned_sensors(sensors: SensorsFile, biases: Iterable[AlignedBias], command: str) -> str:
    """Return a sensors file with new priors.

    Parameters
    ----------
    sensors : SensorsFile
        The sensors; all that is not estimated is kept.
    biases : iterable of AlignedBias
        The biases.
    command : str
        The command line, for the comment.
    """
    found = {(one.sensor_id, one.parameter): one for one in biases}
    lines = [f"# Biases by {' '.join(command.split())}: measured minus true, with their sigma."]
    for sensor in sensors.sensor:
        given = sensor.model_dump(mode="json", exclude_unset=True)
        own = {name: dict(one) for name, one in given.pop("bias", {}).items()}
        for (name, parameter), one in found.items():
            if name == sensor.id:
                own[parameter] = own.get(parameter, {}) | _prior(one)
        lines += ["", "[[sensor]]", *_members(given)]
        lines += [
            f"bias.{parameter} = {{ {', '.join(_members(one))} }}" for parameter, one in own.items()
        ]
    return "\n".join(lines) + "\n"


def _prior(one: AlignedBias) -> dict[str, Any]:
    # The bounds are named after the parameters.
    limits: ParameterBounds = getattr(bounds, one.parameter.upper())
    estimate = min(max(one.estimate, -limits.value), limits.value)
    sigma = min(max(one.sigma, limits.sigma.least), limits.sigma.most)
    decimals = _DIGITS - 1 - int(f"{sigma:e}".split("e")[1])
    return {
        "estimate": True,
        "prior": round(estimate, max(decimals, 0)),
        "prior_sigma": float(f"{sigma:.{_DIGITS}g}"),
    }


def _members(table: Mapping[str, Any]) -> list[str]:
    return [f"{name} = {_value(value)}" for name, value in table.items() if value is not None]


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # Escapes of JSON are those of a basic string.
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    return repr(value)
