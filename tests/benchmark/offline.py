"""A recording on disk through the whole tracker to tables on disk, in plots per second."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

import polars as pl

from benchmark.plan import Plan, seconds
from benchmark.report import Row
from benchmark.scenes.sky import make_recording, write_sensors
from multiradar import wire
from multiradar.estimation.filters.bank import FILTERS
from multiradar.runtime.offline.offline_job import TRACKS_FILE, OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.storage.recording import MEASUREMENTS_FILE, Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.sensors.sensor import load_sensors

TEXT = (
    "`multiradar track` without its start: `measurements.parquet` is read, validated, "
    "tracked, hashed and written to `tracks.parquet` and `biases.parquet`; 8 radars and "
    "ADS-B. Peer: polars, which reads the same measurements and writes the same tracks, in "
    "memory and on all cores, with no processing in between."
)
AIRCRAFT = (150, 4_000, 15_000)
ROWS = 2_000_000
#: Number of runs for comparisons only.
ROWS_COMPARED = 400_000
#: No further run of a case starts after this time: a busy machine gets fewer runs, not more time.
CASE_S = 20.0
#: As the converter writes it.
ROW_GROUP_ROWS = 65_536


@dataclass(frozen=True)
class _Case:
    filter_name: str
    aircraft: int
    rows: int
    workers: int = 1

    @property
    def label(self) -> str:
        workers = f"{self.workers} worker{'s' * (self.workers > 1)}"
        plots = f"{self.rows / 1e6:g} million plots"
        return f"{self.filter_name}, {self.aircraft} aircraft, {plots}, {workers}"


def run(plan: Plan) -> list[Row]:
    """Track recordings of several sizes; compare filters and workers on one of them."""
    write_sensors(plan.folder / "sensors.toml")
    for name in FILTERS:
        _track(plan, _Case(name, 150, 10_000))
    rows = []
    for aircraft in AIRCRAFT:
        case = _Case("two-stage", plan.size(aircraft), plan.size(ROWS))
        rates, peer = _rates(plan, case)
        rows.append(Row(case.label, median(rates), "plots/s", len(rates), "polars copy", peer))
    return rows + _compared(plan)


def _compared(plan: Plan) -> list[Row]:
    aircraft, count = plan.size(15_000), plan.size(ROWS_COMPARED)
    plain = _Case("two-stage", aircraft, count)
    rates, _ = _rates(plan, plain)
    rows = []
    # The joint filter has not enough capacity for so many aircraft.
    names = [name for name, definition in FILTERS.items() if definition.aircraft_max is None]
    others = [_Case(name, aircraft, count) for name in names if name != plain.filter_name]
    for case in [*others, _Case("two-stage", aircraft, count, workers=2)]:
        found, _ = _rates(plan, case)
        rows.append(
            Row(case.label, median(found), "plots/s", len(found), plain.label, median(rates))
        )
    return rows


def _rates(plan: Plan, case: _Case) -> tuple[list[float], float]:
    """Return plots per second of each run, and of the peer."""
    found: list[float] = []
    copied: list[float] = []
    begin = perf_counter()
    while not found or (len(found) < plan.runs and perf_counter() - begin < CASE_S):
        found.append(case.rows / _track(plan, case))
        copied.append(case.rows / _copy(plan.folder))
    return found, median(copied)


def _track(plan: Plan, case: _Case) -> float:
    given = plan.folder / f"{case.aircraft}-{case.rows}" / MEASUREMENTS_FILE
    if not given.exists():
        given.parent.mkdir()
        frame = make_recording(case.rows, case.aircraft)
        frame.write_parquet(given, compression="zstd", row_group_size=ROW_GROUP_ROWS)
    out = _new(plan.folder / "out")
    shutil.copyfile(given, plan.folder / MEASUREMENTS_FILE)
    job = OfflineJob(
        recording=Recording(plan.folder / MEASUREMENTS_FILE),
        sensors=wire.sensor_table(load_sensors(plan.folder / "sensors.toml")),
        settings=TrackingSettings(filter_name=case.filter_name),
        workers=case.workers,
    )
    return seconds(lambda: track_recording(job, out))


def _copy(folder: Path) -> float:
    """Read and write the same data as the tracker, as plain tables."""
    tracks = pl.read_parquet(folder / "out" / TRACKS_FILE)

    def copy() -> None:
        pl.read_parquet(folder / MEASUREMENTS_FILE)
        tracks.write_parquet(folder / "copy.parquet", compression="zstd")

    return seconds(copy)


def _new(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder
