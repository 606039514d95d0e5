"""The fields of the three dump files: their roles, units and bounds.

A *role* is the index of a field in kernels. Roles below `FIRST_INTEGER` are decimal numbers and
index the rows of the array of numbers; the others index the array of integers.
"""

import math
from dataclasses import dataclass

TIME, LATITUDE, LONGITUDE, HEIGHT, RANGE, AZIMUTH = range(6)
SOURCE, SENSOR, GLOBAL, PLOT, CODE, ADDRESS = range(6, 12)
FIRST_INTEGER = SOURCE
NUMBERS = 6
INTEGERS = 6
IGNORED = -1

#: Absent integer; an absent number is NaN.
ABSENT = -1

#: Fields that may be empty.
OPTIONAL_ROLES = frozenset({HEIGHT, CODE})

#: Default names, by role.
NAMES = (
    "time",
    "lat",
    "lon",
    "h",
    "range",
    "azimuth",
    "source",
    "sensor",
    "global",
    "plot",
    "code",
    "address",
)

#: Units of the bounds, by role of a number.
UNITS = ("s", "°", "°", "m", "m", "°")

#: Maximum integer in a field: 31 bits.
INTEGER_MAX = 2**31 - 1

#: Times of day may continue past midnight, for up to a month.
TIME_OF_DAY_MAX_S = 31 * 86_400.0

#: From this value on, times are seconds since the Unix epoch (1973).
UNIX_TIME_MIN_S = 1e8

#: Bounds of the numbers, inclusive (azimuth 360 and range 0 are excluded).
LOW = (0.0, -90.0, -180.0, -1000.0, math.nextafter(0.0, 1.0), 0.0)
HIGH = (1e11, 90.0, 180.0, 40_000.0, 1e6, math.nextafter(360.0, 0.0))


@dataclass(frozen=True)
class Table:
    """One of the three files: its name in profiles and its required roles."""

    name: str
    roles: tuple[int, ...]


TRACKS = Table("tracks", (TIME, SOURCE, SENSOR, GLOBAL, PLOT, LATITUDE, LONGITUDE, HEIGHT, CODE))
PLOTS = Table(
    "plots", (TIME, SOURCE, SENSOR, PLOT, RANGE, AZIMUTH, LATITUDE, LONGITUDE, HEIGHT, CODE)
)
REPORTS = Table("plots_ads", (TIME, GLOBAL, ADDRESS, LATITUDE, LONGITUDE, HEIGHT))
TABLES = (PLOTS, REPORTS, TRACKS)
