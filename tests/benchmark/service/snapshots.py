"""Starts of a service with a long journal, and what snapshots cost while it processes."""

import logging
from pathlib import Path
from time import process_time
from typing import Any

import polars as pl

from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes.sky import make_recording, write_sensors
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.runtime.live.service import Service
from multiradar.runtime.live.snapshots import SnapshotRules
from multiradar.storage.snapshots import SnapshotFolder
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import load_sensors

TEXT = (
    "A service in the benchmark's process, 4 000 aircraft, filter imm. Starts: the same journal, "
    "with the whole of it replayed as the peer. Processing: two services get the same "
    "measurements by turns, one with snapshots every 250 000 measurements, and its turn lasts "
    "until each is written; the peer has none. Times are those of the processor, which other "
    "load does not change; the pause, how long the engine waits for the copy, is the shortest."
)
AIRCRAFT = 4_000
ROWS = 2_000_000
BATCH = 10_000
#: Measurements that one service gets before it is the other's turn.
TURN = 50_000
SNAPSHOT_ROWS = 250_000


class _Written(logging.Handler):
    # Megabytes of each snapshot, and how long the engine waited, ms.
    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[float, float]] = []

    def emit(self, record: logging.LogRecord) -> None:
        if isinstance(record.args, tuple) and len(record.args) == 4:
            _, megabytes, _, paused_ms = record.args
            self.found.append((float(str(megabytes)), float(str(paused_ms))))


def run(plan: Plan) -> list[Row]:
    """Fill two journals by turns, then start from them."""
    written = _Written()
    logger = logging.getLogger("multiradar.runtime.live.snapshots")
    logger.addHandler(written)
    logger.setLevel(logging.INFO)
    sensors = plan.folder / "sensors.toml"
    write_sensors(sensors)
    table = sensor_table(load_sensors(sensors))
    recording = make_recording(plan.size(ROWS), AIRCRAFT)
    with_snapshots, without = plan.folder / "with" / "journal", plan.folder / "without" / "journal"
    cost = _fill(table, recording, with_snapshots, without)
    copies = list(written.found)
    rows = [
        Row("processing with snapshots", cost[0], "s", 1, "without snapshots", cost[1]),
        Row("pause of the engine at a snapshot", min(ms for _, ms in copies), "ms", len(copies)),
        Row("state in a snapshot", copies[-1][0], "MB", 1),
        Row("all files of two snapshots", _octets(with_snapshots) / 1e6, "MB", 1),
    ]
    whole_s = _start(table, without, snapshots=False)
    rows.append(
        Row(
            "start after a clean stop", _start(table, with_snapshots), "s", 1,
            "whole journal", whole_s,
        )
    )  # fmt: skip
    # As after a kill: the newest snapshot is that before the stop.
    SnapshotFolder(with_snapshots).files()[0].unlink()
    killed_s = _start(table, with_snapshots)
    rows.append(Row("start after a kill", killed_s, "s", 1, "whole journal", whole_s))
    logger.removeHandler(written)
    return rows


def _service(table: SensorTable, journal: Path, *, snapshots: bool = True) -> Service:
    tracking = TrackingSettings()
    fingerprint = configuration_fingerprint(table, tracking)
    rules = SnapshotRules(SnapshotFolder(journal), 1e9, SNAPSHOT_ROWS, fingerprint)
    return Service(
        open_journal=lambda: SqliteJournal(journal, fingerprint),
        open_engine=lambda: Engine(table, tracking, sampling=Sampling.ALL),
        sensors=table,
        tracking=tracking,
        snapshots=rules if snapshots else None,
    )


# Return seconds of processing with and without snapshots.
def _fill(
    table: SensorTable, recording: pl.DataFrame, journal: Path, other: Path
) -> tuple[float, float]:
    services = _service(table, journal), _service(table, other, snapshots=False)
    for service in services:
        service.start()
    spent = [0.0, 0.0]
    for number, turn in enumerate(recording.iter_slices(TURN)):
        # Each is first as often as the other.
        for which in (0, 1) if number % 2 else (1, 0):
            begin = process_time()
            for part in turn.iter_slices(BATCH):
                services[which].submit(part, source="bench").result()
            services[which].settled().result()
            processor: Any = services[which]._processor
            if processor._snapshots is not None:
                processor._snapshots.wait()
            # The first turn loads the kernels.
            if number:
                spent[which] += process_time() - begin
    for service in services:
        service.stop()
    return spent[0], spent[1]


def _start(table: SensorTable, journal: Path, *, snapshots: bool = True) -> float:
    service = _service(table, journal, snapshots=snapshots)
    begin = process_time()
    service.start()
    started_s = process_time() - begin
    service.stop()
    return started_s


def _octets(journal: Path) -> int:
    return sum(path.stat().st_size for path in SnapshotFolder(journal).path.iterdir())
