"""Text dumps for tests: the sample, parts of it in other forms, and plain readers of the outputs.

The readers share no code with the converter: `csv` splits, `float` reads, loops join.
"""

import csv
import json
import math
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from multiradar_converters.vid.conversion import convert
from multiradar_converters.vid.options import Options
from support.paths import SAMPLE

FILES = ("tracks.txt", "plots.txt", "plots_ads.txt")
_COLUMNS = {
    "tracks.txt": "time source sensor global plot lat lon h code",
    "plots.txt": "time source sensor plot range azimuth lat lon h code",
    "plots_ads.txt": "time global address lat lon h",
}
HEADERS = {name: text.split() for name, text in _COLUMNS.items()}

Row = dict[str, str]
Encoder = Callable[[str, list[list[str]]], bytes]


def truth() -> dict[str, Any]:
    """The truth of the sample."""
    loaded: dict[str, Any] = json.loads((SAMPLE / "truth.json").read_text(encoding="utf-8"))
    return loaded


def good_rows(
    folder: Path, broken: dict[str, set[int]], size: int | None = None
) -> dict[str, list[Row]]:
    """Read the rows, or the first ones, of a dump like the sample, without the broken lines."""
    rows: dict[str, list[Row]] = {}
    for name in FILES:
        with (folder / name).open(encoding="cp1251", newline="") as file:
            lines = csv.reader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
            header = next(lines)
            good = (
                dict(zip(header, fields, strict=True))
                for number, fields in enumerate(lines, start=2)
                if number not in broken.get(name, set())
            )
            rows[name] = list(islice(good, size))
    return rows


def broken_lines(*, blank: bool) -> dict[str, set[int]]:
    """Numbers of the sample's broken lines, blank ones among them or not."""
    return {
        name: {defect["line"] for defect in defects if blank or defect["kind"] != "empty"}
        for name, defects in truth()["defects"].items()
    }


def named_plots(
    rows: dict[str, list[Row]], tolerance_s: float = 60.0
) -> dict[tuple[str, str], list[Row]]:
    """Join plots to aircraft: of the plots with the number, the nearest in time, each once."""
    by_number: dict[tuple[str, str], list[int]] = {}
    plots = rows["plots.txt"]
    for place, plot in enumerate(plots):
        by_number.setdefault((plot["source"], plot["plot"]), []).append(place)
    joined: dict[tuple[str, str], set[int]] = {}
    for row in rows["tracks.txt"]:
        places = by_number.get((row["source"], row["plot"]), [])
        if row["plot"] == "0" or not places:
            continue
        near = min(places, key=lambda k: abs(float(plots[k]["time"]) - float(row["time"])))
        if abs(float(plots[near]["time"]) - float(row["time"])) <= tolerance_s:
            joined.setdefault((row["global"], row["source"]), set()).add(near)
    return {key: [plots[k] for k in sorted(places)] for key, places in joined.items()}


def expected_tracks(rows: dict[str, list[Row]]) -> dict[str, list[tuple[float, ...]]]:
    """Return the points of every file of every aircraft ("29805/41_r"), by time."""
    tracks: dict[str, list[Row]] = {}
    for row in rows["plots_ads.txt"]:
        tracks.setdefault(f"{row['global']}/ads", []).append(row)
    for row in rows["tracks.txt"]:
        tracks.setdefault(f"{row['global']}/{row['source']}_mr", []).append(row)
    for (aircraft, source), plots in named_plots(rows).items():
        tracks[f"{aircraft}/{source}_r"] = plots
    return {name: sorted_points(points) for name, points in tracks.items()}


def sorted_points(rows: Iterable[Row]) -> list[tuple[float, ...]]:
    """Sort rows by time, ties in their order."""
    points = [
        tuple(float(row[name] or "nan") for name in ("time", "lat", "lon", "h")) for row in rows
    ]
    return sorted(points, key=lambda point: point[0])


def read_new4(path: Path) -> list[tuple[float, ...]]:
    """Read a .new4 file."""
    return [
        tuple(float(field or "nan") for field in line.split("\t"))
        for line in path.read_text(encoding="ascii").splitlines()
    ]


def read_plt(path: Path) -> tuple[list[str], list[list[str]]]:
    """Read a .plt file: six lines of header, then the fields of each point."""
    data = path.read_bytes().decode("latin-1")
    assert data.endswith("\r\n")
    assert data.count("\n") == data.count("\r\n")
    lines = data.split("\r\n")[:-1]
    return lines[:6], [[field.strip() for field in line.split(",")] for line in lines[6:]]


def same_points(found: Sequence[Sequence[float]], expected: Sequence[Sequence[float]]) -> bool:
    """Compare points, NaN equal to NaN."""
    return len(found) == len(expected) and all(
        all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(one, other, strict=True))
        for one, other in zip(found, expected, strict=True)
    )


def columns(separator: str = "\t", end: str = "\r\n", encoding: str = "ascii") -> Encoder:
    """Return a writer of the columns form."""

    def encode(name: str, rows: list[list[str]]) -> bytes:
        lines = [separator.join(fields) for fields in [HEADERS[name], *rows]]
        return "".join(line + end for line in lines).encode(encoding)

    return encode


def pairs(separator: str = " ", end: str = "\n") -> Encoder:
    """Return a writer of the pairs form; the order of the pairs changes from line to line."""

    def encode(name: str, rows: list[list[str]]) -> bytes:
        lines = []
        for number, fields in enumerate(rows):
            tokens = [f"{key}={field}" for key, field in zip(HEADERS[name], fields, strict=True)]
            turn = number % 3
            lines.append(separator.join(tokens[turn:] + tokens[:turn]) + end)
        return "".join(lines).encode("ascii")

    return encode


def part_of_sample(size: int) -> dict[str, list[list[str]]]:
    """Return the fields of the first good rows of each file."""
    rows = good_rows(SAMPLE, broken_lines(blank=True), size)
    return {name: [list(row.values()) for row in rows[name]] for name in FILES}


def write_dump(folder: Path, rows: dict[str, list[list[str]]], encode: Encoder) -> Path:
    """Write the three files of a dump."""
    folder.mkdir(parents=True)
    for name in FILES:
        (folder / name).write_bytes(encode(name, rows.get(name, [])))
    return folder


def run(dump: Path, out: Path, **choices: Any) -> dict[str, Any]:
    """Convert a dump."""
    report: dict[str, Any] = convert(dump, out, Options(**choices))
    return report


def contents(out: Path) -> dict[str, bytes]:
    """Return every file of an output folder but the report, which names sizes of the input."""
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in sorted(out.rglob("*"))
        if path.is_file() and path.name != "report.json"
    }


def rejects(out: Path) -> list[dict[str, Any]]:
    """Return the rejects of an output folder."""
    text = (out / "rejects.ndjson").read_text(encoding="utf-8")
    return [json.loads(line) for line in text.splitlines()]
