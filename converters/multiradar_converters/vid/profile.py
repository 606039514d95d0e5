"""Dump profiles: what a recording calls things, in a TOML file of the user's own.

Every key is optional; the defaults read the layout of `docs/converter.md`::

    encoding = "auto"             # or utf-8, windows-1251, …
    form = "auto"                 # columns, pairs
    separator = "auto"            # tab, semicolon, comma, blank (runs of blanks)
    time = "auto"                 # seconds-of-day, iso8601, unix
    multiradar_source = 240       # the source whose rows are the recording system's own multiradar
    naming_tolerance_s = 60.0     # how far a plot may lie from the track row that names it

    [files]
    tracks = "tracks.txt"
    plots = "plots.txt"
    plots_ads = "plots_ads.txt"

    [units]
    range = "m"                   # m, km, NM, ft
    height = "m"                  # m, km, ft, FL
    azimuth = "degree"            # degree, radian, ACP (4096 a turn)

    [columns.plots]               # also [columns.tracks], [columns.plots_ads]
    range = "rho"                 # the dump's name; "" where the dump has no h or no code

    [headers]                     # for files without a header line: the names of their columns
    plots = ["time", "source", …]
"""

import codecs
import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from multiradar_converters.errors import ProfileError
from multiradar_converters.vid import fields
from multiradar_converters.vid.fields import NAMES, OPTIONAL_ROLES, TABLES, Table

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

# What is expected, by the type of pydantic's complaint.
_EXPECTED = {
    "literal_error": "{expected}",
    "string_type": "text",
    "int_type": "a whole number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le:g}",
    "dict_type": "a section",
    "model_type": "a section",
    "list_type": "a list",
}

_LENGTHS_M = {"m": 1.0, "km": 1000.0, "NM": 1852.0, "ft": 0.3048, "FL": 30.48}
_ANGLES_DEG = {"degree": 1.0, "radian": math.degrees(1.0), "ACP": 360.0 / 4096.0}


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Files(_Strict):
    """Names of the three files in the dump folder."""

    tracks: str = "tracks.txt"
    plots: str = "plots.txt"
    plots_ads: str = "plots_ads.txt"

    def of(self, table: Table) -> str:
        """Return the name of the file of a table."""
        return {"tracks": self.tracks, "plots": self.plots, "plots_ads": self.plots_ads}[table.name]


class Units(_Strict):
    """Units of the dump."""

    range: Literal["m", "km", "NM", "ft"] = "m"
    height: Literal["m", "km", "ft", "FL"] = "m"
    azimuth: Literal["degree", "radian", "ACP"] = "degree"

    def scale(self) -> tuple[float, ...]:
        """Return the factor to SI (degrees for angles) of each number, by role."""
        factors = [1.0] * fields.NUMBERS
        factors[fields.RANGE] = _LENGTHS_M[self.range]
        factors[fields.HEIGHT] = _LENGTHS_M[self.height]
        factors[fields.AZIMUTH] = _ANGLES_DEG[self.azimuth]
        return tuple(factors)


class Profile(_Strict):
    """What a recording calls things; see the module for each key."""

    encoding: str = "auto"
    form: Literal["auto", "columns", "pairs"] = "auto"
    separator: Literal["auto", "tab", "semicolon", "comma", "blank"] = "auto"
    time: Literal["auto", "seconds-of-day", "iso8601", "unix"] = "auto"
    multiradar_source: int = Field(default=240, ge=0)
    naming_tolerance_s: float = Field(default=60.0, gt=0.0, le=3600.0)
    files: Files = Files()
    units: Units = Units()
    columns: dict[str, dict[str, str]] = Field(default_factory=dict)
    headers: dict[str, list[str]] = Field(default_factory=dict)

    def column_names(self, table: Table) -> tuple[str, ...]:
        """Return what the dump calls each role of a table; empty where the dump lacks it."""
        own = self.columns.get(table.name, {})
        return tuple(own.get(NAMES[role], NAMES[role]) for role in table.roles)


def load_profile(path: Path | None) -> Profile:
    """Read a profile.

    Parameters
    ----------
    path : Path or None
        The TOML file; None is the default profile.

    Returns
    -------
    Profile
        The profile.

    Raises
    ------
    ProfileError
        The file cannot be read, or a key or value in it has no meaning.
    """
    if path is None:
        return Profile()
    try:
        profile = Profile.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        msg = f"{path}: cannot read the profile: {error.strerror}"
        raise ProfileError(msg) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        msg = f"{path}: expected TOML: {error}"
        raise ProfileError(msg) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        msg = f"{path}: {place}: {_said(first)}"
        raise ProfileError(msg) from error
    _check_names(path, profile)
    return profile


def _said(error: "ErrorDetails") -> str:
    """Return what was expected of a key, and what it was."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return f"expected one of the keys {', '.join(_keys(error['loc'][:-1]))}, was another"
    expected = _EXPECTED.get(kind, "").format(**context)
    if not expected:
        message = error["msg"]
        expected = message[:1].lower() + message[1:]
    return f"expected {expected}, was {str(error['input'])[:80]!r}"


def _keys(place: tuple[int | str, ...]) -> list[str]:
    """Return the keys of a section of a profile."""
    sections: dict[str, type[_Strict]] = {"files": Files, "units": Units}
    section = sections[str(place[0])] if place else Profile
    return list(section.model_fields)


def _check_names(path: Path, profile: Profile) -> None:
    """Refuse names of tables, fields and encodings that do not exist."""
    tables = {table.name: table for table in TABLES}
    for section, names in (("columns", profile.columns), ("headers", profile.headers)):
        for name in set(names) - set(tables):
            msg = f"{path}: {section}.{name}: expected one of {', '.join(tables)}"
            raise ProfileError(msg)
    for name, columns in profile.columns.items():
        _check_columns(path, tables[name], columns)
    if profile.encoding != "auto":
        try:
            codecs.lookup(profile.encoding)
        except LookupError as error:
            msg = f"{path}: encoding: {profile.encoding!r} is not known"
            raise ProfileError(msg) from error


def _check_columns(path: Path, table: Table, columns: dict[str, str]) -> None:
    known = {NAMES[role]: role for role in table.roles}
    for field, column in columns.items():
        place = f"{path}: columns.{table.name}.{field}"
        if field not in known:
            msg = f"{place}: expected one of {', '.join(known)}"
            raise ProfileError(msg)
        if not column and known[field] not in OPTIONAL_ROLES:
            msg = f"{place}: only h and code may be missing in a dump"
            raise ProfileError(msg)
