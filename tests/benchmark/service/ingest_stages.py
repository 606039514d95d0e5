"""Processor time of a measurement in each stage until it is on disk."""

from collections.abc import Iterator
from contextlib import contextmanager
from statistics import mean
from time import process_time

import polars as pl

from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.sky import make_recording, write_sensors
from multiradar.diagnosis.evidence import Evidence
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.ingest.bodies import decode
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.live.intake import Submission
from multiradar.runtime.live.preparation import Prepared, prepare
from multiradar.storage.entries import EntryKind
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.wire.sensors import sensor_table
from multiradar_schemas.sensors.sensor import load_sensors

TEXT = (
    "Processor time of a measurement in the stages of `POST /v1/measurements`, one message after "
    "the other in the process of the benchmark, without HTTP and without the tracker: mean of "
    "the messages. *Decode*: the body as a table, checked. *Prepare*: translation, admission, and "
    "the entry of the journal. *Journal*: the entry on disk. *Diagnosis*: what is retained for it."
)
AIRCRAFT = 4_000
BATCHES = (1_000, 10_000)
#: Messages of each size and encoding.
MESSAGES = 40
ROWS_MAX = 100_000


def run(plan: Plan) -> list[Row]:
    """Measure each encoding in messages of each size."""
    write_sensors(plan.folder / "sensors.toml")
    table = sensor_table(load_sensors(plan.folder / "sensors.toml"))
    rows = []
    for batch in BATCHES:
        recording = make_recording(batch * plan.size(MESSAGES), AIRCRAFT)
        for encoding in Encoding:
            spent = _stages(plan, recording, table, encoding, batch)
            for stage, times_s in spent.items():
                each_us = mean(times_s) / batch * 1e6
                label = f"{encoding}, {batch} a message: {stage}"
                rows.append(Row(label, each_us, "µs", len(times_s)))
    return rows


def _stages(
    plan: Plan, recording: pl.DataFrame, table: SensorTable, encoding: Encoding, batch: int
) -> dict[str, list[float]]:
    spent = _Spent()
    admission, evidence = Admission.for_sensors(table, 60.0), Evidence(table)
    journal = SqliteJournal(plan.folder / f"{encoding}-{batch}.sqlite", "benchmark")
    bodies = [encode(part, encoding) for part in recording.iter_slices(batch)]
    # The first compiles.
    for body in [bodies[0], *bodies]:
        with spent.on("decode"):
            decoded = decode(MEDIA_TYPES[encoding], body, ROWS_MAX)
        message = Submission(EntryKind.BATCH, decoded.frame, "http", None, decoded.rejected)
        with spent.on("prepare"):
            (prepared,) = prepare([message], table, admission)
        assert isinstance(prepared, Prepared)
        with spent.on("journal"):
            journal.append([prepared.entry])
        with spent.on("diagnosis"):
            evidence.record_rows(decoded.frame)
    journal.close()
    return {stage: times_s[1:] for stage, times_s in spent.times_s.items()}


class _Spent:
    # Processor times by stage.
    def __init__(self) -> None:
        self.times_s: dict[str, list[float]] = {}

    @contextmanager
    def on(self, stage: str) -> Iterator[None]:
        begin = process_time()
        yield
        self.times_s.setdefault(stage, []).append(process_time() - begin)
