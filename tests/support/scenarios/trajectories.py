"""Small files of trajectories, made by hand."""

import csv
import gzip
import io
import json
from collections.abc import Sequence
from typing import Any

#: 2018-08-01 08:00:00 UTC, Unix time, s.
BEGIN_S = 1_533_110_400

Row = dict[str, Any]


def report(second: float = 0.0, **changes: Any) -> Row:
    """Return one report of an aircraft that flies north at 231.5 m/s (450 kt), 35 000 ft high."""
    row = {
        "timestamp": round((BEGIN_S + second) * 1000),
        "icao24": "3c6444",
        "latitude": round(47.0 + second * 231.5 / 111_195.0, 6),
        "longitude": 8.5,
        "altitude": 35_000.0,
        "groundspeed": 450.0,
        "callsign": "DLH8JW",
    }
    return {name: value for name, value in (row | changes).items() if value is not ...}


def json_list(rows: Sequence[Row]) -> bytes:
    """Return a JSON list."""
    return json.dumps(rows).encode()


def json_lines(rows: Sequence[Row]) -> bytes:
    """Return a JSON object a line."""
    return b"".join(json.dumps(row).encode() + b"\n" for row in rows)


def json_columns(rows: Sequence[Row]) -> bytes:
    """Return JSON columns, as pandas writes them."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {
        name: {str(place): row.get(name) for place, row in enumerate(rows)} for name in names
    }
    return json.dumps(columns).encode()


def csv_table(rows: Sequence[Row], delimiter: str = ",") -> bytes:
    """Return CSV; what is None is empty."""
    text = io.StringIO()
    names = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(text, names, delimiter=delimiter, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def trace(points: Sequence[Any], **changes: Any) -> bytes:
    """Return a trace of readsb."""
    head = {"icao": "3c6444", "r": "D-AIBD", "timestamp": BEGIN_S + 0.5} | changes
    return json.dumps(head | {"trace": points}).encode()


def packed(text: bytes) -> bytes:
    """Return text packed by gzip; the same for the same text."""
    return gzip.compress(text, mtime=0)
