"""JSON of readsb and dump1090: one aircraft a line, or a snapshot of all aircraft.

=============== =============================================================================
form            what it is
=============== =============================================================================
line            `{"now": 1700000000.0, "hex": "4ca8d1", "lat": …, "seen_pos": 0.3, …}`, an
                aircraft (readsb, `--net-json-port`)
snapshot        `{"now": …, "messages": …, "aircraft": [{"hex": "4ca8d1", …}, …]}`:
                `aircraft.json`, `history_0.json`; `ac` instead of `aircraft`, and `now` in
                milliseconds behind it, are those of services
snapshots       several one after another; `{"files": [snapshot, …]}` and aircraft as lists
                are those of tar1090 (`chunk_….gz`)
=============== =============================================================================

The names of the values are documented in `README-json.md` of readsb; dump1090 has `altitude` and
`speed` for `alt_baro` and `gs`. The position was received `seen_pos` seconds before `now`. An
aircraft without a position is none of the reports; values it has had no update of are absent.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.cells import json_text
from multiradar_converters.adsb.reading.roles import KNOT_MPS
from multiradar_converters.adsb.reading.time_forms import DECIMAL
from multiradar_converters.asterix.decoding.position_quality import sigma_of_category
from multiradar_converters.feeds import layouts
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode

#: The beginning of an object.
BEGIN = b"{"
#: Faults of a text, beyond one of ten aircraft, from which the rest is not read: a fault of a few
#: octets takes a hundred times as much memory.
FAULTS_MAX = 100
#: Maximum age of a position, s; readsb drops it after a minute, or ten.
AGE_MAX_S = 3600.0

# Numbers stay text, for messages and for times without loss.
_DECODER = json.JSONDecoder(parse_float=str, parse_int=str, parse_constant=str)
_FILES = re.compile(r'\s*\{\s*"files"\s*:\s*\[')
_LIST = re.compile(r'"(?:aircraft|ac)"\s*:\s*\[')
# The beginning of a snapshot, and what may be between two of them.
_BEGIN = re.compile(r'\{\s*"(?:now|ac|aircraft)"')
_BETWEEN = re.compile(r"[ \r\n\t,\]}]*")
_ADDRESS = re.compile(r"[0-9A-Fa-f]{6}")
_BLANKS = re.compile(r"[\s,]*")
_OPENING, _CLOSING = '{"_":0', '"_":0}'
# A Unix time in milliseconds.
_MILLISECONDS_S = 1e11

#: Places of the values of an aircraft as a list.
_LISTED = ("hex", "alt_baro", "gs", "track", "lat", "lon", "seen_pos", "type", "flight")

_NAMES = (
    (roles.LATITUDE, ("lat",)),
    (roles.LONGITUDE, ("lon",)),
    (roles.HEIGHT, ("alt_baro", "altitude")),
    (roles.GEOMETRIC, ("alt_geom",)),
    (roles.SPEED, ("gs", "speed")),
    (roles.ADDRESS, ("hex",)),
    (roles.CODE, ("squawk",)),
    (roles.CALLSIGN, ("flight",)),
    (roles.GROUND, ("ground",)),
    *(
        (role, ("geom_rate", "baro_rate", "vert_rate") if role == roles.CLIMB else (name,))
        for role, name in roles.NAMES_OF_READSB.items()
    ),
)
_OF_ADSB = ("adsb", "adsr")

Values = Mapping[str, object]


@dataclass(frozen=True)
class Element:
    """An aircraft of a snapshot: where it begins in the text, its text and its values."""

    place: int
    raw: str
    values: object


@dataclass(frozen=True)
class Fault:
    """Where and why a text is not a snapshot, and how many octets were skipped."""

    place: int
    octets: int
    reason: str


@dataclass
class Snapshot:
    """Aircraft at a time.

    Attributes
    ----------
    now : str
        Unix time as text; empty without.
    elements : list of Element
        The aircraft.
    others : int
        How many of them are neither an object nor a list.
    fault : Fault or None
        What was skipped.
    end : int
        Where the text continues.
    """

    now: str = ""
    elements: list[Element] = field(default_factory=list)
    others: int = 0
    fault: Fault | None = None
    end: int = 0


def parsed(text: str) -> Values:
    """Return the object of a line.

    Raises
    ------
    RejectedError
        It is not a JSON object.
    """
    try:
        value = _DECODER.decode(text)
    except RecursionError as error:
        raise RejectedError(RejectCode.MALFORMED_JSON, "the JSON is nested too deeply") from error
    except json.JSONDecodeError as error:
        reason = f"not valid JSON at character {error.pos}: {error.msg}"
        raise RejectedError(RejectCode.MALFORMED_JSON, reason) from error
    if not isinstance(value, dict):
        raise RejectedError(RejectCode.WRONG_TYPE, f"expected a JSON object, found {text[:40]!r}")
    return value


def is_snapshot(values: Values) -> bool:
    """Return whether an object is a snapshot, and not an aircraft."""
    return any(isinstance(values.get(name), list) for name in ("aircraft", "ac", "files"))


def now_of(values: Values) -> str:
    """Return the time of an aircraft of a line, Unix seconds as text; empty without."""
    return _seconds(json_text(values.get("now")))


def snapshots(text: str) -> Iterator[Snapshot]:
    """Find the snapshots of a text.

    Parameters
    ----------
    text : str
        One or several; what is between them is a fault.

    Yields
    ------
    Snapshot
        In order. Behind a fault it continues with the next snapshot, unless there were too many;
        the fault states how many octets were skipped.
    """
    end, faults, aircraft = 0, 0, 0
    for found in _snapshots(text):
        yield found
        end = found.end
        faults += found.others + (found.fault is not None)
        aircraft += len(found.elements) - found.others
        if faults > FAULTS_MAX + aircraft // 10 and end < len(text):
            why = f"more than {FAULTS_MAX} faults, the rest is not read"
            yield Snapshot(fault=_fault(end, len(text), why))
            return


def _snapshots(text: str) -> Iterator[Snapshot]:
    files = _FILES.match(text)
    at = _after(_BETWEEN, text, files.end() if files else 0)
    listed = _LIST.search(text, at)
    while listed is not None:
        before = _values(text[at : listed.start()] + _CLOSING)
        if before is None:
            begin = _begin(text, at + 1, listed)
            if begin > at:
                yield _skipped(text, at, begin)
            before = _values(text[begin : listed.start()] + _CLOSING)
        found = Snapshot(now_of(before or {}))
        following = _LIST.search(text, listed.end())
        at = _read(text, listed.end(), following.start() if following else len(text), found)
        if found.fault is not None:
            place = found.fault.place
            at = len(text) if following is None else _begin(text, place, following)
            found.fault = _fault(place, at, found.fault.reason)
        found.end = at = _after(_BETWEEN, text, at)
        yield found
        listed = following
    if at < len(text):
        yield _skipped(text, at, len(text))


def cells(values: object, now: str) -> dict[int, str] | None:
    """Read an aircraft.

    Parameters
    ----------
    values : object
        Its values by name, or a list of tar1090.
    now : str
        Unix time, s; empty if unknown.

    Returns
    -------
    dict of int to str or None
        Text by role; None without a position.

    Raises
    ------
    RejectedError
        It is not an aircraft, its position is not from the aircraft, or a value is malformed.
    """
    if isinstance(values, list):
        values = dict(zip(_LISTED, values, strict=False))
    if not isinstance(values, dict):
        raise RejectedError(RejectCode.WRONG_TYPE, "expected a JSON object for each aircraft")
    found = _by_role(values)
    if not found.get(roles.LATITUDE) and not found.get(roles.LONGITUDE):
        return None
    found[roles.KIND] = _kind(values)
    if found[roles.KIND] == "adsb" and DECIMAL.fullmatch(found.get(roles.HEIGHT, "")):
        # Reports from the ground have the altitude "ground".
        found.setdefault(roles.GROUND, "false")
    age = json_text(values.get("seen_pos"))
    found[roles.TIME] = _received(now, age)
    if found[roles.KIND] == "adsb":
        found[layouts.SIGMA] = repr(_sigma_m(values, math.hypot(_step_s(now), _step_s(age))))
    return found


def _by_role(values: Values) -> dict[int, str]:
    found = {}
    for role, names in _NAMES:
        name = next((name for name in names if name in values), None)
        if name is not None:
            found[role] = json_text(values[name])
    return found


def message_of(found: Mapping[int, str], now: str) -> tuple[int, float]:
    """Return address and time, s, of what `cells` returned; 0 and NaN for malformed ones."""
    address = found.get(roles.ADDRESS, "")
    known = _ADDRESS.fullmatch(address) is not None
    time_s = float(now) if DECIMAL.fullmatch(now) else float("nan")
    return int(address, 16) if known else 0, time_s


def _kind(values: Values) -> str:
    address, source = json_text(values.get("hex")), json_text(values.get("type"))
    if address.startswith("~"):
        reason = f"hex: expected an aircraft address, was {address[:40]!r} (TIS-B, ADS-R)"
        raise RejectedError(RejectCode.UNKNOWN_KIND, reason)
    by_multilateration, by_ground = values.get("mlat"), values.get("tisb")
    if source == "mlat" or (isinstance(by_multilateration, list) and "lat" in by_multilateration):
        return "mlat"
    rebroadcast = isinstance(by_ground, list) and "lat" in by_ground
    if rebroadcast or (source and not source.startswith(_OF_ADSB)):
        was = "TIS-B" if rebroadcast else repr(source[:40])
        reason = f"type: expected a position from ADS-B or multilateration, was {was}"
        raise RejectedError(RejectCode.UNKNOWN_KIND, reason)
    return "adsb"


def _received(now: str, age: str) -> str:
    # Text that is not a number is kept for the error message.
    if not (DECIMAL.fullmatch(now) and age):
        return now
    if not DECIMAL.fullmatch(age):
        reason = f"seen_pos: expected a number, was {age[:40]!r}"
        raise RejectedError(RejectCode.NOT_A_NUMBER, reason)
    if not -1.0 <= float(age) <= AGE_MAX_S:
        reason = f"seen_pos: expected at most {AGE_MAX_S:g} s, was {age[:40]}"
        raise RejectedError(RejectCode.OUT_OF_RANGE, reason)
    return repr(float(now) - float(age))


def _sigma_m(values: Values, step_s: float) -> float:
    """Return the standard deviation of a position, m: of the aircraft's, and of its time.

    `now` and `seen_pos` are rounded to steps, `step_s` together; along the track, the error of
    their difference counts with the speed.
    """
    nacp, radius_m, speed_kt = (_number(values.get(name)) for name in ("nac_p", "rc", "gs"))
    sigma_m = sigma_of_category(nacp, radius_m)
    rounding_s = step_s / math.sqrt(12.0)
    along_m = rounding_s * speed_kt * KNOT_MPS if speed_kt > 0.0 else 0.0
    return math.hypot(sigma_m, along_m)


def _number(value: object) -> float:
    text = json_text(value)
    return float(text) if DECIMAL.fullmatch(text) else math.nan


def _step_s(text: str) -> float:
    """Return the step of a time by its decimals; programs that drop zeros have tenths at least."""
    return 10.0 ** -max(1, len(text.partition(".")[2]))


def _seconds(now: str) -> str:
    if DECIMAL.fullmatch(now) and float(now) >= _MILLISECONDS_S:
        return repr(float(now) / 1000.0)
    return now


def _read(text: str, begin: int, end: int, found: Snapshot) -> int:
    """Read a list and what follows it up to the next one, `end`; return where the snapshot ends."""
    # The error of a decoder costs as much as the text before it is long: without that before.
    part, at = text[begin:end], 0
    while True:
        at = _after(_BLANKS, part, at)
        if part[at : at + 1] == "]":
            return begin + _closed(part, at + 1, begin, found)
        try:
            value, after = _DECODER.raw_decode(part, at)
        except (json.JSONDecodeError, RecursionError) as error:
            place = error.pos if isinstance(error, json.JSONDecodeError) else at
            reason = f"not valid JSON at character {begin + place}: {error.args[0][:80]}"
            found.fault = Fault(begin + at, 0, reason)
            return begin + at
        if not isinstance(value, dict | list):
            if found.others >= FAULTS_MAX:
                reason = f"expected aircraft, found more than {FAULTS_MAX} other values"
                found.fault = Fault(begin + at, 0, reason)
                return begin + at
            found.others += 1
        found.elements.append(Element(begin + at, part[at:after], value))
        at = after


def _closed(part: str, at: int, begin: int, found: Snapshot) -> int:
    """Read what follows the list; return where the snapshot ends."""
    try:
        values, after = _DECODER.raw_decode(_OPENING + part[at:])
    except (json.JSONDecodeError, RecursionError):
        found.fault = Fault(begin + at, 0, "unexpected data after the list of aircraft")
        return at
    found.now = found.now or now_of(values)
    return at + after - len(_OPENING)


def _values(text: str) -> Values | None:
    try:
        value = _DECODER.decode(text)
    except (json.JSONDecodeError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def _begin(text: str, at: int, listed: re.Match[str]) -> int:
    """Return where the snapshot of a list begins; the list itself if its beginning is unknown."""
    begin = listed.start()
    for match in _BEGIN.finditer(text, at, listed.end()):
        begin = match.start()
    return begin


def _skipped(text: str, at: int, end: int) -> Snapshot:
    reason = f"expected a list of aircraft, found {text[at : min(at + 40, end)]!r}"
    return Snapshot(fault=_fault(at, end, reason), end=end)


def _fault(at: int, end: int, reason: str) -> Fault:
    return Fault(at, end - at, f"{reason}; {end - at} octets skipped")


def _after(pattern: re.Pattern[str], text: str, at: int) -> int:
    match = pattern.match(text, at)
    return match.end() if match else at
