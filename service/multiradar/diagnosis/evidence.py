"""What is retained of a run for its diagnosis: counts of every source, and its first plots.

The plots are as they came, before any check, so that those that were rejected are among them. The
memory is bounded: so many plots of a source, so many sources.
"""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, EngineOutput
from multiradar.tracking.plots import TrackPlots
from multiradar.wire import Rejected
from multiradar_schemas.arrow import MEASUREMENT_SCHEMA

#: Plots that are retained of a source, and of tracks; sources that are told apart.
ROWS_MAX = 20_000
TRACKED_MAX = 100_000
SOURCES_MAX = 256

#: Columns that a diagnosis looks at.
COLUMNS = (
    "time_s", "kind", "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m",
    "mode_3a", "mode_s_address", "track_number",
)  # fmt: skip
#: Reject codes by the codes of `runtime.admission`: accepted, late, future.
ADMISSION_CODES = ("", "TIME_LATE", "TIME_FUTURE")
_SCHEMA = {name: MEASUREMENT_SCHEMA[name] for name in COLUMNS}


@dataclass(slots=True)
class Source:
    """What came under one name.

    Attributes
    ----------
    read : int
        Measurements.
    first_s, last_s : float
        Least and greatest time of them, s; NaN without any.
    rejected : Counter
        Those that were rejected, by code.
    kept : list of DataFrame
        The first of them.
    """

    read: int = 0
    first_s: float = np.nan
    last_s: float = np.nan
    rejected: Counter[str] = field(default_factory=Counter)
    kept: list[pl.DataFrame] = field(default_factory=list)

    def add(self, part: pl.DataFrame) -> None:
        """Take measurements; columns `COLUMNS`."""
        times = part.filter(pl.col("time_s").is_finite())["time_s"].to_numpy()
        self.read += len(part)
        if len(times):
            self.first_s = float(np.fmin(self.first_s, times.min()))
            self.last_s = float(np.fmax(self.last_s, times.max()))
        room = ROWS_MAX - sum(len(one) for one in self.kept)
        if room > 0:
            self.kept.append(part.head(room))

    def plots(self) -> pl.DataFrame:
        """Return the plots that are retained, by time; columns `COLUMNS`."""
        found = pl.concat(self.kept) if self.kept else pl.DataFrame(schema=_SCHEMA)
        return found.filter(pl.col("time_s").is_finite()).sort("time_s", maintain_order=True)


class Evidence:
    """Counts and retains what a diagnosis needs; one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors that are configured.
    kinds : collection of str, optional
        Kinds of measurement that are used; all when absent.
    """

    def __init__(self, sensors: SensorTable, kinds: Collection[str] | None = None) -> None:
        self.sensors = sensors
        self.kinds = kinds
        #: By identifier of a sensor, or by the name of a source that is not configured.
        self.sources: dict[str, Source] = {}
        #: Measurements that were duplicates, by sensor.
        self.duplicates: Counter[str] = Counter()
        #: (sensors, outcomes): what became of the accepted measurements in the filter.
        self.outcomes = np.zeros((len(sensors), 0), np.int64)
        #: Whether a track was confirmed, and how many updates there were.
        self.confirmed = False
        self.updates = 0
        #: Sensor and measured noise over configured noise of range and of azimuth, at the end.
        self.noise: dict[str, tuple[float, float]] = {}
        self._names = {name: sensors.ids[row] for name, row in sensors.aliases}
        self._tracked: list[TrackPlots] = []
        self._tracked_rows = 0

    def take(
        self,
        frame: pl.DataFrame,
        refused: Rejected,
        measured: MeasurementBatch,
        codes: NDArray[np.int8],
    ) -> None:
        """Take measurements as they came, and what was rejected of them.

        Parameters
        ----------
        frame : DataFrame
            Columns of `MEASUREMENT_SCHEMA`, optional ones may be missing.
        refused, measured : Rejected, MeasurementBatch
            What `wire.measurement_batch` makes of it.
        codes : (n,) int8
            What the admission says of each of `measured`: 0 accepted, else an index of
            `ADMISSION_CODES`.
        """
        self.read(frame)
        for name, code in zip(
            frame["sensor_id"][refused.index].to_list(), refused.code, strict=True
        ):
            self.reject(name or "", str(code), 1)
        for number_of_code, text in enumerate(ADMISSION_CODES):
            if text:
                at_it = measured.sensor[codes == number_of_code]
                late = np.bincount(at_it, minlength=len(self.sensors))
                for number in np.flatnonzero(late).tolist():
                    self.reject(self.sensors.ids[number], text, int(late[number]))

    def reject(self, name: str, code: str, count: int = 1) -> None:
        """Count measurements that were rejected: their source and the code."""
        source = self._source(name)
        if source is not None:
            source.rejected[code] += count

    def read(self, frame: pl.DataFrame) -> None:
        """Take measurements as they came, of which `take` says what was rejected."""
        named = frame.select(
            *(
                pl.col(name).cast(kind) if name in frame.columns else pl.lit(None, kind).alias(name)
                for name, kind in _SCHEMA.items()
            ),
            pl.col("sensor_id").fill_null(""),
        )
        for (name,), part in named.partition_by("sensor_id", as_dict=True).items():
            source = self._source(str(name))
            if source is None:
                continue
            source.add(part.drop("sensor_id"))

    def hear(self, output: EngineOutput) -> None:
        """Take what came out of the engine."""
        if len(output.outcomes):
            outcomes = output.outcomes.copy()
            if self.outcomes.shape == outcomes.shape:
                outcomes += self.outcomes
            self.outcomes = outcomes
        self.updates += len(output.updates)
        self.confirmed |= bool((output.updates.state == STATE_CONFIRMED).any())
        if len(output.plots) and self._tracked_rows < TRACKED_MAX:
            self._tracked.append(output.plots)
            self._tracked_rows += len(output.plots)
        for sensor, ranges, azimuths in zip(
            output.health.sensor.tolist(),
            output.health.range_sigma_ratio.tolist(),
            output.health.azimuth_sigma_ratio.tolist(),
            strict=True,
        ):
            self.noise[self.sensors.ids[sensor]] = (ranges, azimuths)
        found = output.duplicates.batch.sensor.tolist()
        self.duplicates.update(self.sensors.ids[sensor] for sensor in found)

    def tracked(self) -> TrackPlots:
        """Return the first plots that updated tracks."""
        return TrackPlots.concatenate(self._tracked)

    def number(self, name: str) -> int:
        """Return the row of a sensor in the table, −1 for a source that is not configured."""
        return self.sensors.ids.index(name) if name in self.sensors.ids else -1

    def outcomes_of(self, name: str) -> NDArray[np.int64]:
        """Return what became of the accepted measurements of a sensor, by outcome."""
        number = self.number(name)
        return self.outcomes[number] if number >= 0 else np.zeros(self.outcomes.shape[1], np.int64)

    def _source(self, name: str) -> Source | None:
        name = self._names.get(name, name)
        if name not in self.sources:
            if len(self.sources) >= SOURCES_MAX:
                return None
            self.sources[name] = Source()
        return self.sources[name]
