"""What is retained of a run for its diagnosis: counts of every source, and its first plots.

The plots are retained as received, before any check; rejected ones are among them. Memory is
bounded by a number of plots per source and a number of sources.
"""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.health.health_records import ALARM_SITE, HealthRecords
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import STATE_CONFIRMED, EngineOutput, TrackPlots
from multiradar.wire import Rejected
from multiradar_converters.normalised.checks import numbered
from multiradar_converters.normalised.exported import exported
from multiradar_schemas.documents.names import shown
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA, POSITION_SIGMA
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

#: Plots that are retained of a source, and of tracks; sources beside the configured sensors.
ROWS_MAX = 20_000
TRACKED_MAX = 100_000
SOURCES_MAX = 256

#: Times without measurements of a source that are retained, s, and their number.
GAP_MIN_S, GAPS_MAX = 60.0, 32
#: Time before them in which measurements are counted, s, and up to how many of a source.
BEFORE_S, BEFORE_MAX = 60.0, 600

#: Columns that a diagnosis uses.
COLUMNS = (
    "time_s", "kind", "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m",
    "mode_3a", "mode_s_address", "track_number",
)  # fmt: skip
#: Rows and parts that are sorted by source together: the cost depends little on their number.
GATHERED_MAX, PARTS_MAX = 20_000, 500
#: Reports that are retained of a source whose reports are thinned, and the greatest interval of the
#: retained reports of an aircraft, s: half of that over which they are interpolated.
SPREAD_ROWS_MAX, SPREAD_EVERY_MAX = 100_000, 16
#: Reject codes by the codes of `runtime.admission`: accepted, late, future, excess.
ADMISSION_CODES = ("", "TIME_LATE", "TIME_FUTURE", "RATE_EXCEEDED")
_SCHEMA = {name: MEASUREMENT_SCHEMA[name] for name in COLUMNS}
_NAMES = ("mode_3a", "mode_s_address", "track_number")
_RECORDED = ("sensor_id", *COLUMNS)
_RECORDED_SCHEMA = pl.Schema({"sensor_id": pl.String(), **_SCHEMA})


@dataclass(slots=True)
class Source:
    """Measurements received under one sensor name.

    Attributes
    ----------
    read : int
        Number of measurements.
    first_s, last_s : float
        Earliest and latest time, s; NaN without any.
    named_s : (float, float)
        Earliest and latest time of those that name their aircraft, s; NaN without any.
    rejected : Counter
        Rejected measurements by code.
    kept : list of DataFrame
        The first measurements.
    gap_s, gap_from_s : float
        Longest time between successive measurements, and when it starts, s.
    gaps : dict
        The longest of these times, of `GAP_MIN_S` or more, by their start, s.
    before : dict
        Number of measurements in `BEFORE_S` before each of `gaps`, at most `BEFORE_MAX`.
    reasons : dict
        Sentence of the first rejected measurement by code.
    spread : bool
        Whether frequent measurements are thinned, so that those retained span the time; else the
        first are retained.
    """

    read: int = 0
    first_s: float = np.nan
    last_s: float = np.nan
    named_s: tuple[float, float] = (np.nan, np.nan)
    rejected: Counter[str] = field(default_factory=Counter)
    kept: list[pl.DataFrame] = field(default_factory=list)
    gap_s: float = 0.0
    gap_from_s: float = np.nan
    gaps: dict[float, float] = field(default_factory=dict)
    before: dict[float, int] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    spread: bool = False
    _every: int = 1
    # The last times, in order.
    _latest_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def add(self, part: pl.DataFrame) -> None:
        """Add measurements; columns `COLUMNS`."""
        times = part["time_s"].to_numpy()
        finite = np.isfinite(times)
        self.count(len(part), np.sort(times[finite]), times[finite & _are_named(part)])
        self.keep(part)

    def count(
        self, read: int, ordered_s: NDArray[np.float64], named_s: NDArray[np.float64]
    ) -> None:
        """Count measurements: their number, finite times in order, and those of named aircraft."""
        self.read += read
        if len(ordered_s):
            self._add_gap(ordered_s)
            self.first_s = float(np.fmin(self.first_s, ordered_s[0]))
            self.last_s = float(np.fmax(self.last_s, ordered_s[-1]))
        if len(named_s):
            first, last = self.named_s
            self.named_s = float(np.fmin(first, named_s.min())), float(np.fmax(last, named_s.max()))

    @property
    def free(self) -> int | None:
        """How many further measurements it retains; None for any number."""
        return None if self.spread else ROWS_MAX - sum(map(len, self.kept))

    def keep(self, part: pl.DataFrame) -> None:
        """Retain measurements; columns `COLUMNS`."""
        free = self.free
        if free is None:
            self._add_spread(part)
        elif free > 0:
            self.kept.append(part if len(part) <= free else part.head(free))

    # Of frequent reports, those of one second in `_every`, another second for each aircraft: all
    # aircraft stay, at intervals over which other sensors are compared with them.
    def _add_spread(self, part: pl.DataFrame) -> None:
        self.kept.append(part.filter(_is_due(self._every)))
        while self._every < SPREAD_EVERY_MAX and sum(map(len, self.kept)) > SPREAD_ROWS_MAX:
            self._every *= 2
            self.kept = [one.filter(_is_due(self._every)) for one in self.kept]
        free = SPREAD_ROWS_MAX - sum(map(len, self.kept[:-1]))
        self.kept[-1] = self.kept[-1].head(max(free, 0))

    # Measurements out of order between two parts are no gap.
    def _add_gap(self, ordered: NDArray[np.float64]) -> None:
        known = len(self._latest_s)
        if known:
            ordered = np.concatenate([self._latest_s, ordered[ordered > self.last_s]])
        self._latest_s = ordered[-BEFORE_MAX:].copy()
        gaps = np.diff(ordered)
        gaps[: max(known - 1, 0)] = 0.0
        if len(gaps) and gaps.max() > self.gap_s:
            self.gap_s, self.gap_from_s = float(gaps.max()), float(ordered[gaps.argmax()])
        for row in np.flatnonzero(gaps >= GAP_MIN_S).tolist():
            self.gaps[float(ordered[row])] = float(gaps[row])
            self.before[float(ordered[row])] = count_before(ordered, row)
        if len(self.gaps) > GAPS_MAX:
            longest = sorted(self.gaps, key=lambda one: -self.gaps[one])[:GAPS_MAX]
            self.gaps = {one: self.gaps[one] for one in longest}
            self.before = {one: self.before[one] for one in longest}

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
    sources : dict of Source, optional
        What has been received.
    spreads_positions : bool
        Whether frequent reports of positions are thinned: for windows of time.
    proceed : callable, optional
        Called between pieces of the diagnosis; what it raises ends the diagnosis.
    """

    def __init__(
        self,
        sensors: SensorTable,
        kinds: Collection[str] | None = None,
        sources: dict[str, Source] | None = None,
        *,
        spreads_positions: bool = False,
        proceed: Callable[[], None] = lambda: None,
    ) -> None:
        self.sensors = sensors
        #: To be called before each sensor, or pair of sensors, by what compares them.
        self.proceed = proceed
        self._spreads_positions = spreads_positions
        self.kinds = kinds
        self._sources: dict[str, Source] = {} if sources is None else sources
        self._gathered: list[pl.DataFrame] = []
        self._gathered_rows = 0
        #: Measurements that were duplicates, by sensor.
        self.duplicates: Counter[str] = Counter()
        #: Measurements under another name of a sensor, such as that in a second network.
        self.renamed: Counter[str] = Counter()
        #: (sensors, outcomes): outcome of the accepted measurements in the filter.
        self.outcomes = np.zeros((len(sensors), 0), np.int64)
        #: Whether a track was confirmed, and how many updates there were.
        self.confirmed = False
        self.updates = 0
        #: Sensor and measured noise over configured noise of range and of azimuth, at the end.
        self.noise: dict[str, tuple[float, float]] = {}
        #: Sensors whose innovations have the pattern of a displaced site, at the end, with the
        #: least distance, m; 0 for the others.
        self.displaced: dict[str, float] = {}
        #: Last estimate of each bias and its standard deviation, by sensor and parameter.
        self.biases: dict[tuple[int, int], tuple[float, float]] = {}
        #: Sensors whose reports contain the accuracy of their positions.
        self.with_accuracy: set[str] = set()
        self._names = {name: sensors.ids[row] for name, row in sensors.aliases}
        self._listed = tuple(dict.fromkeys((*sensors.ids, *self._names)))
        self._numbered = numbered(self._listed)
        self._tracked: list[TrackPlots] = []
        self._tracked_rows = 0

    @property
    def sources(self) -> dict[str, Source]:
        """By identifier of a sensor, or by the name of a source that is not configured."""
        self._sort_gathered()
        return self._sources

    def record_batch(
        self,
        frame: pl.DataFrame,
        rejected: Rejected,
        measured: MeasurementBatch,
        codes: NDArray[np.int8],
    ) -> None:
        """Record measurements as received, and which of them were rejected.

        Parameters
        ----------
        frame : DataFrame
            Columns of `MEASUREMENT_SCHEMA`, optional ones may be missing.
        rejected, measured : Rejected, MeasurementBatch
            The result of `wire.measurement_batch`.
        codes : (n,) int8
            Result of the admission for each of `measured`: 0 accepted, else an index of
            `ADMISSION_CODES`.
        """
        self.record_rows(frame)
        for name, code, reason in zip(
            frame["sensor_id"][rejected.index].to_list(),
            rejected.code,
            rejected.reason,
            strict=True,
        ):
            self.reject(name or "", str(code), 1)
            source = self._source(name or "")
            if source is not None:
                source.reasons.setdefault(str(code), reason)
        for number_of_code, text in enumerate(ADMISSION_CODES):
            if text:
                at_it = measured.sensor[codes == number_of_code]
                late = np.bincount(at_it, minlength=len(self.sensors))
                for number in np.flatnonzero(late).tolist():
                    self.reject(self.sensors.ids[number], text, int(late[number]))

    def reject(self, name: str, code: str, count: int = 1) -> None:
        """Count rejected measurements of a source by code."""
        source = self._source(name)
        if source is not None:
            source.rejected[code] += count

    def record_rows(self, frame: pl.DataFrame) -> None:
        """Record measurements as received; rejects are counted by `reject`."""
        if len(frame):
            self._gathered.append(frame[:, [one for one in _RECORDED if one in frame.columns]])
            self._gathered_rows += len(frame)
            if POSITION_SIGMA in frame.columns and frame[POSITION_SIGMA].count():
                known = frame.filter(pl.col(POSITION_SIGMA).is_not_null())["sensor_id"]
                names = known.drop_nulls().unique().to_list()
                self.with_accuracy.update(self._names.get(one, one) for one in names)
        if self._gathered_rows >= GATHERED_MAX or len(self._gathered) >= PARTS_MAX:
            self._sort_gathered()

    def record_output(self, output: EngineOutput) -> None:
        """Record an output of the engine."""
        if len(output.outcomes):
            outcomes = output.outcomes.copy()
            if self.outcomes.shape == outcomes.shape:
                outcomes += self.outcomes
            self.outcomes = outcomes
        self.updates += len(output.updates)
        self.confirmed |= bool((output.updates.state == STATE_CONFIRMED).any())
        self.record_plots(output.plots)
        self.record_health(output.health)
        biases = output.biases
        columns = (biases.sensor, biases.parameter, biases.estimate, biases.sigma)
        for sensor, parameter, estimate, sigma in zip(
            *(one.tolist() for one in columns), strict=True
        ):
            self.biases[sensor, parameter] = estimate, sigma
        found = output.duplicates.batch.sensor.tolist()
        self.duplicates.update(self.sensors.ids[sensor] for sensor in found)

    def record_health(self, health: HealthRecords) -> None:
        """Record the health of radars; the last of each counts."""
        columns = (
            health.sensor,
            health.range_sigma_ratio,
            health.azimuth_sigma_ratio,
            np.where((health.alarms >> ALARM_SITE) & 1,
                     np.hypot(health.site_east_m, health.site_north_m), 0.0),
        )  # fmt: skip
        for sensor, ranges, azimuths, apart_m in zip(
            *(one.tolist() for one in columns), strict=True
        ):
            name = self.sensors.ids[sensor]
            self.noise[name] = (ranges, azimuths)
            self.displaced[name] = apart_m

    def record_plots(self, plots: TrackPlots) -> None:
        """Record plots that updated tracks, up to a limit."""
        if len(plots) and self._tracked_rows < TRACKED_MAX:
            self._tracked.append(plots)
            self._tracked_rows += len(plots)

    def tracked(self) -> TrackPlots:
        """Return the first plots that updated tracks."""
        return TrackPlots.concatenate(self._tracked)

    def number(self, name: str) -> int:
        """Return the row of a sensor in the table, −1 for a source that is not configured."""
        return self.sensors.ids.index(name) if name in self.sensors.ids else -1

    def outcomes_of(self, name: str) -> NDArray[np.int64]:
        """Return the number of accepted measurements of a sensor by outcome."""
        number = self.number(name)
        return self.outcomes[number] if number >= 0 else np.zeros(self.outcomes.shape[1], np.int64)

    def _sort_gathered(self) -> None:
        if not self._gathered:
            return
        frame = pl.concat(self._gathered, how="diagonal")
        self._gathered, self._gathered_rows = [], 0
        named = frame if frame.schema == _RECORDED_SCHEMA else _completed(frame)
        codes = self._codes(named["sensor_id"])
        if codes is not None:
            self._sort_by_codes(named, codes)
            return
        filled = named.with_columns(pl.col("sensor_id").fill_null(""))
        parts = filled.partition_by("sensor_id", as_dict=True, include_key=False)
        for (name,), part in parts.items():
            source = self._source(str(name))
            if source is not None:
                source.add(part)
                self._count_renamed(str(name), len(part))

    # Number of each name, in the order of `_listed`; None if there are others.
    def _codes(self, names: pl.Series) -> NDArray[np.int16] | None:
        if not self._numbered.are_short or len(self._listed) > np.iinfo(np.int16).max:
            return None
        if names.null_count():
            return None
        odd = np.zeros(len(names), np.bool_)
        with exported(names.to_frame(), [names.name]) as columns:
            codes = self._numbered.find(columns[names.name], odd)
        # Radix sort needs 16 bits.
        return None if odd.any() else codes.astype(np.int16)

    # Partitions of tables cost more than all that is counted, and most are not retained.
    def _sort_by_codes(self, named: pl.DataFrame, codes: NDArray[np.int16]) -> None:
        plots, times = named[list(COLUMNS)], named["time_s"].to_numpy()
        finite = np.isfinite(times)
        are_named = finite & _are_named(named)
        order = np.argsort(codes, kind="stable")
        ends = np.searchsorted(codes[order], np.arange(len(self._listed)), side="right").tolist()
        parts = [
            (name, order[start:end])
            for name, (start, end) in zip(self._listed, itertools.pairwise([0, *ends]), strict=True)
            if start < end
        ]
        # As they arrived.
        for name, rows in sorted(parts, key=lambda one: int(one[1][0])):
            source = self._source(name)
            assert source is not None, "configured sensors always have one"
            own_s = times[rows]
            source.count(len(rows), np.sort(own_s[finite[rows]]), own_s[are_named[rows]])
            if source.free != 0:
                source.keep(plots[rows[: source.free]])
            self._count_renamed(name, len(rows))

    def _count_renamed(self, name: str, count: int) -> None:
        if name in self._names:
            self.renamed[self._names[name]] += count

    def _source(self, name: str) -> Source | None:
        name = self._names.get(name, name)
        if name and not re.fullmatch(SENSOR_ID_PATTERN, name):
            # Anything may stand there, of any length, and sentences quote it.
            name = shown(name)
        if name not in self._sources:
            # Any name may arrive; those of configured sensors are few.
            others = len(self._sources) - len(self.sensors)
            if name not in self.sensors.ids and others >= SOURCES_MAX:
                return None
            number = self.number(name) if self._spreads_positions else -1
            spread = number >= 0 and self.sensors.kinds[number] == KIND_POSITION
            self._sources[name] = Source(spread=bool(spread))
        return self._sources[name]


def count_before(ordered_s: NDArray[np.float64], row: int) -> int:
    """Return how many of (n,) times in order are in `BEFORE_S` before one, at most `BEFORE_MAX`."""
    first = int(np.searchsorted(ordered_s[: row + 1], ordered_s[row] - BEFORE_S))
    return min(row + 1 - first, BEFORE_MAX)


def _completed(frame: pl.DataFrame) -> pl.DataFrame:
    return frame.select(
        pl.col(name).cast(kind) if name in frame.columns else pl.lit(None, kind).alias(name)
        for name, kind in _RECORDED_SCHEMA.items()
    )


# Rows that name their aircraft.
def _are_named(frame: pl.DataFrame) -> NDArray[np.bool_]:
    columns = [frame[name] for name in _NAMES]
    if any(not column.null_count() for column in columns):
        return np.ones(len(frame), np.bool_)
    found = [column.is_not_null().to_numpy() for column in columns]
    named: NDArray[np.bool_] = np.logical_or.reduce(found)
    return named


def _is_due(every: int) -> pl.Expr:
    second = pl.col("time_s").floor().cast(pl.Int64, strict=False).fill_null(0)
    aircraft = (pl.col("mode_s_address").hash(0) % SPREAD_EVERY_MAX).cast(pl.Int64).fill_null(0)
    return (second + aircraft) % every == 0
