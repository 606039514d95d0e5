"""Roles of columns: their names and factors to SI units.

Names are compared without case. A name determines the unit of its column:

========================= =====================================================================
role, unit                names
========================= =====================================================================
time (see `time_forms`)   `timestamp`, `time`, `time_s`, `datetime`
latitude, degree          `latitude`, `lat`, `latitude_deg`
longitude, degree         `longitude`, `lon`, `lng`, `longitude_deg`
address, 6 hexadecimal    `icao24`, `icao`, `hex`, `address`, `mode_s_address`
digits
barometric height, ft     `altitude`, `alt_baro`, `altitude_ft`
barometric height, m      `baroaltitude`, `baro_altitude`, `altitude_m`, `height_m`
geometric height, ft      `alt_geom`, `geoaltitude_ft`; `geoaltitude` beside a height in feet
geometric height, m       `geo_altitude`, `geoaltitude_m`; `geoaltitude` beside one in metres
ground speed, kt          `groundspeed`, `gs`
ground speed, m/s         `velocity`, `groundspeed_mps`
track over ground, degree `track`, `true_track`
vertical rate, ft/min     `baro_rate`, `vert_rate`; `vertical_rate` beside a speed in knots
vertical rate, m/s        `vertrate`; `vertical_rate` beside a speed in m/s
magnetic heading, degree  `mag_heading`
roll, degree              `roll`
track angle rate,         `track_rate`
degree/s
true airspeed, kt         `tas`
indicated airspeed, kt    `ias`
Mach number               `mach`
selected altitude, ft     `nav_altitude_mcp`, `selected_mcp`
callsign                  `callsign`, `flight`
code, octal digits        `squawk`, `mode_3a`
on the ground, boolean    `onground`, `on_ground`
time of the position      `last_position`, `lastposupdate`, `time_position`
========================= =====================================================================

`altitude`, `geoaltitude`, `groundspeed` in feet and knots are the names of the Python library
traffic; `baroaltitude`, `geoaltitude`, `velocity` in metres those of the OpenSky Network; `lat`,
`alt_baro`, `alt_geom`, `gs` those of readsb and tar1090. `heading` is not read: it is the track of
OpenSky, and the magnetic heading of traffic.
"""

from dataclasses import dataclass

from multiradar_converters.errors import LayoutError

FOOT_M = 0.3048
KNOT_MPS = 1852.0 / 3600.0
FOOT_PER_MIN_M_S = FOOT_M / 60.0

TIME, LATITUDE, LONGITUDE, HEIGHT, GEOMETRIC, SPEED, POSITION_TIME = range(7)
#: Aircraft-derived data, beside the speed.
TRACK, CLIMB, HEADING, ROLL, TURN, TRUE_AIRSPEED, INDICATED, MACH, SELECTED = range(7, 16)
#: Roles from here on are integers.
FIRST_WORD = 16
ADDRESS, CODE, CALLSIGN, GROUND, KIND = range(FIRST_WORD, FIRST_WORD + 5)
NUMBERS, WORDS = FIRST_WORD, 5

#: Roles of the columns of `quantities.QUANTITIES`.
OF_AIRCRAFT = (
    HEADING, ROLL, TRACK, TURN, SPEED, TRUE_AIRSPEED, INDICATED, MACH, CLIMB, SELECTED,
)  # fmt: skip

ROLE_NAMES = (
    "time", "latitude", "longitude", "height", "geometric height", "ground speed",
    "position time", "track", "vertical rate", "magnetic heading", "roll",
    "track angle rate", "true airspeed", "indicated airspeed", "Mach number",
    "selected altitude", "address", "code", "callsign", "on the ground",
    "kind",
)  # fmt: skip

#: Integers that are absent, and that cannot be read.
ABSENT, UNREADABLE = -1, -2

_BOTH = 0.0
#: Role and factor to SI of each name.
COLUMNS: dict[str, tuple[int, float]] = {
    **dict.fromkeys(("timestamp", "time", "time_s", "datetime"), (TIME, 1.0)),
    **dict.fromkeys(("latitude", "lat", "latitude_deg"), (LATITUDE, 1.0)),
    **dict.fromkeys(("longitude", "lon", "lng", "longitude_deg"), (LONGITUDE, 1.0)),
    **dict.fromkeys(("icao24", "icao", "hex", "address", "mode_s_address"), (ADDRESS, 1.0)),
    **dict.fromkeys(("altitude", "alt_baro", "altitude_ft"), (HEIGHT, FOOT_M)),
    **dict.fromkeys(("baroaltitude", "baro_altitude", "altitude_m", "height_m"), (HEIGHT, 1.0)),
    **dict.fromkeys(("alt_geom", "geoaltitude_ft"), (GEOMETRIC, FOOT_M)),
    **dict.fromkeys(("geo_altitude", "geoaltitude_m"), (GEOMETRIC, 1.0)),
    "geoaltitude": (GEOMETRIC, _BOTH),
    **dict.fromkeys(("groundspeed", "gs"), (SPEED, KNOT_MPS)),
    **dict.fromkeys(("velocity", "groundspeed_mps"), (SPEED, 1.0)),
    **dict.fromkeys(("track", "true_track"), (TRACK, 1.0)),
    **dict.fromkeys(("baro_rate", "vert_rate"), (CLIMB, FOOT_PER_MIN_M_S)),
    "vertrate": (CLIMB, 1.0),
    "vertical_rate": (CLIMB, _BOTH),
    "mag_heading": (HEADING, 1.0),
    "roll": (ROLL, 1.0),
    "track_rate": (TURN, 1.0),
    "tas": (TRUE_AIRSPEED, KNOT_MPS),
    "ias": (INDICATED, KNOT_MPS),
    "mach": (MACH, 1.0),
    **dict.fromkeys(("nav_altitude_mcp", "selected_mcp"), (SELECTED, FOOT_M)),
    **dict.fromkeys(("callsign", "flight"), (CALLSIGN, 1.0)),
    **dict.fromkeys(("squawk", "mode_3a"), (CODE, 1.0)),
    **dict.fromkeys(("onground", "on_ground"), (GROUND, 1.0)),
    **dict.fromkeys(("last_position", "lastposupdate", "time_position"), (POSITION_TIME, 1.0)),
}

#: Names of aircraft-derived data of readsb, and factors of its numbers.
NAMES_OF_READSB = {
    TRACK: "track",
    CLIMB: "baro_rate",
    HEADING: "mag_heading",
    ROLL: "roll",
    TURN: "track_rate",
    TRUE_AIRSPEED: "tas",
    INDICATED: "ias",
    MACH: "mach",
    SELECTED: "nav_altitude_mcp",
}
SCALE_OF_READSB = {
    HEIGHT: FOOT_M,
    GEOMETRIC: FOOT_M,
    SPEED: KNOT_MPS,
    **{role: COLUMNS[name][1] for role, name in NAMES_OF_READSB.items()},
}

#: Names of heights with an unknown unit.
_UNIT_UNKNOWN = ("alt", "height", "h", "elevation", "geo_alt", "baro_alt")

_NEEDED = (TIME, LATITUDE, LONGITUDE, ADDRESS)


@dataclass(frozen=True)
class Chosen:
    """The used columns of a file.

    Attributes
    ----------
    names : dict of int to str
        Name of the column of each role.
    scale : dict of int to float
        Factor to SI of each role.
    """

    names: dict[int, str]
    scale: dict[int, float]


def choose_columns(file: str, found: list[str]) -> Chosen:
    """Assign roles to the columns of a file.

    Parameters
    ----------
    file : str
        Its name, for messages.
    found : list of str
        Names of its columns.

    Returns
    -------
    Chosen
        The used columns.

    Raises
    ------
    LayoutError
        A required column is missing, two columns have the same role, or a unit is unknown.
    """
    names: dict[int, str] = {}
    scale: dict[int, float] = {}
    for name in found:
        role, factor = COLUMNS.get(name.strip().lower(), (-1, 0.0))
        # Of several columns of aircraft-derived data the first is used.
        if role < 0 or (role in names and TRACK <= role < FIRST_WORD):
            continue
        if role in names:
            msg = (
                f"{file}: expected one column for the {ROLE_NAMES[role]}, found {names[role]!r} "
                f"and {name!r}"
            )
            raise LayoutError(msg)
        names[role], scale[role] = name, factor
    for role in _NEEDED:
        if role not in names:
            _reject_missing(file, role, found)
    _reject_unknown_units(file, names, found)
    _derive_units(file, names, scale)
    return Chosen(names, scale)


def _derive_units(file: str, names: dict[int, str], scale: dict[int, float]) -> None:
    """Derive units from those of other columns, in place."""
    if scale.get(GEOMETRIC) == _BOTH:
        if HEIGHT not in scale:
            msg = (
                f"{file}: the unit of {names[GEOMETRIC]!r} is unknown: only a column altitude (ft) "
                f"or baroaltitude (m) in the same file determines the unit"
            )
            raise LayoutError(msg)
        scale[GEOMETRIC] = scale[HEIGHT]
    if scale.get(CLIMB) == _BOTH:
        if SPEED in scale:
            scale[CLIMB] = FOOT_PER_MIN_M_S if scale[SPEED] == KNOT_MPS else 1.0
        else:
            # A vertical rate of unknown unit is not read.
            del names[CLIMB], scale[CLIMB]


def _reject_missing(file: str, role: int, found: list[str]) -> None:
    known = ", ".join(name for name, (other, _) in COLUMNS.items() if other == role)
    shown = ", ".join(name[:40] for name in found[:20])
    msg = f"{file}: expected a column for the {ROLE_NAMES[role]} ({known}), found {shown or 'none'}"
    raise LayoutError(msg)


def _reject_unknown_units(file: str, names: dict[int, str], found: list[str]) -> None:
    if HEIGHT in names:
        return
    for name in found:
        if name.strip().lower() in _UNIT_UNKNOWN:
            msg = (
                f"{file}: the unit of {name!r} is unknown: expected altitude or alt_baro (ft), "
                "baroaltitude or height_m (m)"
            )
            raise LayoutError(msg)
