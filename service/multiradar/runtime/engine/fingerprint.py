"""A fingerprint of all that the output depends on, apart from the measurements."""

import hashlib
from collections.abc import Iterable
from dataclasses import asdict, fields, replace

import numpy as np

from multiradar.estimation.measurement.sensors import LATER_FIELDS, SensorTable
from multiradar.runtime.admission.admission_by_time import FORWARD_JUMP_MAX_S
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.arithmetic_kernels import arithmetic

#: Version of the processing rules; incremented whenever a change of the program changes the output
#: of a journal's replay.
OUTPUT_RULES = 13


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


def filter_of(
    fingerprint: str, sensors: SensorTable, tracking: TrackingSettings, names: Iterable[str]
) -> str | None:
    """Return the filter with which a configuration has a fingerprint; None if it is none of them.

    Parameters
    ----------
    fingerprint : str
        That of a journal.
    sensors, tracking : SensorTable, TrackingSettings
        The present configuration.
    names : iterable of str
        The filters.
    """
    for name in names:
        if configuration_fingerprint(sensors, replace(tracking, filter_name=name)) == fingerprint:
            return name
    return None
