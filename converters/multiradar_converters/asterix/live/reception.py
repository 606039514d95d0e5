"""ASTERIX from a network: datagrams in, measurements out, batch after batch.

The blocks, layouts, items and checks are those of a recording; what differs is that nothing after
a record is known when its turn comes. What it takes from before: the clocks of radars and the
turns of their antennas, editions, and the records of the last moments, of which a second network
brings copies. The date comes from the reception.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import partial

import numpy as np
import polars as pl

from multiradar_converters.asterix import table
from multiradar_converters.asterix.decoding.checks import Refusal, aircraft, misplaced, untimed
from multiradar_converters.asterix.decoding.editions import Editions, source_name, sources_of
from multiradar_converters.asterix.decoding.gathering import Gathered, Rows, decode_blocks
from multiradar_converters.asterix.decoding.targets import Targets
from multiradar_converters.asterix.decoding.timing import (
    KINDS,
    Timed,
    services_in_order,
    targets_in_order,
    timed,
)
from multiradar_converters.asterix.framing.containers import blocks_of_datagrams
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.live.batch import LiveBatch, Tally, new_batch
from multiradar_converters.asterix.live.clocks import LiveClocks
from multiradar_converters.asterix.live.copies import RecentRecords
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA
from multiradar_schemas.measurements.reject import RejectCode

_DAY_S = 86_400.0
#: A time of day may lie so far ahead of its reception, s; beyond, it is of the day before.
AHEAD_MAX_S = 3600.0


# Category 048, item 010 alone, of the source 0-0.
_ANY_BLOCK = bytes.fromhex("300006800000")


@dataclass(frozen=True)
class LiveOptions:
    """What is known beforehand.

    Attributes
    ----------
    names : mapping
        Identifiers of sensors by source (area code times 256 and system code) and kind.
    turns : mapping
        Times of a turn of antennas by source, s, where they are known.
    editions : Editions
        Editions that the user chose.
    all_targets : bool
        Whether test targets and the like are measurements.
    duplicate_window_s : float
        Equal records of one source received at most so far apart are one, s; where they tell no
        time, at most a second apart.
    behind_max_s : float
        Times that lie farther behind their reception are rejected, s.
    """

    names: Mapping[tuple[int, str], str]
    turns: Mapping[int, float] = field(default_factory=dict)
    editions: Editions = field(default_factory=Editions)
    all_targets: bool = False
    duplicate_window_s: float = 10.0
    behind_max_s: float = 3600.0


class LiveDecoder:
    """Decodes datagrams in the order of their reception; owned by one thread.

    Parameters
    ----------
    options : LiveOptions
        What is known beforehand.
    """

    def __init__(self, options: LiveOptions) -> None:
        self._options = options
        sources = sorted({source for source, _ in options.names})
        self._known = np.array(sources, dtype=np.int64)
        self._clocks = LiveClocks(self._known, options.turns)
        self._recent = RecentRecords(options.duplicate_window_s)

    def decode(self, datagrams: Datagrams) -> LiveBatch:
        """Decode the next datagrams.

        Parameters
        ----------
        datagrams : Datagrams
            The datagrams, received at Unix times.

        Returns
        -------
        LiveBatch
            Every octet and every target report is in one of its counts.
        """
        blocks, cut = blocks_of_datagrams(datagrams, datagrams.begins)
        sources = sources_of(blocks)
        # Of others nothing is remembered: there may be sixty thousand of them.
        named = np.where(np.isin(sources, self._known), sources, -1)
        editions = self._options.editions
        editions.learn(blocks, named, go_on=True)
        gathered = decode_blocks(
            blocks, sources, editions.layouts(blocks, named), measurements_only=True
        )
        batch = new_batch(gathered, datagrams, cut)
        try:
            self._reports(gathered, datagrams, batch)
        except Exception:
            # What failed may be decoded again, and must not be its own copy.
            self._recent.forget()
            raise
        return batch

    def _reports(self, gathered: Gathered, datagrams: Datagrams, batch: LiveBatch) -> None:
        """Time the target reports, and tell measurements from what is none."""
        service_rows, services = services_in_order(gathered)
        rows, kind, targets = targets_in_order(gathered)
        known = np.isin(rows.source, self._known)
        tally = Tally(batch, datagrams)
        tally.refuse(rows, ~known, RejectCode.UNKNOWN_SENSOR, _unknown)
        rows, kind = _rows_taken(rows, known), kind[known]
        targets = _targets_taken(targets, known)
        marks = self._clocks.marks(rows, targets, service_rows, services)
        reports = timed(gathered, rows, kind, targets, marks)
        copies = self._recent.copies(reports)
        measured, _left_out, _flags = aircraft(reports, all_targets=self._options.all_targets)
        tally.count(rows, copies, "duplicate")
        tally.count(rows, ~copies & ~measured, "left_out")
        own = measured & ~copies
        time_s, behind = self._dated(reports)
        ids, unnamed = self._ids(reports)
        for wrong, code, reason in [
            *untimed(reports), behind, misplaced(reports, own), *unnamed
        ]:  # fmt: skip
            tally.refuse(rows, own & wrong, code, partial(_same, reason))
            own &= ~wrong
        tally.count(rows, own, "measurement")
        batch.datagram = tally.datagram(rows)[own]
        batch.frame = _frame(reports, np.flatnonzero(own), time_s, ids)

    def _dated(self, reports: Timed) -> tuple[Numbers, Refusal]:
        """Return Unix times, s: the day follows from the reception; and what is too old."""
        received_s, of_day = reports.rows.received_s, reports.targets.time_s
        days = np.floor((received_s + AHEAD_MAX_S - of_day) / _DAY_S)
        time_s = of_day + days * _DAY_S
        behind_max_s = self._options.behind_max_s
        return time_s, (
            received_s - time_s > behind_max_s,
            RejectCode.OUT_OF_RANGE,
            f"a time of day more than {behind_max_s:g} s before its reception",
        )

    def _ids(self, reports: Timed) -> tuple[pl.Series, list[Refusal]]:
        """Name the sensors; sources are known, but perhaps not for what they measure."""
        pairs = reports.rows.source * len(KINDS) + reports.kind
        distinct, place = np.unique(pairs, return_inverse=True)
        ids: list[str | None] = []
        unnamed: list[Refusal] = []
        for number, pair in enumerate(distinct.tolist()):
            source, kind = pair // len(KINDS), KINDS[pair % len(KINDS)]
            ids.append(self._options.names.get((source, kind)))
            if ids[-1] is None:
                reason = f"expected no {kind} reports of the sensor {source_name(source)}"
                unnamed.append((place == number, RejectCode.UNKNOWN_KIND, reason))
        return pl.Series(ids, dtype=pl.String).gather(place), unnamed


def warm_up() -> None:
    """Have the compiled loops ready before the first datagram comes."""
    octets = np.frombuffer(_ANY_BLOCK, dtype=np.uint8)
    none, size = np.zeros(1, np.int64), np.array([len(octets)])
    decoder = LiveDecoder(LiveOptions({(0, "radar"): "0-0"}))
    decoder.decode(Datagrams(octets, none, size, np.zeros(1)))


def _unknown(source: int) -> str:
    return f"expected a SAC and SIC of the sensors file, was {source_name(source)}"


def _same(reason: str, _source: int) -> str:
    return reason


def _rows_taken(rows: Rows, own: Flags) -> Rows:
    return Rows(**{one.name: getattr(rows, one.name)[own] for one in fields(Rows)})


def _targets_taken(targets: Targets, own: Flags) -> Targets:
    names = [one.name for one in fields(Targets) if one.name != "kind"]
    return replace(targets, **{name: getattr(targets, name)[own] for name in names})


def _frame(reports: Timed, own: Integers, time_s: Numbers, ids: pl.Series) -> pl.DataFrame:
    targets = reports.targets
    names = ("range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m")
    columns = {name: getattr(targets, name)[own] for name in names} | {"time_s": time_s[own]}
    whole = {"kind": reports.kind} | {
        name: getattr(targets, name) for name in ("code", "address", "callsign", "flags")
    }
    made = table.frame(
        columns, ids.gather(own), {name: values[own] for name, values in whole.items()}
    )
    return made.select(PLAIN_SCHEMA.keys())
