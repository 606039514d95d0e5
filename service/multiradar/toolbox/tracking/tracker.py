"""A tracker to push measurements into, as they arrive."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.errors import DataWarning
from multiradar.runtime.admission.admission_by_time import ACCEPTED, Admission
from multiradar.runtime.admission.reject_file import TimeRejects
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.kernel_purposes import track_purposes
from multiradar.storage.recording import check_columns
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.compiling import compile_kernels
from multiradar.toolbox.frames import to_polars
from multiradar.toolbox.inputs import as_sensors_file, load_sensor_table
from multiradar.toolbox.messages.warning import warn
from multiradar.toolbox.output import PathLike
from multiradar.toolbox.settings import checked_fields, settings_of
from multiradar.toolbox.tracking.custom_filters import host_of
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.measurements.columns import MEASUREMENT_LATER, MEASUREMENT_SCHEMA

if TYPE_CHECKING:
    from multiradar.toolbox.frames import Frame
    from multiradar_schemas.sensors.sensor import SensorsFile

_REJECT_SCHEMA = {"index": pl.Int64, "code": pl.String, "reason": pl.String}


@dataclass(frozen=True, slots=True, eq=False)
class Updates:
    """What a call of `Tracker.push` or `Tracker.flush` produced.

    Attributes
    ----------
    tracks : DataFrame
        Updates of tracks, as in `tracks.parquet`: of measurements that left the reordering window.
    biases : DataFrame
        Biases of epochs that ended, as in `biases.parquet`.
    transitions : DataFrame
        Tracks started, confirmed and ended, as in `transitions.parquet`.
    rejected : DataFrame
        `index` of the row pushed, `code` and `reason` of rejected measurements.
    """

    tracks: pl.DataFrame
    biases: pl.DataFrame
    transitions: pl.DataFrame
    rejected: pl.DataFrame


class Tracker:
    """Estimates tracks and biases from measurements in the order of their arrival.

    Parameters
    ----------
    sensors : path or SensorsFile
        A `sensors.toml`, or what `load_sensors` returns.
    filter : str, optional
        As for `track`.
    hide : collection of str, optional
        As for `track`.
    epoch_s, reorder_horizon_s : float, optional
        Bias update interval, and reordering window, s of data time.
    workers : int
        Threads; the output does not depend on it.
    config : path, optional
        Settings in TOML.

    Raises
    ------
    ConfigurationError
        The sensors or a setting cannot be used.

    Notes
    -----
    The output depends on the sequence of the measurements alone, not on how they are divided among
    calls; it is that of `track`. Close it, or use it as a context manager.

    References
    ----------
    IMM UrO RAN report (2016), sections 1.3 to 1.5.
    """

    @typed
    def __init__(
        self,
        sensors: "PathLike | SensorsFile",
        *,
        filter: str | None = None,
        hide: Collection[str] | None = None,
        epoch_s: float | None = None,
        reorder_horizon_s: float | None = None,
        workers: int = 1,
        config: PathLike | None = None,
    ) -> None:
        host, custom = host_of(filter)
        given = {
            "filter_name": host,
            "hidden_fields": checked_fields(hide),
            "epoch_s": epoch_s,
            "reorder_horizon_s": reorder_horizon_s,
        }
        settings = settings_of(config, given).tracking_settings()
        with as_sensors_file(sensors) as (path, name):
            self._table = load_sensor_table(path, name=name)
        compile_kernels(track_purposes(settings, self._table, {}))
        self._engine = Engine(self._table, settings, workers)
        self._admission = Admission(settings.reorder_horizon_s, len(self._table))
        self._refine = None if custom is None else custom.start(self._table, settings)
        self._read = self._rejected = 0
        self._evidence = Evidence(self._table)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def counts(self) -> dict[str, int]:
        """Measurements so far: read, rejected, duplicate, and waiting or accepted."""
        duplicate = self._engine.counts["DUPLICATE"]
        return {
            "read": self._read,
            "accepted": self._read - self._rejected - duplicate,
            "rejected": self._rejected,
            "duplicate": duplicate,
        }

    def push(self, measurements: "Frame") -> Updates:
        """Process the next measurements.

        Parameters
        ----------
        measurements : table
            Columns of `measurements.parquet` (docs/reference/fields.md); optional ones may
            be missing.

        Returns
        -------
        Updates
            Of the measurements that left the reordering window.

        Raises
        ------
        InputError
            It is not a table, lacks a column (`MissingColumnError`), or a column has another type.

        Warns
        -----
        DataWarning
            All measurements were rejected.
        """
        frame = _checked(to_polars(measurements, "measurements"))
        measured, rejected = wire.measurement_batch(frame, self._table)
        at = np.delete(np.arange(len(frame)), rejected.index)
        codes = self._admission.admit(measured)
        times = TimeRejects(self._admission, self._admission.clock_s, measured, codes)
        self._evidence.record_batch(frame, rejected, measured, codes)
        accepted = codes == ACCEPTED
        rows = [*zip(rejected.index.tolist(), rejected.code, rejected.reason, strict=True)]
        rows += [(int(at[row]), code, reason) for row, code, reason in times.rejections]
        self._read += len(frame)
        self._rejected += len(rows)
        if rows and len(rows) == len(frame):
            _warn_of_rejects(rows)
        kept = measured if accepted.all() else measured.select(accepted)
        output = self._engine.push(kept, self._admission.released_to_s)
        return self._updates(output, sorted((i, str(code), why) for i, code, why in rows))

    def flush(self) -> Updates:
        """End the stream: process the measurements in the reordering window and end the epoch.

        Returns
        -------
        Updates
            The last ones; later measurements may follow.

        Warns
        -----
        DataWarning
            What is probably wrong with a sensor, its measurements or its description, as for
            `track`; of the measurements since the last call.
        """
        updates = self._updates(self._engine.flush(), [])
        evidence, self._evidence = self._evidence, Evidence(self._table)
        for one in diagnose(evidence) if evidence.sources else ():
            warn(one.sentence, DataWarning)
        return updates

    def close(self) -> None:
        """Stop the threads."""
        self._engine.close()

    def _updates(self, output: EngineOutput, rejected: list[tuple[int, str, str]]) -> Updates:
        self._evidence.record_output(output)
        if self._refine is not None:
            output = self._refine(output)
        return Updates(
            tracks=wire.tracks_frame(output.updates, self._table),
            biases=wire.biases_frame(output.biases, self._table),
            transitions=wire.transitions_frame(output.transitions),
            rejected=pl.DataFrame(rejected, schema=_REJECT_SCHEMA, orient="row"),
        )


def _warn_of_rejects(rows: Sequence[tuple[int, str, str]]) -> None:
    codes = Counter(str(code) for _, code, _ in rows)
    counts = ", ".join(f"{count} {code}" for code, count in codes.most_common())
    _, _, first = min(rows)
    warn(f"all {len(rows)} measurements were rejected ({counts}; the first: {first})", DataWarning)


def _checked(frame: pl.DataFrame) -> pl.DataFrame:
    check_columns("measurements", frame.schema)
    missing = [name for name in MEASUREMENT_LATER if name not in frame.columns]
    return frame.select(
        pl.lit(None, kind).alias(name) if name in missing else pl.col(name).cast(kind)
        for name, kind in MEASUREMENT_SCHEMA.items()
    )
