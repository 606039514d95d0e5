"""Tracking of a recording from disk to tables on disk: the same processing as live, no service.

Memory is bounded: the recording is read in blocks, outputs are spooled. The output depends on the
recording, the sensors and the settings, not on batch sizes or workers.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.clock import SystemClock
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.errors import AccountingError
from multiradar.runtime.admission.admission_by_time import ACCEPTED, Admission
from multiradar.runtime.admission.arrivals import ArrivalBoard
from multiradar.runtime.admission.origins import Origins
from multiradar.runtime.admission.reject_file import RejectFile, TimeRejects
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.runtime.offline.beside_tracking import BesideTracking
from multiradar.runtime.offline.epoch_tables import requested_tables
from multiradar.runtime.offline.offline_job import (
    BIAS_CORRELATIONS_FILE,
    BIASES_FILE,
    HEALTH_FILE,
    REJECTS_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
    OfflineJob,
    OfflineResult,
)
from multiradar.runtime.offline.stage_times import READING, TRACKING, WRITING, StageTimes
from multiradar.storage.recording import INDEX_COLUMN
from multiradar.storage.table_writer import TableWriter
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.lifecycle.transitions import TrackTransitions
from multiradar.tracking.outputs import BiasRecords, EngineOutput, TrackUpdates
from multiradar_schemas.products.bias import BIAS_CORRELATION_SCHEMA, BIAS_SCHEMA
from multiradar_schemas.products.health import HEALTH_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA


def track_recording(
    job: OfflineJob,
    folder: Path,
    on_progress: Callable[[int], None] = lambda _rows: None,
    on_output: Callable[[EngineOutput], None] | None = None,
    stages: StageTimes | None = None,
    *,
    refine: Callable[[EngineOutput], EngineOutput] | None = None,
) -> OfflineResult:
    """Track a recording and write tracks, biases and rejects.

    Parameters
    ----------
    job : OfflineJob
        Input and settings.
    folder : Path
        Existing, empty folder for `tracks.parquet`, `transitions.parquet`, `biases.parquet`,
        `bias_correlations.parquet`, `health.parquet` and `rejects.ndjson`.
    on_progress : callable
        Called with the number of processed measurements, after every batch.
    on_output : callable, optional
        Called with all output of the engine.
    stages : StageTimes, optional
        Measures the time of each stage.
    refine : callable, optional
        Replaces the output of the engine by another, such as with other states of tracks.

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
    # Encounters are calibrated with forecasts of a few tracks, as in the service.
    sampling = Sampling.DRAWN if pictures else Sampling.NONE
    if job.forecasts_every_s is not None:
        sampling = Sampling.ALL
    engine = Engine(
        job.sensors, job.settings, job.workers, open_steps=job.open_steps, pictures=pictures,
        sampling=sampling,
    )  # fmt: skip
    if job.start is not None:
        engine.start_from(job.start)
    stages = stages or StageTimes(SystemClock())
    run: _Run | None = None
    try:
        run = _Run(job, folder, engine, on_output, stages)
        run.refine = refine
        done = 0
        for block in stages.each(READING, job.recording.blocks(job.kinds)):
            for rows in run.process(block):
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
        self.refine: Callable[[EngineOutput], EngineOutput] | None = None
        self._stages = stages
        self._sensors = job.sensors
        self._batch_rows = job.batch_rows
        self._engine = engine
        horizon_s = job.settings.reorder_horizon_s
        self._arrivals = ArrivalBoard(job.sensors, horizon_s)
        self._admission = Admission.for_sensors(job.sensors, horizon_s, arrivals=self._arrivals)
        self._digest = OutputDigest()
        self._tally = TrackTally()
        self._tracks = TableWriter(folder / TRACKS_FILE, TRACK_SCHEMA)
        self._biases = TableWriter(folder / BIASES_FILE, BIAS_SCHEMA)
        # Standard deviations of the biases in the last rows of their table, m, rad, 1 or s.
        self._sigma = np.empty(0)
        self._correlations = TableWriter(folder / BIAS_CORRELATIONS_FILE, BIAS_CORRELATION_SCHEMA)
        self._health = TableWriter(folder / HEALTH_FILE, HEALTH_SCHEMA)
        self._transitions = TableWriter(folder / TRANSITIONS_FILE, TRANSITION_SCHEMA)
        self._windows = requested_tables(job, folder, engine.plane)
        self._rejects = RejectFile(folder / REJECTS_FILE, job.recording.path.name)
        lines = job.recording.rejected_lines
        if lines is not None:
            self._rejects.write_lines(lines.lines(job.kinds))
        self._origins = Origins()
        self._evidence = Evidence(job.sensors, job.kinds)
        self._result = OfflineResult()
        self._result.rejected = job.recording.rejected_by_code(job.kinds)
        self._result.read = self._result.rejected_total
        self._writing = BesideTracking(stages)

    # Processes one block; yields the number of rows done after each batch.
    def process(self, block: pl.DataFrame) -> Iterator[int]:
        with self._stages.measure(READING):
            measured, rejected = wire.measurement_batch(block.drop(INDEX_COLUMN), self._sensors)
        clock_s = np.empty(len(measured))
        codes = np.zeros(len(measured), np.int8)
        at = np.delete(block[INDEX_COLUMN].cast(pl.Int64).to_numpy(), rejected.index)
        outputs = []
        for start in range(0, len(measured), self._batch_rows):
            rows = slice(start, start + self._batch_rows)
            with self._stages.measure(TRACKING):
                batch = measured.select(rows)
                codes[rows] = self._admission.admit(batch)
                clock_s[rows] = self._admission.clock_s
                accepted = codes[rows] == ACCEPTED
                self._origins.add(0, int(np.count_nonzero(accepted)), at[rows][accepted])
                kept = batch if accepted.all() else batch.select(accepted)
                outputs.append(
                    self._refined(self._engine.push(kept, self._admission.released_to_s))
                )
            yield min(rows.stop, len(block))
        self._result.read += len(block)
        self._result.accepted += int(np.count_nonzero(codes == ACCEPTED))
        times = TimeRejects(self._admission, clock_s, measured, codes)
        repeated = self._duplicates(outputs)

        def write() -> None:
            self._evidence.record_batch(block, rejected, measured, codes)
            self._write(outputs)
            self._result.rejected += self._rejects.write(block, rejected, times)
            self._write_duplicates(*repeated)

        self._writing.put(write)

    def finish(self) -> OfflineResult:
        with self._stages.measure(TRACKING):
            last = self._refined(self._engine.flush())
        self._writing.finish()
        with self._stages.measure(WRITING):
            self._write([last])
            self._write_duplicates(*self._duplicates([last]))
            self._rejects.finish()
            self._write_correlations()
            written = (
                self._tracks, self._biases, self._correlations, self._health, self._transitions,
            )  # fmt: skip
            for one in written:
                one.finish()
        for file, (table, writer, add_figures) in self._windows.items():
            with self._stages.measure(_stage_of(file)):
                self._keep_windows(file, writer, table.finish())
                writer.finish()
            add_figures(self._result)
        self.close()
        result = self._result
        outcomes = self._engine.counts
        result.duplicate = outcomes.pop("DUPLICATE")
        result.accepted -= result.duplicate
        # The admission has rejected late measurements, so the tracker finds none.
        late = outcomes.pop("LATE")
        result.tracker = {name.lower(): count for name, count in outcomes.items()}
        _check(result, late)
        result.tracks, result.tracks_confirmed = self._tally.initiated, self._tally.confirmed
        result.transitions = self._tally.transitions
        result.arrivals = self._arrivals.records()
        result.warnings += self._arrivals.warnings()
        result.unobservable_biases = self._engine.unobservable_biases()
        result.output_sha256 = self._digest.hexdigest()
        result.diagnoses = diagnose(self._evidence)
        return result

    def close(self) -> None:
        self._writing.close()
        self._rejects.close()

    def _refined(self, output: EngineOutput) -> EngineOutput:
        return output if self.refine is None else self.refine(output)

    def _write(self, outputs: Sequence[EngineOutput]) -> None:
        for output in outputs:
            self._digest.add(output)
            self._tally.update(output)
            self._evidence.record_output(output)
            for file, (table, writer, _) in self._windows.items():
                with self._writing.times.measure(_stage_of(file)):
                    self._keep_windows(file, writer, table.update(output))
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
            self._sigma = biases.sigma[-len(self._sensors.parameter_kind) :]
            self._keep_last(frame)
        health = HealthRecords.concatenate([output.health for output in outputs])
        if len(health):
            self._keep_health(wire.health_frame(health, self._sensors))

    def _write_correlations(self) -> None:
        if not len(self._sigma):
            return
        covariance = self._engine.biases.covariance
        frame = wire.bias_correlations_frame(covariance, self._sigma, self._sensors)
        self._correlations.append(frame)
        self._result.correlation_rows = len(frame)

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

    # Duplicate measurements, and the row of each in the recording.
    def _duplicates(self, outputs: Sequence[EngineOutput]) -> tuple[Duplicates, list[int]]:
        found = Duplicates.concatenate([output.duplicates for output in outputs])
        indices = [row for _, row in self._origins.find(found.arrival.tolist())]
        self._origins.discard(self._engine.waiting_from)
        return found, indices

    def _write_duplicates(self, found: Duplicates, indices: Sequence[int]) -> None:
        self._rejects.write_duplicates(found, indices, self._sensors)
        named = (self._sensors.ids[sensor] for sensor in found.batch.sensor.tolist())
        self._result.duplicates_by_sensor.update(named)

    def _keep_last(self, frame: pl.DataFrame) -> None:
        last = frame.unique(["sensor_id", "parameter"], keep="last", maintain_order=True)
        for row in last.iter_rows(named=True):
            of_sensor = self._result.final_biases.setdefault(row["sensor_id"], {})
            of_sensor[row["parameter"]] = {
                name: row[name] for name in ("estimate", "sigma", "prior_ratio")
            }


def _stage_of(file: str) -> str:
    return Path(file).stem.replace("_", " ")


def _check(result: OfflineResult, late: int) -> None:
    accounted = result.accepted + result.rejected_total + result.duplicate
    if result.read != accounted or late or sum(result.tracker.values()) != result.accepted:
        msg = (
            "expected read = accepted + rejected + duplicate, and one outcome per accepted "
            "measurement; found "
            f"{result.read} = {result.accepted} + {result.rejected_total} + {result.duplicate}, "
            f"{sum(result.tracker.values())} outcomes and {late} late"
        )
        raise AccountingError(msg)
