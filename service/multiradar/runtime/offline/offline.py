"""A recording from disk through the tracker to tables on disk: the same path as live, no service.

Memory is bounded: the recording is read in blocks, outputs are spooled. What is written is a
function of the recording, the sensors and the settings; not of batch sizes or workers.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.clock import SystemClock
from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.errors import AccountingError
from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.admission.admission import ACCEPTED, Admission
from multiradar.runtime.admission.arrivals import ArrivalBoard
from multiradar.runtime.admission.places import Places
from multiradar.runtime.admission.reject_file import RejectFile, TimeRefusals
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.engine import Engine
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.runtime.offline.encounter_table import EncounterTable
from multiradar.runtime.offline.forecast_table import ForecastTable
from multiradar.runtime.offline.stage_times import READING, TRACKING, WRITING, StageTimes
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.manoeuvre_planes import plane_of_track
from multiradar.runtime.queries.observabilities import observability_of_track
from multiradar.runtime.queries.track_windows import Judge, WindowTable
from multiradar.runtime.trajectories.forecast_rows import BundleForecasts, BundleForecastTable
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.runtime.trajectories.table import TrajectoryTable
from multiradar.storage.recording import INDEX_COLUMN, Recording
from multiradar.storage.table_writer import TableWriter
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.outputs import (
    BiasRecords,
    EngineOutput,
    TrackTransitions,
    TrackUpdates,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA
from multiradar_schemas.products.forecast import FORECAST_SCHEMA
from multiradar_schemas.products.health import HEALTH_SCHEMA
from multiradar_schemas.products.manoeuvre_plane import MANOEUVRE_PLANE_SCHEMA
from multiradar_schemas.products.observability import OBSERVABILITY_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA

BATCH_ROWS = 8192
TRACKS_FILE = "tracks.parquet"
BIASES_FILE = "biases.parquet"
TRANSITIONS_FILE = "transitions.parquet"
HEALTH_FILE = "health.parquet"
PLANES_FILE = "manoeuvre_planes.parquet"
OBSERVABILITY_FILE = "observability.parquet"
ENCOUNTERS_FILE = "encounters.parquet"
TRAJECTORIES_FILE = "trajectories.parquet"
FORECASTS_FILE = "forecasts.parquet"
BUNDLE_FORECASTS_FILE = "bundle_forecasts.parquet"
REJECTS_FILE = "rejects.ndjson"


@dataclass(frozen=True, slots=True)
class OfflineJob:
    """What is tracked, and how.

    Attributes
    ----------
    recording : Recording
        The measurements.
    sensors : SensorTable
        The sensors that may measure.
    settings : TrackingSettings
        What the output depends on beside these.
    kinds : collection of str, optional
        Kinds of measurement to use; all when absent.
    workers : int
        Threads of the tracker.
    batch_rows : int
        Measurements handed on at once.
    plane_window_s, observability_window_s : float, optional
        Windows of the planes in which tracks manoeuvre, and of whether they are observable, s;
        none are written when absent.
    encounters : EncounterQuery, optional
        Which encounters are written; none when absent.
    trajectories : TrajectoryOptions, optional
        Bundles of trajectories; none are made when absent.
    forecasts_every_s : float, optional
        Data time between two forecasts of a track, s; none are written when absent.
    """

    recording: Recording
    sensors: SensorTable
    settings: TrackingSettings
    kinds: Collection[str] | None = None
    workers: int = 1
    batch_rows: int = BATCH_ROWS
    plane_window_s: float | None = None
    observability_window_s: float | None = None
    encounters: EncounterQuery | None = None
    trajectories: TrajectoryOptions | None = None
    forecasts_every_s: float | None = None


@dataclass(slots=True)
class OfflineResult:
    """What a run read, refused and wrote.

    Attributes
    ----------
    read, accepted, duplicate : int
        Measurements of the kinds chosen; those that the tracker took; those that another says.
    duplicates_by_sensor : Counter
        Those of them of each sensor that has some.
    rejected : Counter
        Those refused, by code.
    updates, tracks, tracks_confirmed, bias_rows, health_rows, steps : int
        Rows of `tracks.parquet`, different tracks in it, those of them that were confirmed, rows of
        `biases.parquet`, of `health.parquet` and of `transitions.parquet`.
    window_rows : dict
        Rows of the tables by epochs that were asked for, by file.
    final_biases : dict
        Last estimate of each sensor and parameter, with its sigma, and that over its prior sigma.
    final_health : dict
        Last row of `health.parquet` of each radar.
    alarms : list of dict
        What went wrong with radars: `time_s`, `sensor_id` and the `alarm` that began.
    untold : tuple of UnobservableBias
        Combinations of biases of which the measurements have told nothing.
    tracker : dict
        What became of the accepted measurements in the filter, by outcome.
    transitions : dict
        How often tracks without identity went on in their lives, by reason.
    arrivals : dict
        Of each sensor: measurements received, how many too late, how far behind the data time.
    warnings : list of str
        What the reader should know.
    output_sha256 : str
        Digest of all updates and biases.
    trajectories : dict
        What became of the plots that bundles of trajectories were given; empty without bundles.
    asterix : dict
        Records of ASTERIX that were written, by category, and what was left out of them.
    diagnoses : list of Diagnosis
        What is probably wrong with sensors, their settings or the recording.
    """

    read: int = 0
    accepted: int = 0
    duplicate: int = 0
    duplicates_by_sensor: Counter[str] = field(default_factory=Counter)
    rejected: Counter[str] = field(default_factory=Counter)
    updates: int = 0
    tracks: int = 0
    tracks_confirmed: int = 0
    bias_rows: int = 0
    health_rows: int = 0
    steps: int = 0
    window_rows: dict[str, int] = field(default_factory=dict)
    final_biases: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    final_health: dict[str, dict[str, Any]] = field(default_factory=dict)
    alarms: list[dict[str, Any]] = field(default_factory=list)
    untold: tuple[UnobservableBias, ...] = ()
    tracker: dict[str, int] = field(default_factory=dict)
    transitions: dict[str, int] = field(default_factory=dict)
    arrivals: dict[str, dict[str, Any]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    output_sha256: str = ""
    trajectories: dict[str, Any] = field(default_factory=dict)
    asterix: dict[str, int] = field(default_factory=dict)
    diagnoses: list[Diagnosis] = field(default_factory=list)

    @property
    def rejected_total(self) -> int:
        """Number of measurements refused."""
        return sum(self.rejected.values())


def track_recording(
    job: OfflineJob,
    folder: Path,
    on_progress: Callable[[int], None] = lambda _rows: None,
    on_output: Callable[[EngineOutput], None] | None = None,
    stages: StageTimes | None = None,
) -> OfflineResult:
    """Track a recording and write tracks, biases and rejects.

    Parameters
    ----------
    job : OfflineJob
        What is tracked.
    folder : Path
        Existing, empty folder for `tracks.parquet`, `transitions.parquet`, `biases.parquet`,
        `health.parquet` and `rejects.ndjson`.
    on_progress : callable
        Told the number of measurements that are done, after every batch.
    on_output : callable, optional
        Given all that the engine puts out.
    stages : StageTimes, optional
        Measures the time of each stage.

    Returns
    -------
    OfflineResult
        Counts, last biases and the digest.

    Raises
    ------
    InputError
        The recording cannot be read.
    AccountingError
        Read is not accepted + rejected.
    """
    pictures = job.encounters is not None
    # Encounters learn from forecasts of a few tracks, as live.
    sampling = Sampling.DRAWN if pictures else Sampling.NONE
    if job.forecasts_every_s is not None:
        sampling = Sampling.ALL
    engine = Engine(job.sensors, job.settings, job.workers, pictures=pictures, sampling=sampling)
    stages = stages or StageTimes(SystemClock())
    run: _Run | None = None
    try:
        run = _Run(job, folder, engine, on_output, stages)
        done = 0
        for block in stages.each(READING, job.recording.blocks(job.kinds)):
            for rows in run.take(block):
                on_progress(done + rows)
            done += len(block)
        return run.finish()
    finally:
        if run is not None:
            run.close()
        engine.close()


class _Run:
    # The state of one run: writers, counts, the digest.
    def __init__(
        self,
        job: OfflineJob,
        folder: Path,
        engine: Engine,
        on_output: Callable[[EngineOutput], None] | None,
        stages: StageTimes,
    ) -> None:
        self._on_output = on_output
        self._stages = stages
        self._sensors = job.sensors
        self._batch_rows = job.batch_rows
        self._engine = engine
        horizon_s = job.settings.reorder_horizon_s
        self._arrivals = ArrivalBoard(job.sensors, horizon_s)
        self._admission = Admission(horizon_s, arrivals=self._arrivals)
        self._digest = OutputDigest()
        self._tally = TrackTally()
        self._tracks = TableWriter(folder / TRACKS_FILE, TRACK_SCHEMA)
        self._biases = TableWriter(folder / BIASES_FILE, BIAS_SCHEMA)
        self._health = TableWriter(folder / HEALTH_FILE, HEALTH_SCHEMA)
        self._transitions = TableWriter(folder / TRANSITIONS_FILE, TRANSITION_SCHEMA)
        self._windows = _tables(job, folder, engine.plane)
        self._rejects = RejectFile(folder / REJECTS_FILE, job.recording.path.name)
        self._places = Places()
        self._evidence = Evidence(job.sensors, job.kinds)
        self._result = OfflineResult()

    # Takes one block; yields how many of its rows are done, batch after batch.
    def take(self, block: pl.DataFrame) -> Iterator[int]:
        with self._stages.measure(READING):
            measured, refused = wire.measurement_batch(block.drop(INDEX_COLUMN), self._sensors)
        clock_s = self._admission.data_clock_s
        codes = np.zeros(len(measured), np.int8)
        at = np.delete(block[INDEX_COLUMN].cast(pl.Int64).to_numpy(), refused.index)
        outputs = []
        for start in range(0, len(measured), self._batch_rows):
            rows = slice(start, start + self._batch_rows)
            with self._stages.measure(TRACKING):
                batch = measured.select(rows)
                codes[rows] = self._admission.admit(batch)
                taken = codes[rows] == ACCEPTED
                self._places.add(0, int(np.count_nonzero(taken)), at[rows][taken])
                outputs.append(self._engine.push(batch if taken.all() else batch.select(taken)))
            yield min(rows.stop, len(block))
        self._result.read += len(block)
        self._result.accepted += int(np.count_nonzero(codes == ACCEPTED))
        self._evidence.record_batch(block, refused, measured, codes)
        times = TimeRefusals(self._admission, clock_s, measured.time_s, codes)
        with self._stages.measure(WRITING):
            self._write(outputs)
            self._result.rejected += self._rejects.write(block, refused, times)
            self._write_duplicates(outputs)

    def finish(self) -> OfflineResult:
        with self._stages.measure(TRACKING):
            last = self._engine.flush()
        with self._stages.measure(WRITING):
            self._write([last])
            self._write_duplicates([last])
            self._rejects.finish()
            for one in (self._tracks, self._biases, self._health, self._transitions):
                one.finish()
        for file, (table, writer) in self._windows.items():
            with self._stages.measure(_stage_of(file)):
                self._keep_windows(file, writer, table.finish())
                writer.finish()
            if isinstance(table, TrajectoryTable):
                self._result.trajectories = table.counts()
            if isinstance(table, EncounterTable):
                self._result.warnings += table.warnings()
        self.close()
        result = self._result
        outcomes = self._engine.counts
        result.duplicate = outcomes.pop("DUPLICATE")
        result.accepted -= result.duplicate
        # The admission has refused what is late, so the tracker finds nothing late any more.
        late = outcomes.pop("LATE")
        result.tracker = {name.lower(): count for name, count in outcomes.items()}
        _check(result, late)
        result.tracks, result.tracks_confirmed = self._tally.initiated, self._tally.confirmed
        result.transitions = self._engine.transitions
        result.arrivals = self._arrivals.records()
        result.warnings += self._arrivals.warnings()
        result.untold = self._engine.untold()
        result.output_sha256 = self._digest.hexdigest()
        result.diagnoses = diagnose(self._evidence)
        return result

    def close(self) -> None:
        self._rejects.close()

    def _write(self, outputs: Sequence[EngineOutput]) -> None:
        for output in outputs:
            self._digest.add(output)
            self._tally.take(output)
            self._evidence.record_output(output)
            for file, (table, writer) in self._windows.items():
                with self._stages.measure(_stage_of(file)):
                    self._keep_windows(file, writer, table.take(output))
            if self._on_output is not None:
                self._on_output(output)
        updates = TrackUpdates.concatenate([output.updates for output in outputs])
        biases = BiasRecords.concatenate([output.biases for output in outputs])
        if len(updates):
            self._tracks.append(wire.tracks_frame(updates, self._sensors))
            self._result.updates += len(updates)
        steps = TrackTransitions.concatenate([output.transitions for output in outputs])
        if len(steps):
            self._transitions.append(wire.transitions_frame(steps))
            self._result.steps += len(steps)
        if len(biases):
            frame = wire.biases_frame(biases, self._sensors)
            self._biases.append(frame)
            self._result.bias_rows += len(frame)
            self._keep_last(frame)
        health = HealthRecords.concatenate([output.health for output in outputs])
        if len(health):
            self._keep_health(wire.health_frame(health, self._sensors))

    def _keep_windows(self, file: str, writer: TableWriter, frame: pl.DataFrame) -> None:
        writer.append(frame)
        self._result.window_rows[file] = self._result.window_rows.get(file, 0) + len(frame)

    def _keep_health(self, frame: pl.DataFrame) -> None:
        self._health.append(frame)
        self._result.health_rows += len(frame)
        for row in frame.iter_rows(named=True):
            name = row["sensor_id"]
            before = self._result.final_health.get(name, {}).get("alarms", "")
            self._result.alarms += [
                {"time_s": row["time_s"], "sensor_id": name, "alarm": alarm}
                for alarm in row["alarms"].split(",")
                if alarm and alarm not in before.split(",")
            ]
            self._result.final_health[name] = row

    def _write_duplicates(self, outputs: Sequence[EngineOutput]) -> None:
        found = Duplicates.concatenate([output.duplicates for output in outputs])
        places = [row for _, row in self._places.find(found.arrival.tolist())]
        self._rejects.write_duplicates(found, places, self._sensors)
        named = (self._sensors.ids[sensor] for sensor in found.batch.sensor.tolist())
        self._result.duplicates_by_sensor.update(named)
        self._places.forget(self._engine.waiting_from)

    def _keep_last(self, frame: pl.DataFrame) -> None:
        last = frame.unique(["sensor_id", "parameter"], keep="last", maintain_order=True)
        for row in last.iter_rows(named=True):
            of_sensor = self._result.final_biases.setdefault(row["sensor_id"], {})
            of_sensor[row["parameter"]] = {
                name: row[name] for name in ("estimate", "sigma", "prior_ratio")
            }


def _stage_of(file: str) -> str:
    return Path(file).stem.replace("_", " ")


class _Table(Protocol):
    # A table by epochs of data time.
    def take(self, output: EngineOutput) -> pl.DataFrame: ...

    def finish(self) -> pl.DataFrame: ...


# What is told by epochs of each track, or of each pair, with its file.
def _tables(
    job: OfflineJob, folder: Path, plane: SystemPlane
) -> dict[str, tuple[_Table, TableWriter]]:
    kinds: tuple[tuple[str, float | None, Judge, pl.Schema], ...] = (
        (PLANES_FILE, job.plane_window_s, plane_of_track, MANOEUVRE_PLANE_SCHEMA),
        (
            OBSERVABILITY_FILE, job.observability_window_s, observability_of_track,
            OBSERVABILITY_SCHEMA,
        ),
    )  # fmt: skip
    tables: dict[str, tuple[_Table, TableWriter]] = {
        file: (
            WindowTable(judge, schema, job.sensors, window_s, job.settings.epoch_s),
            TableWriter(folder / file, schema),
        )
        for file, window_s, judge, schema in kinds
        if window_s is not None
    }
    if job.encounters is not None:
        tables[ENCOUNTERS_FILE] = (
            EncounterTable(job.encounters, plane, job.settings),
            TableWriter(folder / ENCOUNTERS_FILE, ENCOUNTER_SCHEMA),
        )
    if job.trajectories is not None:
        every_s = job.forecasts_every_s
        forecasts = None if every_s is None else BundleForecasts(every_s)
        bundles = TrajectoryTable(job.trajectories, job.sensors, job.settings, forecasts)
        tables[TRAJECTORIES_FILE] = (
            bundles,
            TableWriter(folder / TRAJECTORIES_FILE, TRAJECTORY_SCHEMA),
        )
        if forecasts is not None:
            tables[BUNDLE_FORECASTS_FILE] = (
                BundleForecastTable(bundles),
                TableWriter(folder / BUNDLE_FORECASTS_FILE, FORECAST_SCHEMA),
            )
    if job.forecasts_every_s is not None:
        tables[FORECASTS_FILE] = (
            ForecastTable(job.sensors, job.settings, plane, job.forecasts_every_s),
            TableWriter(folder / FORECASTS_FILE, FORECAST_SCHEMA),
        )
    return tables


def _check(result: OfflineResult, late: int) -> None:
    accounted = result.accepted + result.rejected_total + result.duplicate
    if result.read != accounted or late or sum(result.tracker.values()) != result.accepted:
        msg = (
            "expected read = accepted + rejected + duplicate and an outcome for each accepted, was "
            f"{result.read} = {result.accepted} + {result.rejected_total} + {result.duplicate}, "
            f"{sum(result.tracker.values())} outcomes and {late} late"
        )
        raise AccountingError(msg)
