"""BaseStation (SBS) messages, port 30003: lines of comma-separated values.

::

    MSG,3,1,1,4CA2D6,1,2008/11/28,14:53:50.594,2008/11/28,14:58:51.153,,37000,,,51.45735,-1.02826,,,0,0,0,0

======= ==========================================================================
field   content, from 1
======= ==========================================================================
1       `MSG`; `MLAT` for multilateration by mlat-client; `SEL`, `ID`, `AIR`, `STA`
        and `CLK` have no position
2       transmission: 1 callsign, 2 position on the ground, 3 position in the air, 4
        velocity, 5 to 8 altitude, code
5       address
7, 8    date and time of reception by the receiver
9, 10   date and time of the message
11      callsign
12      altitude, ft; with an `H` at the end geometric
13, 14  ground speed, kt, and track, degrees
15, 16  latitude and longitude, degrees
17      rate of climb, ft/min; likewise
18      code
22      on the ground: −1 or 1, in the air: 0
======= ==========================================================================

A position has no callsign, code or speed; these are those of the last messages of the aircraft.
"""

import re
from dataclasses import dataclass, field

from multiradar_converters.adsb.reading import roles
from multiradar_converters.feeds.aircraft import Aircraft
from multiradar_converters.vid.text.lines import RejectedError, unix_seconds
from multiradar_schemas.reject import RejectCode

#: The beginning of a line.
BEGIN = re.compile(rb"(?:MSG|MLAT|SEL|ID|AIR|STA|CLK),")
#: How long a value of an earlier message is valid, s: speeds and altitudes change, names do not.
CHANGING_S, LASTING_S = 5.0, 600.0

_FIELDS = 22
_WITH_POSITION = ("MSG", "MLAT")
_SURFACE = "2"
_MOMENT = re.compile(r"(\d{4})/(\d{1,2})/(\d{1,2}) (\d{1,2}):(\d{2}):(\d{2})(?:\.(\d{1,6}))?")
_ADDRESS = re.compile(r"[0-9A-Fa-f]{6}")
_GROUND = {"-1": "true", "1": "true", "0": "false"}
#: Role, field from 0, and how long it is valid.
_RETAINED = (
    (roles.CALLSIGN, 10, LASTING_S),
    (roles.CODE, 17, LASTING_S),
    (roles.SPEED, 12, CHANGING_S),
    (roles.TRACK, 13, CHANGING_S),
    (roles.CLIMB, 16, CHANGING_S),
    (roles.HEIGHT, 11, CHANGING_S),
)


@dataclass
class _Values:
    """The last values of an aircraft as text, and their times, by role."""

    values: dict[int, tuple[float, str]] = field(default_factory=dict)


class BaseStation:
    """Reads lines; retains what the positions of an aircraft need from its other messages."""

    def __init__(self) -> None:
        self._aircraft = Aircraft(_Values)

    def cells(self, line: bytes) -> dict[int, str] | None:
        """Read a line.

        Parameters
        ----------
        line : bytes
            The line without its end.

        Returns
        -------
        dict of int to str or None
            Text by role, with the time in Unix seconds as of the receiver's clock; None without a
            position.

        Raises
        ------
        RejectedError
            It is malformed.
        """
        fields = [part.strip() for part in line.decode("latin-1").split(",")]
        kind = fields[0]
        if kind not in _WITH_POSITION:
            return None
        if len(fields) < _FIELDS:
            reason = f"expected {_FIELDS} fields, found {len(fields)}"
            raise RejectedError(RejectCode.WRONG_FIELD_COUNT, reason)
        time_s = _time_s(fields)
        if _ADDRESS.fullmatch(fields[4]) is None:
            reason = f"hex ident: expected six hexadecimal digits, was {fields[4][:40]!r}"
            raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
        known = self._aircraft.of(int(fields[4], 16), time_s)
        for role, place, _ in _RETAINED:
            if fields[place]:
                known.values[role] = time_s, fields[place]
        if not fields[14] and not fields[15]:
            return None
        cells = {
            role: known.values[role][1]
            for role, _, valid_s in _RETAINED
            if role in known.values and abs(time_s - known.values[role][0]) <= valid_s
        }
        _mark_geometric(cells)
        cells[roles.TIME] = repr(time_s)
        cells[roles.LATITUDE], cells[roles.LONGITUDE] = fields[14], fields[15]
        cells[roles.ADDRESS] = fields[4]
        cells[roles.GROUND] = _on_ground(fields)
        cells[roles.KIND] = "mlat" if kind == "MLAT" else "adsb"
        return cells


def _mark_geometric(cells: dict[int, str]) -> None:
    """Separate geometric altitudes, which end with an H."""
    altitude = cells.get(roles.HEIGHT, "")
    if altitude[-1:] == "H":
        cells[roles.GEOMETRIC] = altitude[:-1]
        del cells[roles.HEIGHT]
    if roles.CLIMB in cells:
        cells[roles.CLIMB] = cells[roles.CLIMB].removesuffix("H")


def _on_ground(fields: list[str]) -> str:
    if fields[0] == "MSG" and fields[1] == _SURFACE:
        return "true"
    return _GROUND.get(fields[21], "")


def _time_s(fields: list[str]) -> float:
    text = f"{fields[6]} {fields[7]}"
    match = _MOMENT.fullmatch(text)
    if match is None:
        reason = f"date and time: expected 2008/11/28,14:53:50.594, was {text[:40]!r}"
        raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
    try:
        whole = unix_seconds(match.groups()[:6])
    except ValueError as error:
        reason = f"date and time: expected a valid date and time, was {text!r}"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason) from error
    digits = match[7] or "0"
    fraction: float = int(digits) / 10 ** len(digits)
    return whole + fraction
