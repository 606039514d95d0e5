"""Dump profiles: names, units and format of a dump, in a TOML file.

Every key is optional; the defaults read the layout of `docs/howto/converter.md`::

    encoding = "auto"             # or utf-8, windows-1251, …
    form = "auto"                 # columns, pairs
    separator = "auto"            # tab, semicolon, comma, blank (runs of blanks)
    time = "auto"                 # seconds-of-day, iso8601, unix
    multiradar_source = 240       # source of the multiradar tracks of the recording system
    naming_tolerance_s = 60.0     # maximum time between a plot and the track row that references it

    [files]
    tracks = "tracks.txt"
    plots = "plots.txt"
    plots_ads = "plots_ads.txt"

    [units]
    range = "m"                   # m, km, NM, ft
    height = "m"                  # m, km, ft, FL
    azimuth = "degree"            # degree, radian, ACP (4096 per revolution)

    [columns.plots]               # also [columns.tracks], [columns.plots_ads]
    range = "rho"                 # name in the dump; "" if the dump has no h or no code

    [headers]                     # names of the columns of files without a header line
    plots = ["time", "source", …]
"""

import codecs
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from multiradar_converters.errors import ProfileError
from multiradar_converters.vid import fields
from multiradar_converters.vid.fields import NAMES, OPTIONAL_ROLES, TABLES, Table
from multiradar_schemas.documents.contents import PROFILE
from multiradar_schemas.documents.files import read_toml, validated
from multiradar_schemas.documents.names import unknown
from multiradar_schemas.documents.toml_lines import Path as Location
from multiradar_schemas.documents.toml_lines import line_of
from multiradar_schemas.errors import DocumentError

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
    """Names, units and format of a dump; see the module for each key."""

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
        """Return the name of each role of a table in the dump; empty if the dump lacks it."""
        own = self.columns.get(table.name, {})
        return tuple(own.get(NAMES[role], NAMES[role]) for role in table.roles)


def load_profile(path: Path | None) -> Profile:
    """Read a profile.

    Parameters
    ----------
    path : Path or None
        The TOML file; None is the default profile.

    Raises
    ------
    ProfileError
        The file cannot be read, or has an invalid key or value.
    """
    if path is None:
        return Profile()
    try:
        document = read_toml(path)
        profile = validated(Profile, document, PROFILE)
        reasons = tuple(_wrong_names(profile, document.lines))
        if reasons:
            raise DocumentError(str(path), *reasons)
    except DocumentError as error:
        raise ProfileError(str(error), error.source, error.reasons) from error
    return profile


def _wrong_names(profile: Profile, lines: Mapping[Location, int]) -> Iterator[str]:
    """Yield errors in names of tables, fields and encodings."""
    tables = {table.name: table for table in TABLES}
    for section, names in (("columns", profile.columns), ("headers", profile.headers)):
        for name in names:
            if name not in tables:
                yield f"{_line((section, name), lines)}{section}: {unknown('table', name, tables)}"
    for name, columns in profile.columns.items():
        if name in tables:
            yield from _wrong_columns(tables[name], columns, lines)
    if profile.encoding != "auto":
        try:
            codecs.lookup(profile.encoding)
        except LookupError:
            where = _line(("encoding",), lines)
            yield f"{where}encoding: unknown encoding {profile.encoding!r}"


def _wrong_columns(
    table: Table, columns: dict[str, str], lines: Mapping[Location, int]
) -> Iterator[str]:
    known = {NAMES[role]: role for role in table.roles}
    for field, column in columns.items():
        where = f"{_line(('columns', table.name, field), lines)}columns.{table.name}"
        if field not in known:
            yield f"{where}: {unknown('field', field, known)}"
        elif not column and known[field] not in OPTIONAL_ROLES:
            yield f"{where}.{field}: only h and code may be missing in a dump"


def _line(location: Location, lines: Mapping[Location, int]) -> str:
    line = line_of(location, lines)
    return "" if line is None else f"line {line}: "
