"""The user's own GeoJSON (sectors, airways, procedures) from a folder, read once, checked, bounded.

A file that cannot be used stays in the list with its problem; the others are shown.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar.errors import ConfigurationError

#: Files of a folder, and octets of a file.
FILES_MAX = 32
OCTETS_MAX = 8 * 1024 * 1024
#: Endings of the files that are read.
ENDINGS = (".geojson", ".json")

_LONGITUDE_MAX_DEG = 180.0
_LATITUDE_MAX_DEG = 90.0
# Levels of lists above a position, by type of geometry (RFC 7946, section 3.1), and the least
# number of positions in the lowest of these lists.
_DEPTHS = {
    "Point": (0, 1), "MultiPoint": (1, 0), "LineString": (1, 2), "MultiLineString": (2, 2),
    "Polygon": (2, 4), "MultiPolygon": (3, 4),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Overlay:
    """One file.

    Attributes
    ----------
    name : str
        Its name without the ending.
    content : bytes
        A FeatureCollection; empty where it cannot be used.
    features : int
        Their number.
    problem : str
        Why it cannot be used; empty where it can.
    """

    name: str
    content: bytes
    features: int
    problem: str


Overlays = tuple[Overlay, ...]


def read_overlays(folder: Path) -> Overlays:
    """Read the GeoJSON files of a folder, by name.

    Parameters
    ----------
    folder : Path
        The folder; folders in it are not read.

    Returns
    -------
    tuple of Overlay
        One for each file, also for one that cannot be used; at most `FILES_MAX`.

    Raises
    ------
    ConfigurationError
        The folder cannot be read, or has too many files.
    """
    try:
        paths = sorted(
            path for path in folder.iterdir() if path.suffix.lower() in ENDINGS and path.is_file()
        )
    except OSError as error:
        msg = f"{folder}: cannot read the overlay folder: {error.strerror or error}"
        raise ConfigurationError(msg) from error
    if len(paths) > FILES_MAX:
        msg = f"{folder}: expected at most {FILES_MAX} overlay files, found {len(paths)}"
        raise ConfigurationError(msg)
    return tuple(_read(path) for path in paths)


def _read(path: Path) -> Overlay:
    try:
        features = _features(path)
        collection = {"type": "FeatureCollection", "features": features}
        content = json.dumps(collection, ensure_ascii=False, allow_nan=False).encode()
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, RecursionError):
            reason = "the lists are nested too deeply"
        return Overlay(path.stem, b"", 0, reason)
    return Overlay(path.stem, content, len(features), "")


def _features(path: Path) -> list[dict[str, Any]]:
    octets = path.stat().st_size
    if octets > OCTETS_MAX:
        msg = f"expected at most {OCTETS_MAX} octets, found {octets}"
        raise ValueError(msg)
    try:
        text = path.read_bytes().decode("utf-8-sig")
        if not text.strip():
            msg = "the file is empty"
            raise ValueError(msg)
        document = json.loads(text, parse_constant=_no_number)
    except UnicodeDecodeError as error:
        msg = "not UTF-8 text"
        raise ValueError(msg) from error
    except json.JSONDecodeError as error:
        msg = f"not valid JSON: {error}"
        raise ValueError(msg) from error
    if not isinstance(document, dict):
        msg = f"expected a GeoJSON object, was {_kind(document)}"
        raise ValueError(msg)
    if document.get("type") != "FeatureCollection":
        return [_feature(document, "the document")]
    features = document.get("features")
    if not isinstance(features, list):
        msg = f"features: expected a list, was {_kind(features)}"
        raise ValueError(msg)
    return [_feature(one, f"feature {number}") for number, one in enumerate(features, 1)]


# A feature with its geometry checked and its properties that are plain values.
def _feature(given: Any, where: str) -> dict[str, Any]:
    if isinstance(given, dict) and given.get("type") in (*_DEPTHS, "GeometryCollection"):
        given = {"type": "Feature", "properties": None, "geometry": given}
    if not isinstance(given, dict) or given.get("type") != "Feature":
        msg = f"{where}: expected a Feature or a geometry, was {_kind(given)}"
        raise ValueError(msg)
    properties = given.get("properties")
    plain = {
        str(name): value
        for name, value in (properties if isinstance(properties, dict) else {}).items()
        if value is None or isinstance(value, str | int | float | bool)
    }
    geometry = given.get("geometry")
    if geometry is not None:
        _check(geometry, where)
    return {"type": "Feature", "properties": plain, "geometry": geometry}


def _check(geometry: Any, where: str) -> None:
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if kind == "GeometryCollection":
        members = geometry.get("geometries")
        if not isinstance(members, list):
            msg = f"{where}: geometries: expected a list, was {_kind(members)}"
            raise ValueError(msg)
        for one in members:
            _check(one, where)
        return
    if not isinstance(kind, str) or kind not in _DEPTHS:
        msg = f"{where}: expected a geometry, was {_kind(geometry)}"
        raise ValueError(msg)
    depth, least = _DEPTHS[kind]
    _check_lists(geometry.get("coordinates"), depth, least, f"{where}, {kind}")


def _check_lists(value: Any, depth: int, least: int, where: str) -> None:
    if depth == 0:
        _check_position(value, where)
        return
    if not isinstance(value, list):
        msg = f"{where}: expected a list of coordinates, was {_kind(value)}"
        raise ValueError(msg)
    if depth == 1 and len(value) < least:
        msg = f"{where}: expected at least {least} positions, found {len(value)}"
        raise ValueError(msg)
    for one in value:
        _check_lists(one, depth - 1, least, where)


def _check_position(value: Any, where: str) -> None:
    if not (
        isinstance(value, list)
        and len(value) >= 2  # longitude and latitude
        and all(isinstance(one, int | float) and not isinstance(one, bool) for one in value)
        and all(math.isfinite(one) for one in value)
    ):
        msg = f"{where}: expected [longitude, latitude] in degrees, was {_kind(value)}"
        raise ValueError(msg)
    longitude, latitude = value[:2]
    if abs(longitude) > _LONGITUDE_MAX_DEG or abs(latitude) > _LATITUDE_MAX_DEG:
        msg = (
            f"{where}: expected longitude and latitude in degrees (WGS 84), was "
            f"{longitude:g}, {latitude:g}"
        )
        raise ValueError(msg)


def _no_number(text: str) -> None:
    msg = f"expected finite numbers, was {text}"
    raise ValueError(msg)


def _kind(value: Any) -> str:
    if isinstance(value, dict):
        kind = value.get("type")
        return f"an object of type {kind!a:.40}" if kind is not None else "an object without type"
    names: dict[type, Callable[[Any], str]] = {
        list: lambda one: f"a list of {len(one)}",
        str: lambda one: f"the text {one!a:.40}",
        type(None): lambda _: "nothing",
    }
    return names.get(type(value), lambda one: f"{one!a:.40}")(value)
