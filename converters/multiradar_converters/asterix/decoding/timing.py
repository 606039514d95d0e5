"""Times of the records of a file: target reports and service messages in order."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar_converters.aircraft_data.quantities import joined, without
from multiradar_converters.asterix.decoding.clocks import Marks, times_of
from multiradar_converters.asterix.decoding.gathering import Gathered, Rows
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint
from multiradar_converters.asterix.decoding.sensor_status import TIME
from multiradar_converters.asterix.decoding.services import Services, antenna_period_s
from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.layout import _block_kernels
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.distinct import distinct, distinct_places
from multiradar_converters.vid.text.times import TimeUnwrapper, agreed_start, first_day

#: Kinds of measurement, by number.
KINDS = ("radar", "mlat", "adsb")

_DAY_S = 86_400.0
_FIRST_ROWS = 200


@dataclass(frozen=True)
class Timed:
    """All target reports of a file, in file order.

    Attributes
    ----------
    rows : Rows
        Location of the records.
    kind : int64[n]
        Kind of each, see `KINDS`.
    targets : Targets
        The reports; `time_s` is the resolved time of day.
    reported_s : float64[n]
        Time of day in the report; NaN if absent.
    origin : int64[n]
        Origin of each time, see `clocks.ORIGINS`.
    same : int64[n]
        Equal for records with equal octets.
    """

    rows: Rows
    kind: Integers
    targets: Targets
    reported_s: Numbers
    origin: Integers
    same: Integers


@dataclass(frozen=True)
class AntennaStatus:
    """Antenna status from the service messages of a source: scan period, s, and site."""

    north_marks: int
    sectors: int
    period_s: float
    site: tuple[float, float, float] | None


_WHOLE, _NUMBER = np.empty(0, dtype=np.int64), np.empty(0)
_NO_ROWS = Rows(_WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE, _NUMBER)
_NO_SERVICES = Services(_WHOLE, _NUMBER, _NUMBER, _NUMBER, np.empty((0, 3)))
_NO_TARGETS = Targets(
    "",
    *(_NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER),
    *(_WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE),
    aircraft_data=without(0),
    dropped=_WHOLE,
)


def time_targets(
    gathered: Gathered, scan_periods: Mapping[int, float] | None = None
) -> tuple[Timed | None, dict[int, AntennaStatus]]:
    """Assign times of day to the target reports of a file.

    Parameters
    ----------
    gathered : Gathered
        The file.
    scan_periods : mapping, optional
        Scan periods by source, s, if the file does not contain them.

    Returns
    -------
    timed : Timed or None
        The reports; None without reports.
    antennas : dict
        Antenna status by source.
    """
    service_rows, services = services_in_order(gathered)
    antennas = _antennas(service_rows, services)
    if not gathered.targets:
        return None, antennas
    rows, kind, targets = targets_in_order(gathered)
    known = {
        source: one.period_s for source, one in antennas.items() if one.period_s == one.period_s
    }
    marks = marks_of(rows, targets, service_rows, services)
    period_s = by_source(marks.source, dict(scan_periods or {}) | known)
    return timed(gathered, rows, kind, targets, replace(marks, period_s=period_s)), antennas


def timed(gathered: Gathered, rows: Rows, kind: Integers, targets: Targets, marks: Marks) -> Timed:
    """Assign times of day to target reports.

    Parameters
    ----------
    gathered : Gathered
        The decoded file.
    rows, kind, targets
        The reports, as from `targets_in_order`.
    marks : Marks
        Times of day reported by sources.

    Returns
    -------
    Timed
        The reports with their times.
    """
    time_s, origin = times_of(
        order=rows.order,
        source=rows.source,
        time_s=targets.time_s,
        truncated_s=targets.truncated_s,
        azimuth_deg=targets.azimuth_deg,
        received_s=rows.received_s % _DAY_S,
        marks=marks,
    )
    same = np.empty(len(kind), dtype=np.int64)
    _block_kernels.hash_records(gathered.blocks.data, rows.begin, rows.end, same)
    return Timed(rows, kind, replace(targets, time_s=time_s), targets.time_s, origin, same)


def reported_references(antennas: Mapping[int, AntennaStatus]) -> dict[int, ReferencePoint]:
    """Return the sites that sources report, as reference points of their local coordinates."""
    return {
        source: ReferencePoint(*one.site[:2])
        for source, one in antennas.items()
        if one.site is not None
    }


def by_source(source: Integers, values: Mapping[int, float]) -> Numbers:
    """Return the value of the source of each row; NaN if absent."""
    sources, place = distinct_places(source)
    return np.array([values.get(one, np.nan) for one in sources.tolist()], np.float64)[place]


@dataclass(frozen=True)
class FileDays:
    """Times of the records of a file, continued past midnight, s.

    Attributes
    ----------
    time_s : float64[n]
        Of the target reports; NaN if unknown.
    kept : bool[n]
        Which of them are within an hour of neighbouring rows of their source.
    tracks_s, status_s : list of float64[m]
        Of the system tracks and of the sensor status, as in `Gathered`; NaN if unknown or more than
        an hour from neighbouring rows of their source.
    """

    time_s: Numbers
    kept: Flags
    tracks_s: list[Numbers]
    status_s: list[Numbers]

    @property
    def known_s(self) -> Numbers:
        """All known times, s."""
        parts = [self.time_s[self.kept], *self.tracks_s, *self.status_s]
        whole: Numbers = np.concatenate(parts)
        return whole[~np.isnan(whole)]

    def moved(self, step_s: float) -> "FileDays":
        """Return the times, later by some seconds."""
        return FileDays(
            self.time_s + step_s,
            self.kept,
            [one + step_s for one in self.tracks_s],
            [one + step_s for one in self.status_s],
        )


def days_of_file(gathered: Gathered, timed: Timed | None) -> FileDays:
    """Unwrap the times of day of all records of a file past midnight, see `into_days`.

    Parameters
    ----------
    gathered : Gathered
        The file.
    timed : Timed or None
        Its target reports.

    Returns
    -------
    FileDays
        Their times.
    """
    parts = [] if timed is None else [(timed.rows, timed.targets.time_s)]
    parts += [(rows, _column(part, "time_s")) for rows, part in gathered.tracks]
    parts += [(rows, _column(part, TIME)) for rows, part in gathered.status]
    if not parts:
        return FileDays(_NUMBER, np.empty(0, dtype=np.bool_), [], [])
    # A processor of tracks may have the number of a sensor.
    kinds = [0] * (timed is not None) + [1] * len(gathered.tracks) + [2] * len(gathered.status)
    order = np.concatenate([rows.order for rows, _ in parts])
    source = np.concatenate(
        [rows.source + (kind << 32) for (rows, _), kind in zip(parts, kinds, strict=True)]
    )
    time_s = np.concatenate([times for _, times in parts])
    known = np.flatnonzero(time_s < _DAY_S)
    known = known[np.argsort(order[known], kind="stable")]
    days, kept = time_s[known], np.zeros(len(time_s), dtype=np.bool_)
    kept[known] = into_days(days, source[known])
    time_s[known] = days
    sizes = [len(times) for _, times in parts]
    ends = np.cumsum(sizes)[:-1]
    whole = np.split(np.where(kept, time_s, np.nan), ends)
    reports = int(timed is not None)
    tracks = reports + len(gathered.tracks)
    own = sizes[0] if reports else 0
    return FileDays(time_s[:own], kept[:own], whole[reports:tracks], whole[tracks:])


def _column(part: pl.DataFrame, name: str) -> Numbers:
    values: Numbers = part[name].fill_null(np.nan).to_numpy()
    return values


def into_days(time_s: Numbers, source: Integers) -> Flags:
    """Unwrap times of day past midnight, in place and per source.

    A source starts on the day nearest to the last times before it of the sources that start before
    it in the file; if these have ended, on the day nearest to the span of their times. If that is
    shortly before the midnight at which the others start, the file starts on the day before.

    Parameters
    ----------
    time_s : float64[n]
        Times of day in file order, s. Changed.
    source : int64[n]
        Source.

    Returns
    -------
    bool[n]
        Whether each is kept: within an hour of neighbouring rows of its source.
    """
    kept = np.zeros(len(time_s), dtype=np.bool_)
    rows = [np.flatnonzero(source == one) for one in distinct(source).tolist()]
    days: list[int] = []
    for own in sorted(rows, key=lambda one: int(one[0])):
        times, taken = time_s[own], np.zeros(len(own), dtype=np.bool_)
        start = agreed_start(times[:_FIRST_ROWS].tolist(), "seconds-of-day")
        days.append(_first_day(start, int(own[0]), time_s, np.flatnonzero(kept)))
        clockwork = TimeUnwrapper("seconds-of-day", start=start, day=days[-1])
        decided, _ = clockwork.run(times, taken)
        # Too few rows at the end to indicate a gap: they disagree with all previous rows.
        taken[decided:] = False
        time_s[own], kept[own] = times, taken
    if min(days, default=0) < 0:
        time_s += _DAY_S
    return kept


def _first_day(start_s: float, begin: int, time_s: Numbers, others: Integers) -> int:
    """Return the day on which a source starts, by the rows of sources that start before it."""
    if not len(others):
        return 0
    if others[-1] > begin:
        before = others[others < begin][-_FIRST_ROWS:]
        return first_day(start_s, float(np.median(time_s[before if len(before) else others[:1]])))
    # All others end before it starts: the file was joined from several, of the same hours or not.
    low_s, high_s = float(time_s[others].min()), float(time_s[others].max())

    def away_s(day: int) -> float:
        return max(low_s - start_s - day * _DAY_S, start_s + day * _DAY_S - high_s, 0.0)

    return min(first_day(start_s, low_s), first_day(start_s, high_s), key=away_s)


def _joined(rows: list[Rows]) -> tuple[Rows, NDArray[np.int64]]:
    """Sort rows in file order; return the permutation too."""
    order = np.argsort(np.concatenate([one.order for one in rows]), kind="stable")
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in rows])[order]
        for one in fields(Rows)
    }
    return Rows(**values), order


def targets_in_order(gathered: Gathered) -> tuple[Rows, Integers, Targets]:
    """Return all target reports in file order: location, kind, content."""
    parts = [targets for _, _, targets in gathered.targets]
    if not parts:
        return _NO_ROWS, np.empty(0, dtype=np.int64), _NO_TARGETS
    rows, order = _joined([rows for _, rows, _ in gathered.targets])
    kinds = [np.full(len(part.time_s), KINDS.index(part.kind)) for part in parts]
    values = {
        one.name: joined([getattr(part, one.name) for part in parts])[order]
        for one in fields(Targets)
        if one.name != "kind"
    }
    return rows, np.concatenate(kinds)[order], Targets(kind="", **values)


def services_in_order(gathered: Gathered) -> tuple[Rows, Services]:
    """Return all service messages in file order: location and content."""
    if not gathered.services:
        return _NO_ROWS, _NO_SERVICES
    parts = [services for _, _, services in gathered.services]
    rows, order = _joined([rows for _, rows, _ in gathered.services])
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts])[order]
        for one in fields(Services)
    }
    return rows, Services(**values)


def marks_of(rows: Rows, targets: Targets, service_rows: Rows, services: Services) -> Marks:
    """Collect the times of day reported by sources; scan periods are not known yet."""
    order = np.concatenate([service_rows.order, rows.order])
    time_s = np.concatenate([services.time_s, targets.time_s])
    sector = np.concatenate([services.sector_deg, np.full(len(rows.order), np.nan)])
    given = np.flatnonzero(time_s < _DAY_S)
    place = given[np.argsort(order[given], kind="stable")]
    return Marks(
        order=order[place],
        source=np.concatenate([service_rows.source, rows.source])[place],
        time_s=time_s[place],
        received_s=np.concatenate([service_rows.received_s, rows.received_s])[place] % _DAY_S,
        sector_deg=sector[place],
        period_s=np.full(len(place), np.nan),
    )


def _antennas(rows: Rows, services: Services) -> dict[int, AntennaStatus]:
    antennas = {}
    for source in distinct(rows.source).tolist():
        own = np.flatnonzero(rows.source == source)
        times = services.time_s[own]
        given = ~np.isnan(times)
        times[given] = np.unwrap(times[given], period=_DAY_S)
        # Two networks deliver the same message twice.
        repeated = np.zeros(len(own), dtype=np.bool_)
        repeated[1:] = (times[1:] == times[:-1]) & (
            services.message[own][1:] == services.message[own][:-1]
        )
        own, times = own[~repeated], times[~repeated]
        sites = services.site[own][~np.isnan(services.site[own]).any(axis=1)]
        latitude, longitude, height = sites[-1].tolist() if len(sites) else (0.0, 0.0, 0.0)
        antennas[source] = AntennaStatus(
            north_marks=int((services.message[own] == 1).sum()),
            sectors=int((services.message[own] == 2).sum()),
            period_s=antenna_period_s(
                services.message[own], times, services.sector_deg[own], services.period_s[own]
            ),
            site=(latitude, longitude, height) if len(sites) else None,
        )
    return antennas
