"""Plots without identity from disk through the whole tracker to tables on disk, on one core.

Time is that of the processor, of all threads together: what one core would take.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import polars as pl

from benchmark.packages import nearest_neighbours
from benchmark.plan import Plan
from benchmark.report import Row
from benchmark.scenes import airspace
from multiradar import wire
from multiradar.runtime.offline.offline_job import TRACKS_FILE, OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.storage.recording import MEASUREMENTS_FILE, Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.sensors.sensor import load_sensors

TEXT = (
    "`multiradar track --hide track_number,mode_3a,mode_s_address` without its start: plots "
    "of 8 rotating radars with unknown biases are read from `measurements.parquet`, "
    "associated, tracked and written to `tracks.parquet` and `biases.parquet`, including the "
    "first scans with all track initiations; one worker, CPU time of all threads. Aircraft "
    "fly on 30 flight levels over a disc of 300 km, one in ten in a steep turn; 3 % of the "
    "plots are missing, 0.5 % are false.\n\n"
    "Peer: Stone Soup with an extended Kalman filter and global nearest neighbours over "
    "Mahalanobis distances (`GNNWith2DAssignment`), each radar's plots of half a second at "
    "once. It gets a part of the same scenario: the aircraft nearest to the centre for three "
    "scans, with all tracks initiated, true biases and no false plots. Its cost per plot "
    "grows with the number of aircraft.\n\n"
    "*Wrong*: of the plots of aircraft with a track, those not on the track with most "
    "plots of their aircraft, and most of whose plots are of it. *Wrong or none*: the same of "
    "all plots of aircraft; plots of other radars on a new aircraft do not initiate a second "
    "track, and have none."
)
AIRCRAFT = (4_000, 15_000)
FILTERS = ("two-stage", "imm")
ROWS = 2_000_000
HIDDEN = ("track_number", "mode_3a", "mode_s_address")
#: As the converter writes it.
ROW_GROUP_ROWS = 65_536
#: No further run of a case begins after this time: a busy machine gets fewer runs, not more time.
CASE_S = 30.0


@dataclass(frozen=True)
class _Case:
    filter_name: str
    aircraft: int
    rows: int

    @property
    def label(self) -> str:
        return f"{self.filter_name}, {self.aircraft} aircraft, {self.rows / 1e6:g} million plots"


def run(plan: Plan) -> list[Row]:
    """Track scenes of two sizes with both filters, and a cut of each with Stone Soup."""
    airspace.write_sensors(plan.folder / "sensors.toml")
    for name in FILTERS:  # What is compiled first is not measured.
        _track(plan, _Case(name, 100, 10_000))
    rows = []
    for aircraft in (plan.size(one) for one in AIRCRAFT):
        cut = nearest_neighbours.run(aircraft, plan.quick)
        print(
            f"Stone Soup on a cut of {aircraft} aircraft: {cut.plots} plots of {cut.aircraft} "
            f"aircraft in {cut.seconds:.1f} s, {100.0 * cut.right / cut.plots:.2f} % right",
            flush=True,
        )
        peer = f"Stone Soup with GNN, {cut.aircraft} of them, {cut.plots} plots"
        for name in FILTERS:
            case = _Case(name, aircraft, plan.size(ROWS))
            rates, (of_tracked, of_all) = _rates(plan, case)
            rate = cut.plots / cut.seconds
            rows.append(Row(case.label, median(rates), "plots/s", len(rates), peer, rate))
            for what, right in (("wrong", of_tracked), ("wrong or none", of_all)):
                rows.append(Row(f"{case.label}, {what}", 100.0 * (1.0 - right), "%", 1))
    return rows


def _rates(plan: Plan, case: _Case) -> tuple[list[float], tuple[float, float]]:
    """Return plots a second of each run, and the shares of plots that are right."""
    found: list[float] = []
    begin = perf_counter()
    while not found or (len(found) < plan.runs and perf_counter() - begin < CASE_S):
        found.append(case.rows / _track(plan, case))
    return found, right_shares(
        pl.read_parquet(_recording(plan, case)), pl.read_parquet(plan.folder / "out" / TRACKS_FILE)
    )


def right_shares(plots: pl.DataFrame, tracks: pl.DataFrame) -> tuple[float, float]:
    """Return the share of plots on their aircraft's one track, of those with a track and of all.

    Parameters
    ----------
    plots, tracks : DataFrame
        `track_number` identifies the aircraft, null for none; `track_id` is the tracker's.
    """
    updates = tracks.drop_nulls("track_number")
    both = updates.group_by("track_id", "track_number").len()
    most = pl.col("len") == pl.col("len").max()
    own = both.filter(most.over("track_id") & most.over("track_number"))
    # Of equal ones, which say little of an aircraft anyway, the first.
    own = own.sort("track_id").unique("track_number", keep="first")
    right = int(own["len"].sum())
    return right / len(updates), right / len(plots.drop_nulls("track_number"))


def _track(plan: Plan, case: _Case) -> float:
    recording = Recording(_recording(plan, case))
    job = OfflineJob(
        recording=recording,
        sensors=wire.sensor_table(load_sensors(plan.folder / "sensors.toml")),
        settings=TrackingSettings(filter_name=case.filter_name, hidden_fields=HIDDEN),
    )
    out = plan.folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    begin = process_time()
    track_recording(job, out)
    return process_time() - begin


def _recording(plan: Plan, case: _Case) -> Path:
    path = plan.folder / f"{case.aircraft}-{case.rows}" / MEASUREMENTS_FILE
    if not path.exists():
        path.parent.mkdir()
        frame = airspace.make_recording(case.rows, case.aircraft)
        frame.write_parquet(path, compression="zstd", row_group_size=ROW_GROUP_ROWS)
    return path
