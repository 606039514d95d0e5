"""Figures of the reports of a sensor, accumulated part by part."""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data.figures import DataFigures
from multiradar_converters.distinct import distinct
from multiradar_converters.inspection.reports import Integers, Numbers, Reports
from multiradar_converters.inspection.sampling import Sample
from multiradar_converters.scan_period import PLOTS_MAX, scan_period_s, why_no_period

#: Cells of the coverage: sectors of 10°, rings of 10 km.
SECTORS, RINGS, RING_M = 36, 60, 10_000.0
#: Cells of the heights, m, and the height of the first.
HEIGHT_STEP_M, HEIGHT_FIRST_M, HEIGHT_STEPS = 100.0, -1_500.0, 480
#: Distinct identities that are counted.
IDENTITIES_MAX = 1 << 18
#: A gap is a time without reports of at least this, s, and these scan periods and median intervals.
GAP_MIN_S, GAP_SCANS, GAP_INTERVALS = 10.0, 3.0, 10.0
#: Gaps that are listed.
GAPS_MAX = 20

_CHUNK_S = 1 << 12
_CHUNKS_MAX = 1 << 12
_REVOLUTION_DEG = 360.0


@dataclass(frozen=True)
class Gap:
    """A time without reports, s."""

    first_s: float
    last_s: float

    @property
    def duration_s(self) -> float:
        """Its duration, s."""
        return self.last_s - self.first_s


class Seconds:
    """Reports by second; bounds the memory."""

    def __init__(self) -> None:
        self._chunks: dict[int, NDArray[np.int64]] = {}

    def add(self, time_s: Numbers) -> None:
        """Count reports."""
        second = np.floor(time_s[np.isfinite(time_s)]).astype(np.int64)
        chunk = second // _CHUNK_S
        for one in distinct(chunk).tolist():
            if one not in self._chunks and len(self._chunks) >= _CHUNKS_MAX:
                continue
            counts = self._chunks.setdefault(one, np.zeros(_CHUNK_S, np.int64))
            counts += np.bincount(second[chunk == one] - one * _CHUNK_S, minlength=_CHUNK_S)

    def counted(self) -> tuple[Integers, Integers]:
        """Return the seconds with reports, and their number, by time."""
        seconds, counts = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
        for chunk, values in sorted(self._chunks.items()):
            some = np.flatnonzero(values)
            seconds.append(some + chunk * _CHUNK_S)
            counts.append(values[some])
        return np.concatenate(seconds), np.concatenate(counts)


@dataclass
class SensorFigures:
    """Figures of a sensor.

    Attributes
    ----------
    reports, duplicates : int
        Target reports; those with the octets of another one within 1 s.
    local, unreferenced : int
        Reports with local coordinates only; of those, the ones without a reference point.
    left_out : Counter
        Reports that are not measurements of aircraft, by reason.
    measurements, with_address, with_code, with_height, on_ground : int
        Measurements, and those with an address, a code, a height, on the ground.
    first_s, last_s : float
        Times of the reports, s; NaN without any.
    range_min_m, range_max_m, height_min_m, height_max_m : float
        NaN without any.
    sectors : int64[36, 60]
        Plots by sector and ring.
    heights : int64[480]
        Reports by height.
    registers : Counter
        Reports with each BDS register, such as `4,0`; `any`: with any of them.
    data : DataFigures
        Figures of aircraft-derived data.
    """

    reports: int = 0
    duplicates: int = 0
    local: int = 0
    unreferenced: int = 0
    left_out: Counter[str] = field(default_factory=Counter)
    measurements: int = 0
    with_address: int = 0
    with_code: int = 0
    with_height: int = 0
    on_ground: int = 0
    first_s: float = math.nan
    last_s: float = math.nan
    range_min_m: float = math.nan
    range_max_m: float = math.nan
    height_min_m: float = math.nan
    height_max_m: float = math.nan
    sectors: Integers = field(default_factory=lambda: np.zeros((SECTORS, RINGS), np.int64))
    heights: Integers = field(default_factory=lambda: np.zeros(HEIGHT_STEPS, np.int64))
    registers: Counter[str] = field(default_factory=Counter)
    data: DataFigures = field(default_factory=DataFigures)
    addresses: set[int] = field(default_factory=set)
    codes: set[int] = field(default_factory=set)
    seconds: Seconds = field(default_factory=Seconds)
    sample: Sample = field(default_factory=Sample)
    _first: list[NDArray[np.float64]] = field(default_factory=list)
    _first_count: int = 0

    def add_times(self, time_s: Numbers) -> None:
        """Add times of reports, s."""
        self.seconds.add(time_s)
        self.first_s, self.last_s = _extended((self.first_s, self.last_s), time_s)

    def add(self, reports: Reports) -> None:
        """Add measurements; their times are added by `add_times`."""
        self.measurements += len(reports)
        for name, known, found in (
            ("with_address", reports.address, self.addresses),
            ("with_code", reports.code, self.codes),
        ):
            own = known[known >= 0]
            setattr(self, name, getattr(self, name) + len(own))
            if len(found) < IDENTITIES_MAX:
                found.update(distinct(own).tolist())
        self.with_height += int(np.isfinite(reports.height_m).sum())
        self.on_ground += int(reports.on_ground.sum())
        self.data.add(
            reports.aircraft_data,
            reports.dropped,
            np.where(reports.address > 0, reports.address, -1),
            reports.time_s,
            reports.height_m,
        )
        self._add_coverage(reports)
        self.sample.add(reports)

    def _add_coverage(self, reports: Reports) -> None:
        ranges = (self.range_min_m, self.range_max_m)
        self.range_min_m, self.range_max_m = _extended(ranges, reports.range_m)
        heights = (self.height_min_m, self.height_max_m)
        self.height_min_m, self.height_max_m = _extended(heights, reports.height_m)
        known = np.flatnonzero(np.isfinite(reports.range_m) & np.isfinite(reports.azimuth_deg))
        azimuth = reports.azimuth_deg[known] % _REVOLUTION_DEG
        sector = (azimuth * (SECTORS / _REVOLUTION_DEG)).astype(np.int64) % SECTORS
        ring = np.minimum(reports.range_m[known] / RING_M, RINGS - 1).astype(np.int64)
        cells = np.bincount(sector * RINGS + ring, minlength=SECTORS * RINGS)
        self.sectors += cells.reshape(SECTORS, RINGS)
        height = reports.height_m[np.isfinite(reports.height_m)]
        step = np.clip((height - HEIGHT_FIRST_M) / HEIGHT_STEP_M, 0, HEIGHT_STEPS - 1)
        self.heights += np.bincount(step.astype(np.int64), minlength=HEIGHT_STEPS)
        if self._first_count < PLOTS_MAX:
            some = known[: PLOTS_MAX - self._first_count]
            self._first.append(np.stack([reports.time_s[some], reports.azimuth_deg[some]]))
            self._first_count += len(some)

    def scan_period(self) -> tuple[float, str]:
        """Return the scan period from the first plots, s (NaN: none), and why there is none."""
        time_s, azimuth_deg = np.concatenate([np.empty((2, 0)), *self._first], axis=1)
        period_s = scan_period_s(time_s, azimuth_deg)
        return period_s, why_no_period(time_s, azimuth_deg) if math.isnan(period_s) else ""

    def gaps(self, period_s: float) -> list[Gap]:
        """Return the times without reports, by time.

        Parameters
        ----------
        period_s : float
            Scan period, s; NaN if unknown.
        """
        second, _counts = self.seconds.counted()
        if len(second) < 2:
            return []
        # Without the gaps themselves: the median over seconds with reports.
        interval_s = float(np.median(np.diff(second)))
        least_s = max(GAP_MIN_S, GAP_SCANS * np.nan_to_num(period_s), GAP_INTERVALS * interval_s)
        after = np.flatnonzero(np.diff(second) > least_s)
        return [Gap(float(second[k] + 1), float(second[k + 1])) for k in after.tolist()]

    def rate_per_s(self) -> tuple[float, float]:
        """Return reports per second: mean over the recording, and maximum of a second."""
        _, counts = self.seconds.counted()
        if not len(counts):
            return math.nan, math.nan
        return float(counts.sum()) / max(self.last_s - self.first_s, 1.0), float(counts.max())

    def height_range_m(self, fraction: float) -> float:
        """Return the height below which a fraction of the reports is, m; NaN without heights."""
        if not self.heights.any():
            return math.nan
        below = np.cumsum(self.heights)
        step = int(np.searchsorted(below, fraction * below[-1]))
        return HEIGHT_FIRST_M + HEIGHT_STEP_M * min(step + 0.5, HEIGHT_STEPS)


def _extended(limits: tuple[float, float], values: Numbers) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not len(known):
        return limits
    return float(np.fmin(limits[0], known.min())), float(np.fmax(limits[1], known.max()))
