"""The records of one file with their times: target reports and service messages in order."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.decoding.clocks import Marks, times_of
from multiradar_converters.asterix.decoding.gathering import Gathered, Rows
from multiradar_converters.asterix.decoding.services import Services, turn_s
from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.vid.times import Clockwork, agreed_start, begins_before_midnight

#: Kinds of measurement, by number.
KINDS = ("radar", "mlat", "adsb")

_DAY_S = 86_400.0
_FIRST_ROWS = 200


@dataclass(frozen=True)
class Timed:
    """All target reports of a file, in its order.

    Attributes
    ----------
    rows : Rows
        Where they stand.
    kind : int64[n]
        Kind of each, see `KINDS`.
    targets : Targets
        What they say; `time_s` is the restored time of day.
    said_s : float64[n]
        Time of day as the report says it; NaN where it does not.
    origin : int64[n]
        Where each time comes from, see `clocks.ORIGINS`.
    same : int64[n]
        Equal for records of equal octets.
    """

    rows: Rows
    kind: Integers
    targets: Targets
    said_s: Numbers
    origin: Integers
    same: Integers


@dataclass(frozen=True)
class Turned:
    """What the service messages of a source say: turn of the antenna, s, and its site."""

    north_marks: int
    sectors: int
    turn_s: float
    site: tuple[float, float, float] | None


_WHOLE, _NUMBER = np.empty(0, dtype=np.int64), np.empty(0)
_NO_ROWS = Rows(_WHOLE, _WHOLE, _WHOLE, _WHOLE, _WHOLE, _NUMBER)
_NO_SERVICES = Services(_WHOLE, _NUMBER, _NUMBER, _NUMBER, np.empty((0, 3)))
_NO_TARGETS = Targets(
    "",
    *(_NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER, _NUMBER),
    *(_WHOLE, _WHOLE, _WHOLE, _WHOLE),
)


def time_targets(
    gathered: Gathered, turns: Mapping[int, float] | None = None
) -> tuple[Timed | None, dict[int, Turned]]:
    """Give the target reports of a file their times of day.

    Parameters
    ----------
    gathered : Gathered
        The file.
    turns : mapping, optional
        Time of a turn by source, s, where the file does not tell it.

    Returns
    -------
    timed : Timed or None
        The reports; None if there are none.
    turned : dict
        What the service messages say, by source.
    """
    service_rows, services = services_in_order(gathered)
    turned = _turned(service_rows, services)
    if not gathered.targets:
        return None, turned
    rows, kind, targets = targets_in_order(gathered)
    known = {source: one.turn_s for source, one in turned.items() if one.turn_s == one.turn_s}
    marks = marks_of(rows, targets, service_rows, services)
    turn_s = by_source(marks.source, dict(turns or {}) | known)
    return timed(gathered, rows, kind, targets, replace(marks, turn_s=turn_s)), turned


def timed(gathered: Gathered, rows: Rows, kind: Integers, targets: Targets, marks: Marks) -> Timed:
    """Give target reports their times of day.

    Parameters
    ----------
    gathered : Gathered
        Where they come from.
    rows, kind, targets
        The reports, as `targets_in_order` returns them.
    marks : Marks
        Times of day that sources gave.

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
    _kernels.hash_records(gathered.blocks.data, rows.begin, rows.end, same)
    return Timed(rows, kind, replace(targets, time_s=time_s), targets.time_s, origin, same)


def by_source(source: Integers, values: Mapping[int, float]) -> Numbers:
    """Return a value for each row by its source; NaN where there is none."""
    distinct, place = np.unique(source, return_inverse=True)
    return np.array([values.get(one, np.nan) for one in distinct.tolist()], np.float64)[place]


def into_days(time_s: Numbers, source: Integers) -> Flags:
    """Let times of day go on past midnight, in place, each source on its own.

    Parameters
    ----------
    time_s : float64[n]
        Times of day in the order of a file, s. Changed.
    source : int64[n]
        Who reports.

    Returns
    -------
    bool[n]
        Whether each is kept: not an hour away from those of its source around it.
    """
    kept = np.zeros(len(time_s), dtype=np.bool_)
    sources = np.unique(source).tolist()
    starts = {
        one: agreed_start(time_s[source == one][:_FIRST_ROWS].tolist(), "seconds-of-day")
        for one in sources
    }
    before = begins_before_midnight(starts.values())
    for one in sources:
        own = np.flatnonzero(source == one)
        times, taken = time_s[own], np.zeros(len(own), dtype=np.bool_)
        clockwork = Clockwork("seconds-of-day", start=starts[one], from_before_midnight=before)
        decided, _ = clockwork.run(times, taken)
        # Fewer rows than can tell of a gap are left at the end: they disagree with all before.
        taken[decided:] = False
        time_s[own], kept[own] = times, taken
    return kept


def _joined(rows: list[Rows]) -> tuple[Rows, NDArray[np.int64]]:
    """Put rows into the order of the file; return the permutation too."""
    order = np.argsort(np.concatenate([one.order for one in rows]), kind="stable")
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in rows])[order]
        for one in fields(Rows)
    }
    return Rows(**values), order


def targets_in_order(gathered: Gathered) -> tuple[Rows, Integers, Targets]:
    """Return all target reports in the order of the file: where they stand, kind, content."""
    parts = [targets for _, _, targets in gathered.targets]
    if not parts:
        return _NO_ROWS, np.empty(0, dtype=np.int64), _NO_TARGETS
    rows, order = _joined([rows for _, rows, _ in gathered.targets])
    kinds = [np.full(len(part.time_s), KINDS.index(part.kind)) for part in parts]
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts])[order]
        for one in fields(Targets)
        if one.name != "kind"
    }
    return rows, np.concatenate(kinds)[order], Targets(kind="", **values)


def services_in_order(gathered: Gathered) -> tuple[Rows, Services]:
    """Return all service messages in the order of the file: where they stand, and content."""
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
    """Collect the times of day that sources gave; turns are not known yet."""
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
        turn_s=np.full(len(place), np.nan),
    )


def _turned(rows: Rows, services: Services) -> dict[int, Turned]:
    turned = {}
    for source in np.unique(rows.source).tolist():
        own = np.flatnonzero(rows.source == source)
        times = services.time_s[own]
        given = ~np.isnan(times)
        times[given] = np.unwrap(times[given], period=_DAY_S)
        # Two networks bring the same message twice.
        repeated = np.zeros(len(own), dtype=np.bool_)
        repeated[1:] = (times[1:] == times[:-1]) & (
            services.message[own][1:] == services.message[own][:-1]
        )
        own, times = own[~repeated], times[~repeated]
        sites = services.site[own][~np.isnan(services.site[own]).any(axis=1)]
        latitude, longitude, height = sites[-1].tolist() if len(sites) else (0.0, 0.0, 0.0)
        turned[source] = Turned(
            north_marks=int((services.message[own] == 1).sum()),
            sectors=int((services.message[own] == 2).sum()),
            turn_s=turn_s(
                services.message[own], times, services.sector_deg[own], services.period_s[own]
            ),
            site=(latitude, longitude, height) if len(sites) else None,
        )
    return turned
