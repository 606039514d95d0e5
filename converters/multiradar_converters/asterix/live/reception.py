"""Live ASTERIX: datagrams in, measurements out, in batches.

Blocks, layouts, items and checks are those of recordings, but nothing after a record is known when
it is decoded. State from earlier data: clocks and scan periods of radars, editions, and recent
records, of which a second network may deliver duplicates. The date is that of the reception.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import polars as pl

from multiradar_converters.asterix import table
from multiradar_converters.asterix.decoding.checks import (
    Rejection,
    aircraft,
    misplaced,
    unreferenced,
    untimed,
)
from multiradar_converters.asterix.decoding.editions import Editions, source_name, sources_of
from multiradar_converters.asterix.decoding.gathering import (
    Gathered,
    decode_blocks,
    selected_rows,
)
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint, located
from multiradar_converters.asterix.decoding.naming import named
from multiradar_converters.asterix.decoding.sensor_clocks import of_reports, of_services
from multiradar_converters.asterix.decoding.targets import select_targets
from multiradar_converters.asterix.decoding.timing import (
    KINDS,
    Timed,
    services_in_order,
    targets_in_order,
    timed,
)
from multiradar_converters.asterix.framing.containers import SKIPPED, blocks_of_datagrams
from multiradar_converters.asterix.framing.datagram_framing import LearntFraming
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.asterix.live.batch import LiveBatch, Tally, new_batch
from multiradar_converters.asterix.live.clocks import LiveClocks
from multiradar_converters.asterix.live.copies import CAPACITY, RecentRecords
from multiradar_converters.asterix.live.recent_differences import RecentDifferences
from multiradar_schemas.reject import UNKNOWN_SOURCE, RejectCode

_DAY_S = 86_400.0
#: Maximum time of day ahead of its reception, s; beyond, it belongs to the previous day.
AHEAD_MAX_S = 3600.0


# Category 048, item 010 alone, of the source 0-0.
_ANY_BLOCK = bytes.fromhex("300006800000")


@dataclass(frozen=True)
class LiveOptions:
    """Configuration of live decoding.

    Attributes
    ----------
    names : mapping
        Identifiers of sensors by source (256 × SAC + SIC) and kind.
    scan_periods : mapping
        Scan periods by source, s, if known.
    editions : Editions
        Selected editions.
    all_targets : bool
        Whether to include test targets and the like.
    duplicate_window_s : float
        Equal records of a source received within this time are duplicates, s; records without time
        only within 1 s.
    behind_max_s : float
        Maximum age of a time of day at reception, s; older records are rejected.
    references : mapping
        Reference points of local coordinates by source; those that a source reports (019/600), the
        latest of each, fill in where there is none.
    retained_records : int
        Records retained to find duplicates; a power of two.
    """

    names: Mapping[tuple[int, str], str]
    scan_periods: Mapping[int, float] = field(default_factory=dict)
    editions: Editions = field(default_factory=Editions)
    all_targets: bool = False
    duplicate_window_s: float = 10.0
    behind_max_s: float = 3600.0
    references: Mapping[int, ReferencePoint] = field(default_factory=dict)
    retained_records: int = CAPACITY


class LiveDecoder:
    """Decodes datagrams in the order of their reception; owned by one thread.

    Parameters
    ----------
    options : LiveOptions
        Configuration.
    """

    def __init__(self, options: LiveOptions) -> None:
        self._options = self._following = options
        sources = _sources(options)
        self._known = np.array(sources, dtype=np.int64)
        self._clocks = LiveClocks(self._known, options.scan_periods)
        self._differences = RecentDifferences(sources)
        self._framing = LearntFraming(SKIPPED)
        self._recent = RecentRecords(options.duplicate_window_s, options.retained_records)
        self._reported: dict[int, ReferencePoint] = {}

    def use(self, options: LiveOptions) -> None:
        """Use further names, scan periods and references from the next datagrams on; any thread.

        What was learnt about the sources so far continues.
        """
        self._following = options

    def decode(self, datagrams: Datagrams) -> LiveBatch:
        """Decode the next datagrams.

        Parameters
        ----------
        datagrams : Datagrams
            The datagrams, with Unix times of reception.

        Returns
        -------
        LiveBatch
            Every octet and target report is in one of its counts.
        """
        self._adopt(self._following)
        blocks, cut = blocks_of_datagrams(datagrams, datagrams.begins, learnt=self._framing)
        sources = sources_of(blocks)
        # Unknown sources are not retained: there may be up to 65 536 of them.
        known = np.where(np.isin(sources, self._known), sources, -1)
        editions = self._options.editions
        editions.detect(blocks, known, revise=True)
        gathered = decode_blocks(blocks, sources, editions, named=known, measurements_only=True)
        batch = new_batch(gathered, datagrams, cut)
        try:
            self._reports(gathered, datagrams, batch)
        except Exception:
            # After a failure the records may be decoded again, and must not count as duplicates.
            self._recent.clear()
            raise
        return batch

    def _adopt(self, options: LiveOptions) -> None:
        if options is self._options:
            return
        self._options = options
        self._known = np.array(_sources(options), dtype=np.int64)
        self._clocks.extend(self._known, options.scan_periods)
        self._differences.extend(self._known.tolist())

    def _reports(self, gathered: Gathered, datagrams: Datagrams, batch: LiveBatch) -> None:
        """Assign times to target reports, and select measurements."""
        service_rows, services = services_in_order(gathered)
        placed = np.isin(service_rows.source, self._known) & ~np.isnan(services.site).any(axis=1)
        for k in np.flatnonzero(placed).tolist():
            point = ReferencePoint(*services.site[k, :2].tolist())
            self._reported[int(service_rows.source[k])] = point
        rows, kind, targets = targets_in_order(gathered)
        known = np.isin(rows.source, self._known)
        tally = Tally(batch, datagrams)
        tally.reject(rows, ~known, RejectCode.UNKNOWN_SENSOR, _unknown)
        rows, kind = selected_rows(rows, known), kind[known]
        references = self._reported | dict(self._options.references)
        targets = located(select_targets(targets, known), rows.source, references)
        marks = self._clocks.marks(rows, targets, service_rows, services)
        reports = timed(gathered, rows, kind, targets, marks)
        self._differences.push(of_reports(reports))
        self._differences.push(of_services(service_rows.source, services, service_rows.received_s))
        batch.clocks = self._named_clocks()
        copies = self._recent.copies(reports)
        measured, _left_out, _flags = aircraft(reports, all_targets=self._options.all_targets)
        tally.count(rows, copies, "duplicate")
        tally.count(rows, ~copies & ~measured, "left_out")
        own = measured & ~copies
        time_s, behind = self._dated(reports)
        ids, unnamed = self._ids(reports)
        for wrong, code, reason in [
            *untimed(reports), behind, unreferenced(reports, own), misplaced(reports, own),
            *unnamed,
        ]:  # fmt: skip
            tally.reject(rows, own & wrong, code, partial(_same, reason))
            own &= ~wrong
        tally.count(rows, own, "measurement")
        batch.datagram = tally.datagram(rows)[own]
        batch.frame = _frame(reports, np.flatnonzero(own), time_s, ids)

    def _named_clocks(self) -> dict[str, dict[str, object]]:
        """Return clocks and latencies by sensor."""
        names = {source: name for (source, _kind), name in sorted(self._options.names.items())}
        return {names[source]: one for source, one in self._differences.document().items()}

    def _dated(self, reports: Timed) -> tuple[Numbers, Rejection]:
        """Return Unix times, s, with the day of the reception, and reports that are too old."""
        received_s, of_day = reports.rows.received_s, reports.targets.time_s
        days = np.floor((received_s + AHEAD_MAX_S - of_day) / _DAY_S)
        time_s = of_day + days * _DAY_S
        behind_max_s = self._options.behind_max_s
        return time_s, (
            received_s - time_s > behind_max_s,
            RejectCode.OUT_OF_RANGE,
            f"a time of day more than {behind_max_s:g} s before reception",
        )

    def _ids(self, reports: Timed) -> tuple[pl.Series, list[Rejection]]:
        """Return sensor ids; a known source may not be configured for the kind of measurement."""
        pairs = reports.rows.source * len(KINDS) + reports.kind
        distinct, place = np.unique(pairs, return_inverse=True)
        ids: list[str | None] = []
        unnamed: list[Rejection] = []
        for number, pair in enumerate(distinct.tolist()):
            source, kind = pair // len(KINDS), KINDS[pair % len(KINDS)]
            ids.append(self._options.names.get((source, kind)))
            if ids[-1] is None:
                reason = (
                    f"the sensors file does not allow {kind} reports from sensor "
                    f"{source_name(source)}"
                )
                unnamed.append((place == number, RejectCode.UNKNOWN_KIND, reason))
        return named(place, ids.__getitem__), unnamed


def _sources(options: LiveOptions) -> list[int]:
    return sorted({source for source, _ in options.names})


def warm_up() -> None:
    """Compile the kernels before the first datagram."""
    octets = np.frombuffer(bytearray(_ANY_BLOCK), dtype=np.uint8)
    none, size = np.zeros(1, np.int64), np.array([len(octets)])
    decoder = LiveDecoder(LiveOptions({(0, "radar"): "0-0"}))
    decoder.decode(Datagrams(octets, none, size, np.zeros(1)))


def _unknown(source: int) -> str:
    return f"{UNKNOWN_SOURCE}{source_name(source)}"


def _same(reason: str, _source: int) -> str:
    return reason


def _frame(reports: Timed, own: Integers, time_s: Numbers, ids: pl.Series) -> pl.DataFrame:
    targets = reports.targets
    columns = {name: getattr(targets, name)[own] for name in table.NUMBERS}
    columns |= {"time_s": time_s[own]}
    whole = {"kind": reports.kind} | {name: getattr(targets, name) for name in table.WHOLE}
    made = table.frame(
        columns,
        ids if len(own) == len(ids) else ids.gather(own),
        {name: values[own] for name, values in whole.items()},
        targets.aircraft_data[own],
    )
    made.drop_in_place("flags")
    return made
