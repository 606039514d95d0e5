"""Measurements over HTTP until they are on disk, and until they are in the tracks."""

import sqlite3
from pathlib import Path
from statistics import median
from time import perf_counter

import polars as pl

from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.sky import make_recording
from benchmark.service.server import IN_FLIGHT, Server, UnexpectedAnswerError
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode

TEXT = (
    "`POST /v1/measurements` to `multiradar serve` in its own process. The client has "
    f"{IN_FLIGHT} requests in flight and counts acknowledged measurements, that is, those on "
    "disk. *In tracks*: until the tracker has processed and published them. Bodies are "
    "encoded in advance. 4 000 aircraft. Peer of Arrow: a plain SQLite table (WAL, full sync) "
    "in the benchmark's process, which commits the same bodies one by one. Peer of JSON and "
    "NDJSON: Arrow."
)
AIRCRAFT = 4_000
BATCHES = (1_000, 10_000)
TEXTS = {Encoding.JSON: "JSON", Encoding.NDJSON: "NDJSON"}
#: Below the capacity between journal and tracker, so that the disk is the bottleneck.
ROWS = 200_000
#: More than the reordering horizon buffers.
WARM_ROWS = 60_000


def run(plan: Plan) -> list[Row]:
    """Measure each encoding in batches of each size."""
    count = plan.size(ROWS)
    recording = make_recording(WARM_ROWS + plan.runs * count, AIRCRAFT)
    rows = []
    for batch in BATCHES:
        bodies = [encode(part, Encoding.ARROW) for part in recording[:count].iter_slices(batch)]
        commits = median(count / _commit_all(plan.folder, bodies) for _ in range(plan.runs))
        arrow = _rates(plan, recording, Encoding.ARROW, batch)
        rows += _rows(plan, f"Arrow, {batch}", arrow, "SQLite commits", (commits, None))
        for encoding, name in TEXTS.items():
            rates = _rates(plan, recording, encoding, batch)
            rows += _rows(plan, f"{name}, {batch}", rates, "Arrow", arrow)
    return rows


def _rows(
    plan: Plan,
    label: str,
    rates: tuple[float, float],
    peer: str,
    peer_rates: tuple[float, float | None],
) -> list[Row]:
    return [
        Row(
            f"{label} a request: {what}",
            rate,
            "measurements/s",
            plan.runs,
            None if beside is None else peer,
            beside,
        )
        for what, rate, beside in zip(("on disk", "in tracks"), rates, peer_rates, strict=True)
    ]


def _rates(
    plan: Plan, recording: pl.DataFrame, encoding: Encoding, batch: int
) -> tuple[float, float]:
    """Return measurements per second until on disk, and until in tracks."""
    count = plan.size(ROWS)
    durable, in_tracks = [], []
    with Server(plan.folder / f"{encoding}-{batch}") as server:
        _post(server, recording[:WARM_ROWS], encoding, batch)
        server.wait_processed()
        for run in range(plan.runs):
            part = recording[WARM_ROWS + run * count :][:count]
            elapsed_s, begin = _post(server, part, encoding, batch)
            server.wait_processed()
            durable.append(count / elapsed_s)
            in_tracks.append(count / (perf_counter() - begin))
    return median(durable), median(in_tracks)


def _post(
    server: Server, frame: pl.DataFrame, encoding: Encoding, batch: int
) -> tuple[float, float]:
    """Post a table; return duration and start time."""
    bodies = [encode(part, encoding) for part in frame.iter_slices(batch)]
    begin = perf_counter()
    accepted = server.post(bodies, MEDIA_TYPES[encoding])
    elapsed_s = perf_counter() - begin
    if accepted != len(frame):
        raise UnexpectedAnswerError(f"{accepted} of {len(frame)} measurements were accepted")
    return elapsed_s, begin


def _commit_all(folder: Path, bodies: list[bytes]) -> float:
    path = folder / "peer.sqlite"
    path.unlink(missing_ok=True)
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute("CREATE TABLE entry (sequence INTEGER PRIMARY KEY, payload BLOB)")
    begin = perf_counter()
    for body in bodies:
        connection.execute("INSERT INTO entry (payload) VALUES (?)", (body,))
    elapsed_s = perf_counter() - begin
    connection.close()
    return elapsed_s
