"""The keys of the interface, and what may be part of one.

::

    multiradar/v1/measurements/{sensor}   in: samples, and queries that are answered
    multiradar/v1/tracks/{track}          out, and queryable
    multiradar/v1/ended/{track}           out: a track has ended
    multiradar/v1/biases/{sensor}         out, and queryable
    multiradar/v1/sensors/{sensor}        queryable
    multiradar/v1/forecasts/{track}       queryable
    multiradar/v1/encounters              queryable
    multiradar/v1/trajectories/{track}    queryable
    multiradar/v1/status                  out, and queryable
    multiradar/v1/instances/{instance}    a liveliness token for each instance
"""

import re

from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

ROOT = "multiradar/v1"
MEASUREMENTS = f"{ROOT}/measurements"
TRACKS = f"{ROOT}/tracks"
ENDED = f"{ROOT}/ended"
BIASES = f"{ROOT}/biases"
SENSORS = f"{ROOT}/sensors"
FORECASTS = f"{ROOT}/forecasts"
ENCOUNTERS = f"{ROOT}/encounters"
TRAJECTORIES = f"{ROOT}/trajectories"
STATUS = f"{ROOT}/status"
INSTANCES = f"{ROOT}/instances"

#: Where the caches of advanced publishers of tracks answer; queries on it tell who is catching up.
TRACK_CACHES = f"{TRACKS}/*/@adv/**"
#: A liveliness token for all caches of tracks together. It names no publisher: an advanced
#: subscriber that detects late publishers answers such a token by asking for the whole history.
TRACK_HISTORY = f"{TRACKS}/*/@adv/pub/*/*/_"

_SENSOR_ID = re.compile(SENSOR_ID_PATTERN)
_TRACK_ID = re.compile(r"[1-9][0-9]{0,18}")


def last_part(key: str) -> str:
    """Return what follows the last slash of a key."""
    return key.rpartition("/")[2]


def is_sensor_id(text: str) -> bool:
    """Tell whether a text can be a sensor's identifier, and so part of a key."""
    return _SENSOR_ID.fullmatch(text) is not None


def track_id(text: str) -> int | None:
    """Return the track that a part of a key names, or None when it names none."""
    return int(text) if _TRACK_ID.fullmatch(text) else None


def sensor_key(root: str, sensor_id: str) -> str:
    """Return the key of a sensor under a root.

    Raises
    ------
    ValueError
        If the identifier has characters that mean something in a key.
    """
    if not is_sensor_id(sensor_id):
        msg = f"expected a sensor identifier of letters, digits, '.', '-', '_', was {sensor_id!r}"
        raise ValueError(msg)
    return f"{root}/{sensor_id}"
