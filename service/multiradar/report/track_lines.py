"""Tracks as lines in time, and as GeoJSON (RFC 7946)."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from multiradar.report.times import is_dated

Floats = NDArray[np.float64]

_HALF_TURN, _TURN = 180.0, 360.0
#: Decimals: 0.1 m of position and of height, 1 ms of time.
_PLACE, _HEIGHT, _TIME = 6, 1, 3
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True, eq=False)
class TrackLine:
    """A track.

    Attributes
    ----------
    name : str
        Name for readers.
    properties : dict
        Identity; values of JSON.
    time_s : (n,) float64
        Data times, n at least 1.
    longitude_deg, latitude_deg : (n,) float64
        WGS 84.
    height_m : (n,) float64, optional
        Heights; None where none is known.
    """

    name: str
    properties: dict[str, object]
    time_s: Floats
    longitude_deg: Floats
    latitude_deg: Floats
    height_m: Floats | None


def filled(height_m: Floats) -> Floats | None:
    """Return heights (n,) with missing ones from the nearest update in order; None without any."""
    known = np.flatnonzero(np.isfinite(height_m))
    if not len(known):
        return None
    return np.asarray(np.interp(np.arange(len(height_m)), known, height_m[known]))


def iso_time(time_s: float) -> str:
    """Return a data time with a date as RFC 3339, in milliseconds."""
    moment = _EPOCH + timedelta(milliseconds=round(time_s * 1000.0))
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"


def geojson(lines: Iterable[TrackLine]) -> Iterator[str]:
    """Yield a GeoJSON feature collection in parts, a line for each track.

    Yields
    ------
    str
        The concatenation is one document.

    Notes
    -----
    A track is a LineString, a Point if it has one update, a MultiLineString if it crosses the
    antimeridian (RFC 7946, 3.1.9). The property `times` has the time of each position, in the
    structure of the coordinates (of a Point, its time): RFC 3339, or seconds where the date is
    unknown.
    """
    yield '{"type": "FeatureCollection", "features": ['
    separator = "\n"
    for line in lines:
        yield separator + json.dumps(_feature(line), ensure_ascii=False, allow_nan=False)
        separator = ",\n"
    yield "\n]}\n"


def _feature(line: TrackLine) -> dict[str, object]:
    parts = [_positions(part) for part in _cut(line)]
    times = [_times(part.time_s) for part in _cut(line)]
    kind: str = "MultiLineString"
    coordinates: object = parts
    when: object = times
    if len(parts) == 1:
        kind, coordinates, when = "LineString", parts[0], times[0]
    if len(line.time_s) == 1:
        kind, coordinates, when = "Point", parts[0][0], times[0][0]
    return {
        "type": "Feature",
        "id": line.properties.get("track_id"),
        "geometry": {"type": kind, "coordinates": coordinates},
        "properties": {"name": line.name, **line.properties, "times": when},
    }


def _positions(line: TrackLine) -> list[list[float]]:
    columns = [np.round(line.longitude_deg, _PLACE), np.round(line.latitude_deg, _PLACE)]
    if line.height_m is not None:
        columns.append(np.round(line.height_m, _HEIGHT))
    return [list(row) for row in zip(*(one.tolist() for one in columns), strict=True)]


def _times(time_s: Floats) -> list[str] | list[float]:
    if is_dated(float(time_s[-1])):
        return [iso_time(one) for one in time_s.tolist()]
    return [round(one, _TIME) for one in time_s.tolist()]


def _cut(line: TrackLine) -> list[TrackLine]:
    """Return the parts of a track between crossings of the antimeridian."""
    step = np.diff(line.longitude_deg)
    crossings = np.flatnonzero(np.abs(step) > _HALF_TURN)
    if not len(crossings):
        return [line]
    columns = {
        name: value
        for name in ("time_s", "longitude_deg", "latitude_deg", "height_m")
        if (value := getattr(line, name)) is not None
    }
    parts: list[dict[str, list[float]]] = [{name: [] for name in columns}]
    for row in range(len(line.time_s)):
        for name, value in columns.items():
            parts[-1][name].append(float(value[row]))
        if row in crossings:
            edge = float(np.copysign(_HALF_TURN, line.longitude_deg[row]))
            onward = float(line.longitude_deg[row + 1]) + np.copysign(_TURN, edge)
            length = onward - float(line.longitude_deg[row])
            part = 0.0 if length == 0.0 else (edge - float(line.longitude_deg[row])) / length
            parts.append({name: [] for name in columns})
            for name, value in columns.items():
                at = float(value[row] + part * (value[row + 1] - value[row]))
                for side, own in ((edge, parts[-2]), (-edge, parts[-1])):
                    own[name].append(side if name == "longitude_deg" else at)
    return [
        TrackLine(line.name, line.properties, **{n: np.array(v) for n, v in one.items()},
                  **({} if "height_m" in one else {"height_m": None}))  # type: ignore[arg-type]
        for one in parts
    ]  # fmt: skip
