"""Reading tracks over HTTP: one track, and all of 5 000, as JSON, GeoJSON and Arrow."""

import io
import json
from collections.abc import Sequence
from itertools import cycle, islice
from time import perf_counter

import numpy as np
import polars as pl

from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.sky import RADARS, make_recording
from benchmark.service.server import Server, UnexpectedAnswerError
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode

TEXT = (
    "One client sends a request, reads the whole answer and repeats; the service is otherwise "
    "idle. Peer of one track: `GET /healthz`, the cost of any request. Peers of JSON and "
    "Arrow: polars, writing the same table into memory. Peer of GeoJSON: JSON."
)
TRACKS = 5_000
TURNS = 3
ONE = 1_000
MANY = 100
BATCH = 10_000
FORMATS = ("json", "arrow", "geojson")


def run(plan: Plan) -> list[Row]:
    """Fill a service with tracks and read them."""
    tracks = plan.size(TRACKS)
    with Server(plan.folder / "server") as server:
        recording = make_recording(tracks * (RADARS + 1) * TURNS, tracks)
        bodies = [encode(part, Encoding.ARROW) for part in recording.iter_slices(BATCH)]
        server.post(bodies, MEDIA_TYPES[Encoding.ARROW], in_flight=1)
        server.flush()
        server.wait_processed()
        return _one(plan, server) + _all(plan, server, tracks)


def _one(plan: Plan, server: Server) -> list[Row]:
    page = json.loads(server.get("/v1/tracks?fields=track_id&limit=1000"))
    paths = [f"/v1/tracks/{track['track_id']}" for track in page["tracks"]]
    count = plan.size(ONE)
    times = _times(server, list(islice(cycle(paths), count)))
    healthy = _times(server, ["/healthz"] * count)
    return _rows("one track", times, "GET /healthz", healthy)


def _all(plan: Plan, server: Server, tracks: int) -> list[Row]:
    paths = {form: f"/v1/tracks?limit={tracks}&format={form}" for form in FORMATS}
    table = pl.read_ipc_stream(io.BytesIO(server.get(paths["arrow"])))
    if len(table) != tracks:
        raise UnexpectedAnswerError(f"expected {tracks} tracks, was {len(table)}")
    count = plan.size(MANY)
    times = {form: _times(server, [path] * count) for form, path in paths.items()}
    peers = {
        "json": ("polars write_json", _written(table, count, "json")),
        "arrow": ("polars write_ipc_stream", _written(table, count, "arrow")),
        "geojson": ("JSON", times["json"]),
    }
    return [
        row
        for form in FORMATS
        for row in _rows(f"{tracks} tracks, {form}", times[form], *peers[form])
    ]


def _times(server: Server, paths: Sequence[str]) -> list[float]:
    for path in paths[:5]:
        server.get(path)
    found = []
    for path in paths:
        begin = perf_counter()
        server.get(path)
        found.append(perf_counter() - begin)
    return found


def _written(table: pl.DataFrame, count: int, form: str) -> list[float]:
    found = []
    for _ in range(count):
        begin = perf_counter()
        if form == "json":
            table.write_json()
        else:
            table.write_ipc_stream(io.BytesIO())
        found.append(perf_counter() - begin)
    return found


def _rows(label: str, times: Sequence[float], peer: str, peer_times: Sequence[float]) -> list[Row]:
    return [
        Row(
            f"{label}: p{percent}",
            float(np.percentile(times, percent)) * 1e3,
            "ms",
            len(times),
            f"{peer}, p{percent}",
            float(np.percentile(peer_times, percent)) * 1e3,
        )
        for percent in (50, 99)
    ]
