"""Traces of readsb and tar1090 (`trace_full_ADDRESS.json`): one aircraft, one list per point.

::

    {"icao": "3c6444", "r": "D-AIBD", …, "timestamp": 1609275898.495, "trace": [point, …]}

======= ==========================================================================
index   content
======= ==========================================================================
0       seconds after `timestamp`
1, 2    latitude and longitude, degrees
3       barometric altitude, ft; "ground"; null
4       ground speed, kt, or null
5       track, degrees, or null
6       bits: 1 a gap before this point, 2 a new flight, 4 geometric rate of climb,
        8 index 3 is a geometric altitude
7       rate of climb, ft/min, or null
8       an object with `flight`, `squawk`, airspeeds, headings and more, or null
9       source of the position, such as `adsb_icao` or `mlat` (since 2022)
10      geometric altitude, ft, or null (since 2022)
12, 13  indicated airspeed, kt, and roll, degrees, or null (since 2022)
======= ==========================================================================

An address with a leading `~` is not an aircraft address (TIS-B); its points are rejected. So are
positions whose source is neither ADS-B nor multilateration.
"""

import json
import math
import re
from collections.abc import Callable

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.cells import Pairs, json_text, json_value
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.adsb.reading.roles import NAMES_OF_READSB, SCALE_OF_READSB, Chosen
from multiradar_converters.adsb.reading.time_forms import DECIMAL
from multiradar_converters.errors import LayoutError
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode

TRACE = re.compile(rb'"trace"\s*:\s*\[')

_POINT_VALUES_MIN = 4
_TRACK, _FLAGS, _CLIMB, _DETAILS, _SOURCE, _GEOMETRIC, _INDICATED, _ROLL = 5, 6, 7, 8, 9, 10, 12, 13
_ALTITUDE_IS_GEOMETRIC = 8
_OF_ADSB = ("adsb", "adsr")

# Other values of the details are repeated from the columns.
_DETAILED = (
    roles.HEADING, roles.TURN, roles.TRUE_AIRSPEED, roles.INDICATED, roles.MACH, roles.ROLL,
    roles.SELECTED,
)  # fmt: skip

#: Layout of the points.
LAYOUT = Layout(
    Chosen(
        names={
            roles.TIME: "timestamp",
            roles.LATITUDE: "latitude",
            roles.LONGITUDE: "longitude",
            roles.HEIGHT: "altitude",
            roles.GEOMETRIC: "geometric altitude",
            roles.SPEED: "ground speed",
            roles.ADDRESS: "icao",
            roles.CODE: "squawk",
            roles.CALLSIGN: "flight",
            **NAMES_OF_READSB,
        },
        scale=SCALE_OF_READSB,
    ),
    "unix-s",
    "unix-s",
)


def trace_reader(file: str, head: bytes) -> Callable[[bytes], dict[int, str]]:
    """Return the parser of points.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    head : bytes
        Text before the first point.

    Returns
    -------
    callable
        Returns the values of a point by role; raises RejectedError.

    Raises
    ------
    LayoutError
        The head has no address or time.
    """
    match = TRACE.search(head)
    try:
        said = json.loads(head[: match.start() if match else 0] + b'"trace":0}')
        begin_s, address = float(said["timestamp"]), str(said["icao"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        msg = f"{file}: missing icao and timestamp before the points of the trace"
        raise LayoutError(msg) from error
    if not math.isfinite(begin_s):
        msg = f"{file}: expected a trace timestamp in Unix seconds, was {begin_s}"
        raise LayoutError(msg)

    def cells_of(raw: bytes) -> dict[int, str]:
        return _point(raw, begin_s, address)

    return cells_of


def _point(raw: bytes, begin_s: float, address: str) -> dict[int, str]:
    point = json_value(raw)
    if not isinstance(point, list):
        raise RejectedError(RejectCode.WRONG_TYPE, "expected a list for each point of a trace")
    if len(point) < _POINT_VALUES_MIN:
        reason = f"expected at least {_POINT_VALUES_MIN} values per point, found {len(point)}"
        raise RejectedError(RejectCode.WRONG_FIELD_COUNT, reason)
    cells = {
        roles.TIME: _moment(json_text(point[0]), begin_s),
        roles.LATITUDE: json_text(point[1]),
        roles.LONGITUDE: json_text(point[2]),
        roles.ADDRESS: address,
        roles.KIND: _kind(point),
    }
    altitude = json_text(point[3])
    flags = json_text(_at(point, _FLAGS))
    is_integer = flags.isascii() and flags.isdecimal()
    if is_integer and int(flags[:6]) & _ALTITUDE_IS_GEOMETRIC and altitude != "ground":
        cells[roles.GEOMETRIC] = altitude
    else:
        cells[roles.HEIGHT] = altitude
        cells[roles.GEOMETRIC] = json_text(_at(point, _GEOMETRIC))
    cells[roles.SPEED] = json_text(_at(point, 4))
    for role, place in (
        (roles.TRACK, _TRACK), (roles.CLIMB, _CLIMB), (roles.INDICATED, _INDICATED),
        (roles.ROLL, _ROLL),
    ):  # fmt: skip
        cells[role] = json_text(_at(point, place))
    details = _at(point, _DETAILS)
    if isinstance(details, Pairs):
        named = dict(details.pairs)
        cells[roles.CALLSIGN] = json_text(named.get("flight"))
        cells[roles.CODE] = json_text(named.get("squawk"))
        for role in _DETAILED:
            if not cells.get(role):
                cells[role] = json_text(named.get(NAMES_OF_READSB[role]))
    return cells


def _moment(text: str, begin_s: float) -> str:
    # Text that is not a number is kept for the error message.
    return repr(begin_s + float(text)) if DECIMAL.fullmatch(text) else text


def _kind(point: list[object]) -> str:
    source = json_text(_at(point, _SOURCE))
    if source == "mlat":
        return "mlat"
    if source and not source.startswith(_OF_ADSB):
        reason = f"position source: expected ADS-B or multilateration, was {source[:40]!r}"
        raise RejectedError(RejectCode.UNKNOWN_KIND, reason)
    return "adsb"


def _at(point: list[object], place: int) -> object:
    return point[place] if place < len(point) else None
