"""A fingerprint of all that the output depends on, apart from the measurements."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from multiradar.estimation.measurement.sensors import LATER_FIELDS, SensorTable
from multiradar.runtime.admission.admission_by_time import FORWARD_JUMP_MAX_S
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.arithmetic_kernels import arithmetic
from multiradar_schemas.sensors.sensor import SensorsFile

#: Version of the processing rules; incremented whenever a change of the program changes the output
#: of a journal's replay.
OUTPUT_RULES = 13
#: Differences of two configurations that are named; further ones are counted.
_NAMED_MAX = 5


def configuration_fingerprint(
    sensors: SensorTable,
    tracking: TrackingSettings,
    forward_jump_max_s: float = FORWARD_JUMP_MAX_S,
) -> str:
    """Return the SHA-256 of sensors, settings, rules and elementary functions.

    A journal started with one configuration cannot continue with another: its replay would not
    reproduce the tracks published before. This includes how sines are rounded
    (`multiradar_compiled.arithmetic_kernels`).

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    forward_jump_max_s : float
        Setting of the admission.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    whole = hashlib.sha256(f"rules={OUTPUT_RULES};arithmetic={arithmetic()};".encode())
    for name, value in sorted(asdict(tracking).items()):
        whole.update(f"{name}={value!r};".encode())
    whole.update(f"forward_jump_max_s={forward_jump_max_s!r};".encode())
    whole.update("\n".join(sensors.ids).encode())
    whole.update(f";aliases={sensors.aliases!r}".encode())
    for field in fields(sensors):
        value = getattr(sensors, field.name)
        # Fields added by later versions are included only where they are set.
        unset = field.name in LATER_FIELDS and not np.nan_to_num(value).any()
        if not unset and isinstance(value, np.ndarray):
            little = value.astype(value.dtype.newbyteorder("<"))
            whole.update(f";{field.name}:{little.dtype.str}:".encode() + little.tobytes())
    return whole.hexdigest()


def configuration_text(sensors: SensorsFile, tracking: TrackingSettings) -> str:
    """Return what a fingerprint is made of as JSON, in the words of its user.

    Parameters
    ----------
    sensors : SensorsFile
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    """
    return json.dumps(
        {
            "rules": OUTPUT_RULES,
            "arithmetic": arithmetic(),
            "tracking": asdict(tracking),
            "sensors": {
                one.id: one.model_dump(mode="json", exclude={"id"}, exclude_defaults=True)
                for one in sensors.sensor
            },
        },
        default=str,
    )


def differences(before: str, now: str) -> str:
    """Return how two configurations differ, in words; empty where that is unknown.

    Parameters
    ----------
    before, now : str
        What `configuration_text` returned; may be empty for a journal of an earlier version.
    """
    if not before or not now:
        return ""
    one, other = json.loads(before), json.loads(now)
    found = []
    if one["rules"] != other["rules"]:
        found.append(f"an earlier or later version (rules {one['rules']}, now {other['rules']})")
    if one["arithmetic"] != other["arithmetic"]:
        found.append("a different kind of processor")
    for name, value in _changed(one["tracking"], other["tracking"]):
        found.append(f"--filter {value}" if name == "filter_name" else f"{name} {value}")
    had, has = one["sensors"], other["sensors"]
    found += [f"sensor {name}" for name in sorted(had.keys() - has.keys())]
    found += [f"no sensor {name}" for name in sorted(has.keys() - had.keys())]
    for sensor in sorted(had.keys() & has.keys()):
        found += [f"{name} of {sensor} {it}" for name, it in _changed(had[sensor], has[sensor])]
    more = len(found) - _NAMED_MAX
    named = found[:_NAMED_MAX] if more <= 0 else [*found[:_NAMED_MAX], f"{more} more differences"]
    return "; ".join(named)


# Names whose values differ, with both.
def _changed(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[tuple[str, str]]:
    def shown(values: Mapping[str, Any], name: str) -> str:
        value = values.get(name)
        if value is None:
            return "not given"
        return value if isinstance(value, str) else json.dumps(value)

    names = dict.fromkeys((*before, *now))
    return [
        (name, f"{shown(before, name)}, now {shown(now, name)}")
        for name in names
        if before.get(name) != now.get(name)
    ]
