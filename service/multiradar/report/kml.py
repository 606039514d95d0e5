"""Tracks as KML 2.2, for Google Earth and other viewers."""

import html
from collections.abc import Iterable, Iterator

from multiradar.report.times import is_dated
from multiradar.report.track_lines import TrackLine, iso_time

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">
<Document>
<name>{name}</name>
<Style id="track"><LineStyle><color>ffd0631c</color><width>2</width></LineStyle></Style>
"""


def kml(lines: Iterable[TrackLine], name: str) -> Iterator[str]:
    """Yield a KML document in parts, a placemark for each track.

    Yields
    ------
    str
        The concatenation is one document.

    Notes
    -----
    With a date a track is a `gx:Track`, with the time of each position; without one, a LineString.
    Heights are absolute, in metres; a track without heights is on the ground.
    """
    yield _HEAD.format(name=_text(name))
    for line in lines:
        yield _placemark(line)
    yield "</Document>\n</kml>\n"


def _placemark(line: TrackLine) -> str:
    data = "".join(
        f'<Data name="{_text(key)}"><value>{_text(str(value))}</value></Data>\n'
        for key, value in line.properties.items()
        if value is not None
    )
    geometry = _track(line) if is_dated(float(line.time_s[-1])) else _line(line)
    return (
        f"<Placemark>\n<name>{_text(line.name)}</name>\n<styleUrl>#track</styleUrl>\n"
        f"<ExtendedData>\n{data}</ExtendedData>\n{geometry}</Placemark>\n"
    )


def _track(line: TrackLine) -> str:
    times = "".join(f"<when>{iso_time(one)}</when>\n" for one in line.time_s.tolist())
    places = "".join(f"<gx:coord>{one}</gx:coord>\n" for one in _coordinates(line, " "))
    return f"<gx:Track>\n{_mode(line)}{times}{places}</gx:Track>\n"


def _line(line: TrackLine) -> str:
    places = _coordinates(line, ",")
    kind = "LineString" if len(places) > 1 else "Point"
    return f"<{kind}>\n{_mode(line)}<coordinates>{' '.join(places)}</coordinates>\n</{kind}>\n"


def _mode(line: TrackLine) -> str:
    mode = "clampToGround" if line.height_m is None else "absolute"
    return f"<altitudeMode>{mode}</altitudeMode>\n"


def _coordinates(line: TrackLine, separator: str) -> list[str]:
    heights = [0.0] * len(line.time_s) if line.height_m is None else line.height_m.tolist()
    return [
        f"{longitude:.6f}{separator}{latitude:.6f}{separator}{height:.1f}"
        for longitude, latitude, height in zip(
            line.longitude_deg.tolist(), line.latitude_deg.tolist(), heights, strict=True
        )
    ]


# XML 1.0 has no control characters.
def _text(text: str) -> str:
    return html.escape("".join(one if one >= " " else " " for one in text))
