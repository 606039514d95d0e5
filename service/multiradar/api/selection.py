"""Filters of the list of tracks: selection of rows and columns."""

import re
from dataclasses import dataclass

import polars as pl
from pydantic.config import JsonDict

from multiradar.access.parameters import number, parameter_error
from multiradar.runtime.stream.region_marks import FIELDS
from multiradar_schemas.documents.names import did_you_mean
from multiradar_schemas.measurements.measurement import LATITUDE_MAX_DEG, LONGITUDE_MAX_DEG
from multiradar_schemas.products.track import TRACK_SCHEMA

#: Columns of a live track: those of `tracks.parquet`, the age of the track, and those of regions.
TRACK_COLUMNS = (*TRACK_SCHEMA.names(), "age_s", *FIELDS)

_MODE_S = re.compile(r"[0-9a-fA-F]{6}")
_MODE_3A = re.compile(r"[0-7]{4}")
_CALLSIGN = re.compile(r"[0-9A-Za-z]([0-9A-Za-z ]{0,6}[0-9A-Za-z])?")
_NUMBER = re.compile(r"[0-9]{1,18}")

# What `bounding_box` and `identity` read, for OpenAPI.
BOX_FORM: JsonDict = {"format": "bounding-box"}
IDENTITY_FORM: JsonDict = {
    "pattern": f"^((mode_s:)?{_MODE_S.pattern}|(mode_3a:)?{_MODE_3A.pattern}|"
    f"(number:)?{_NUMBER.pattern}|callsign:{_CALLSIGN.pattern})$"
}


@dataclass(frozen=True, slots=True)
class BoundingBox:
    """A box of longitudes and latitudes, degrees; it crosses the antimeridian where west > east."""

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float


def bounding_box(text: str) -> BoundingBox:
    """Return the box of the form ``min_lon,min_lat,max_lon,max_lat``.

    Raises
    ------
    RequestError
        422 when it is not four numbers in this order and in range.
    """
    try:
        west, south, east, north = (number(part) for part in text.split(",", 5))
    except ValueError:
        raise _wrong("bbox", "expected four numbers, min_lon,min_lat,max_lon,max_lat") from None
    if not (abs(west) <= LONGITUDE_MAX_DEG and abs(east) <= LONGITUDE_MAX_DEG):
        raise _wrong("bbox", "expected longitudes from -180 to 180 degrees")
    if not -LATITUDE_MAX_DEG <= south <= north <= LATITUDE_MAX_DEG:
        raise _wrong("bbox", "expected latitudes from -90 to 90 degrees, min_lat first")
    return BoundingBox(west, south, east, north)


def columns(text: str) -> list[str]:
    """Return the columns in a comma-separated list, always including `track_id`.

    Raises
    ------
    RequestError
        422 with the unknown names.
    """
    wanted = set(text.split(","))
    unknown = sorted(wanted - set(TRACK_COLUMNS))
    if unknown:
        named = ", ".join(
            f"'{ascii(name)[1:-1][:40]}'{did_you_mean(name, TRACK_COLUMNS)}" for name in unknown[:8]
        )
        raise _wrong("fields", f"unknown {named}; known: {', '.join(TRACK_COLUMNS)}")
    return [name for name in TRACK_COLUMNS if name in wanted or name == "track_id"]


def identity(text: str) -> pl.Expr:
    """Return the condition that a track has an identity.

    Parameters
    ----------
    text : str
        Six hexadecimal digits (Mode S address), four octal digits (Mode 3/A code) or a decimal
        track number; an ambiguous text matches any of them. The prefix ``mode_s:``, ``mode_3a:`` or
        ``number:`` selects one; a callsign needs ``callsign:``.

    Raises
    ------
    RequestError
        422 when it is none of them.
    """
    prefix, separator, value = text.rpartition(":")
    if separator and prefix not in {"mode_s", "mode_3a", "number", "callsign"}:
        raise _wrong("identity", "expected the prefix mode_s:, mode_3a:, number: or callsign:")
    conditions = []
    if prefix in {"", "mode_s"} and _MODE_S.fullmatch(value):
        conditions.append(pl.col("mode_s_address") == value.lower())
    if prefix in {"", "mode_3a"} and _MODE_3A.fullmatch(value):
        conditions.append(pl.col("mode_3a") == value)
    if prefix in {"", "number"} and _NUMBER.fullmatch(value):
        conditions.append(pl.col("track_number") == int(value))
    if prefix == "callsign" and _CALLSIGN.fullmatch(value):
        conditions.append(pl.col("callsign") == value.upper())
    if not conditions:
        raise _wrong(
            "identity",
            "expected a Mode S address (6 hexadecimal digits), a Mode 3/A code (4 octal digits) "
            "or a track number, or callsign: followed by 1 to 8 letters, digits or embedded spaces",
        )
    return pl.any_horizontal(conditions)


def inside(box: BoundingBox) -> pl.Expr:
    """Return the condition that a track is inside a box, edges included."""
    longitude = pl.col("longitude_deg")
    latitude = pl.col("latitude_deg").is_between(box.south_deg, box.north_deg)
    if box.west_deg <= box.east_deg:
        return latitude & longitude.is_between(box.west_deg, box.east_deg)
    return latitude & ((longitude >= box.west_deg) | (longitude <= box.east_deg))


def _wrong(parameter: str, reason: str) -> Exception:
    return parameter_error({parameter: reason})
