"""Draws the figure of the README from the output of `multiradar track` on the sample.

::

    multiradar convert vid examples/vid-sample converted --date 2018-08-01
    multiradar track converted --sensors examples/sensors-vid-sample.toml --kinds radar --out tracks
    python -m validation.documents.make_figures tracks \
        examples/vid-sample/truth.json docs/images/sample.svg
"""

import argparse
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import polars as pl

from multiradar.report.times import clock_text

#: Left, top, width and height.
Box = tuple[int, int, int, int]
WIDTH, HEIGHT = 1000, 470
INK, FAINT, GRID = "#1f2933", "#7b8794", "#e4e7eb"
#: Interval of the axis ticks.
TICK_S = 600
COLOURS = ("#2a6fdb", "#d9480f", "#2b8a3e", "#862e9c")
# Kind of sensor in the recording; the primary radar is co-located with a secondary one.
SECONDARY = 10
FONT = "font-family='system-ui, sans-serif'"


def main() -> None:
    """Read the tables and write the picture."""
    options = arguments()
    folder, out = options.tracks, options.out
    truth = json.loads(options.truth.read_text())
    tracks = pl.read_parquet(folder / "tracks.parquet")
    biases = pl.read_parquet(folder / "biases.parquet")
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {WIDTH} {HEIGHT}' {FONT}>",
        f"<rect width='{WIDTH}' height='{HEIGHT}' fill='white'/>",
        *draw_map(tracks, truth["radars"], (20, 40, 440, 410)),
        *draw_settling(biases, truth["radars"], "range_offset_m", (540, 40, 440, 165)),
        *draw_settling(biases, truth["radars"], "azimuth_offset_deg", (540, 275, 440, 165)),
        "</svg>",
    ]
    out.write_text("\n".join(parts) + "\n")


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("tracks", type=Path, help="folder that `multiradar track` made")
    parser.add_argument("truth", type=Path, help="truth.json with radars and their true biases")
    parser.add_argument("out", type=Path, help="picture to write, SVG")
    return parser.parse_args()


def draw_map(tracks: pl.DataFrame, radars: list[dict[str, Any]], box: Box) -> Iterable[str]:
    """Draw every track as a line and every radar as a triangle, north up."""
    x, y, width, height = box
    latitude = [float(value) for value in tracks["latitude_deg"]]
    longitude = [float(value) for value in tracks["longitude_deg"]]
    sites = [(radar["lat"], radar["lon"]) for radar in radars]
    longitude += [site[1] for site in sites]
    latitude += [site[0] for site in sites]
    west, east, south, north = min(longitude), max(longitude), min(latitude), max(latitude)
    stretch = math.cos(math.radians((south + north) / 2.0))
    scale = min(width / ((east - west) * stretch), height / (north - south))

    def place(lat: float, lon: float) -> str:
        return f"{x + (lon - west) * stretch * scale:.1f},{y + (north - lat) * scale:.1f}"

    confirmed = tracks.filter(pl.col("state") != "tentative")["track_id"].n_unique()
    yield text(x, y - 16, f"{confirmed} confirmed tracks from radar plots alone", weight="bold")
    for (_,), track in tracks.group_by("track_id", maintain_order=True):
        # Every third update suffices for a line of this size.
        thin = track.gather_every(3)
        rows = zip(thin["latitude_deg"], thin["longitude_deg"], strict=True)
        points = " ".join(place(lat, lon) for lat, lon in rows)
        yield (
            f"<polyline points='{points}' fill='none' stroke='#52606d' stroke-width='0.9' "
            "stroke-opacity='0.75'/>"
        )
    for colour, radar in zip(COLOURS, radars, strict=True):
        if radar["sensor"] == SECONDARY:
            px, py = (float(v) for v in place(radar["lat"], radar["lon"]).split(","))
            triangle = f"M{px - 7},{py + 6} L{px + 7},{py + 6} L{px},{py - 8} Z"
            yield f"<path d='{triangle}' fill='{colour}'/>"
            yield text(px + 10, py + 5, str(radar["source"]), colour, weight="bold")


def draw_settling(
    biases: pl.DataFrame, radars: list[dict[str, Any]], parameter: str, box: Box
) -> Iterable[str]:
    """Draw the error of each radar's bias over time, with a band of two sigma."""
    x, y, width, height = box
    metres = parameter == "range_offset_m"
    limit, unit = (20.0, "m") if metres else (0.02, "°")
    start, end = (float(one) for one in biases["time_s"].to_numpy()[[0, -1]])
    start = math.floor(start / TICK_S) * TICK_S

    def place(time_s: float, value: float) -> str:
        clipped = max(-limit, min(limit, value))
        px = x + (time_s - start) / (end - start) * width
        return f"{px:.1f},{y + height / 2 - clipped / limit * height / 2:.1f}"

    name = "Range" if metres else "Azimuth"
    yield text(x, y - 16, f"{name} bias: estimate minus truth, band = 2 sigma (SSR)", weight="bold")
    for step in (-1.0, -0.5, 0.0, 0.5, 1.0):
        py = y + height / 2 - step * height / 2
        yield f"<line x1='{x}' x2='{x + width}' y1='{py}' y2='{py}' stroke='{GRID}'/>"
        yield text(x - 6, py + 4, f"{step * limit:+g} {unit}", FAINT, anchor="end", size=11)
    beyond = 0
    for colour, radar in zip(COLOURS, radars, strict=True):
        sensor = f"{radar['source']}-{radar['sensor']}"
        true = radar["bias_range"] if metres else radar["bias_azimuth_deg"]
        rows = biases.filter(sensor_id=sensor, parameter=parameter).sort("time_s")
        series = list(
            zip(rows["time_s"], rows["estimate"] - true, rows["sigma"] * 2.0, strict=True)
        )
        if radar["sensor"] == SECONDARY:
            above = [place(t, e + s) for t, e, s in series]
            below = [place(t, e - s) for t, e, s in reversed(series)]
            yield f"<polygon points='{' '.join(above + below)}' fill='{colour}' opacity='0.13'/>"
        line = " ".join(place(t, e) for t, e, _ in series)
        yield f"<polyline points='{line}' fill='none' stroke='{colour}' stroke-width='1.6'/>"
        off = [(t, e) for t, e, _ in series if abs(e) > limit]
        beyond += len(off)
        yield from (beyond_mark(place(t, e), colour, up=e > 0.0) for t, e in off)
    if beyond:
        note = f"{beyond} beyond the axis"
        yield text(x + width, y + height - 6, note, FAINT, anchor="end", size=11)
    yield from draw_times(start, end, box)
    if metres:
        for index, (colour, radar) in enumerate(zip(COLOURS, radars, strict=True)):
            label = f"{radar['source']}-{radar['sensor']}"
            yield text(x + width - 220 + 58 * index, y + 14, label, colour, weight="bold", size=12)


def draw_times(start: float, end: float, box: Box) -> Iterable[str]:
    """Draw the ticks of a time axis."""
    x, y, width, height = box
    for time_s in range(int(start), int(end) + 1, TICK_S):
        px = x + (time_s - start) / (end - start) * width
        yield text(px, y + height + 16, clock_text(time_s)[:5], FAINT, anchor="middle", size=11)
    yield text(x - 20, y + height + 16, "UTC", FAINT, anchor="end", size=11)


def beyond_mark(place: str, colour: str, *, up: bool) -> str:
    """Return a small triangle at the edge, for a point beyond it."""
    x, y = (float(one) for one in place.split(","))
    side = -4.0 if up else 4.0
    return f"<path d='M{x - 3:.1f},{y} h6 l-3,{side} Z' fill='{colour}'/>"


def text(
    x: float,
    y: float,
    content: str,
    colour: str = INK,
    *,
    anchor: str = "start",
    weight: str = "normal",
    size: int = 14,
) -> str:
    """Return one line of text."""
    return (
        f"<text x='{x:.1f}' y='{y:.1f}' fill='{colour}' font-size='{size}' "
        f"text-anchor='{anchor}' font-weight='{weight}'>{content}</text>"
    )


if __name__ == "__main__":
    main()
