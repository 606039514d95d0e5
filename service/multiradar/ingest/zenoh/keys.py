"""The keys of the interface, and valid parts of them.

::

    multiradar/v1/measurements/{sensor}   in: samples, and queries that are answered
    multiradar/v1/flush                   in: queries that are answered; the end of a stream
    multiradar/v1/clock                   in: queries that are answered; sets the data clock
    multiradar/v1/tracks/{track}          out, and queryable
    multiradar/v1/ended/{track}           out: a track was dropped
    multiradar/v1/biases/{sensor}         out, and queryable
    multiradar/v1/sensors/{sensor}        out: the sensor was changed; queryable
    multiradar/v1/forecasts/{track}       queryable
    multiradar/v1/encounters              queryable
    multiradar/v1/trajectories/{track}    queryable
    multiradar/v1/manoeuvre-planes/{track}, multiradar/v1/observability/{track}   queryable
    multiradar/v1/plots/{track}, multiradar/v1/residuals   queryable
    multiradar/v1/status                  out, and queryable
    multiradar/v1/instances/{instance}    a liveliness token for each instance

and, in a session of its own between the services of neighbouring regions::

    multiradar/v1/handovers/{region}      out for this region, in for its neighbours
"""

import re

from multiradar.runtime.queries.registry import Query
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

ROOT = "multiradar/v1"
MEASUREMENTS = f"{ROOT}/measurements"
FLUSH = f"{ROOT}/flush"
CLOCK = f"{ROOT}/clock"
TRACKS = f"{ROOT}/tracks"
ENDED = f"{ROOT}/ended"
BIASES = f"{ROOT}/biases"
SENSORS = f"{ROOT}/sensors"
STATUS = f"{ROOT}/status"
INSTANCES = f"{ROOT}/instances"
HANDOVERS = f"{ROOT}/handovers"

#: Key of the caches of track publishers; a query on it shows that a subscriber is catching up.
TRACK_CACHES = f"{TRACKS}/*/@adv/**"
#: Liveliness token for all track caches together. It names no publisher: an advanced subscriber
#: that detects late publishers reacts to such a token by querying the whole history.
TRACK_HISTORY = f"{TRACKS}/*/@adv/pub/*/*/_"

_SENSOR_ID = re.compile(SENSOR_ID_PATTERN)
_TRACK_ID = re.compile(r"[1-9][0-9]{0,18}")


def last_part(key: str) -> str:
    """Return the part of a key after the last slash."""
    return key.rpartition("/")[2]


def is_sensor_id(text: str) -> bool:
    """Return whether a text is a valid sensor identifier, and so a valid part of a key."""
    return _SENSOR_ID.fullmatch(text) is not None


def track_id(text: str) -> int | None:
    """Return the track identifier in a part of a key, or None."""
    return int(text) if _TRACK_ID.fullmatch(text) else None


def query_key(query: Query, track: str) -> str:
    """Return the key of a query: of one track, or of all where it is about none."""
    return f"{ROOT}/{query.plural}/{track}" if query.of_track else f"{ROOT}/{query.plural}"


def sensor_key(root: str, sensor_id: str) -> str:
    """Return the key of a sensor under a root.

    Raises
    ------
    ValueError
        If the identifier has characters that are special in a key.
    """
    if not is_sensor_id(sensor_id):
        msg = f"expected a sensor identifier of letters, digits, '.', '-', '_', was {sensor_id!r}"
        raise ValueError(msg)
    return f"{root}/{sensor_id}"
