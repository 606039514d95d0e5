"""The records of one file with their times: target reports and service messages in order."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix import _kernels
from multiradar_converters.asterix.clocks import Marks, times_of
from multiradar_converters.asterix.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.gathering import Gathered, Rows
from multiradar_converters.asterix.services import Services, turn_s
from multiradar_converters.asterix.targets import Targets
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
    origin : int64[n]
        Where each time comes from, see `clocks.ORIGINS`.
    same : int64[n]
        Equal for records of equal octets.
    """

    rows: Rows
    kind: Integers
    targets: Targets
    origin: Integers
    same: Integers


@dataclass(frozen=True)
class Turned:
    """What the service messages of a source say: turn of the antenna, s, and its site."""

    north_marks: int
    sectors: int
    turn_s: float
    site: tuple[float, float, float] | None


def time_targets(gathered: Gathered) -> tuple[Timed | None, dict[int, Turned]]:
    """Give the target reports of a file their times of day.

    Parameters
    ----------
    gathered : Gathered
        The file.

    Returns
    -------
    timed : Timed or None
        The reports; None if there are none.
    turned : dict
        What the service messages say, by source.
    """
    service_rows, services = _services(gathered)
    turned = _turned(service_rows, services)
    if not gathered.targets:
        return None, turned
    rows, kind, targets = _targets(gathered)
    turns = {source: one.turn_s for source, one in turned.items()}
    time_s, origin = times_of(
        order=rows.order,
        source=rows.source,
        time_s=targets.time_s,
        truncated_s=targets.truncated_s,
        azimuth_deg=targets.azimuth_deg,
        received_s=rows.received_s % _DAY_S,
        marks=_marks(rows, targets, service_rows, services),
        turns=turns,
    )
    same = np.empty(len(kind), dtype=np.int64)
    _kernels.hash_records(gathered.blocks.data, rows.begin, rows.end, same)
    values = {one.name: getattr(targets, one.name) for one in fields(targets)} | {"time_s": time_s}
    return Timed(rows, kind, Targets(**values), origin, same), turned


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


def _targets(gathered: Gathered) -> tuple[Rows, Integers, Targets]:
    parts = [targets for _, _, targets in gathered.targets]
    rows, order = _joined([rows for _, rows, _ in gathered.targets])
    kinds = [np.full(len(part.time_s), KINDS.index(part.kind)) for part in parts]
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts])[order]
        for one in fields(Targets)
        if one.name != "kind"
    }
    return rows, np.concatenate(kinds)[order], Targets(kind="", **values)


def _services(gathered: Gathered) -> tuple[Rows, Services]:
    if not gathered.services:
        whole, number = np.empty(0, dtype=np.int64), np.empty(0)
        return (
            Rows(whole, whole, whole, whole, whole, number),
            Services(whole, number, number, number, np.empty((0, 3))),
        )
    parts = [services for _, _, services in gathered.services]
    rows, order = _joined([rows for _, rows, _ in gathered.services])
    values = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts])[order]
        for one in fields(Services)
    }
    return rows, Services(**values)


def _marks(rows: Rows, targets: Targets, service_rows: Rows, services: Services) -> Marks:
    """Collect the times of day that sources gave."""
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
