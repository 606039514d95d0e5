"""Result of a batch of datagrams, with the disposition of its octets and records."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from multiradar_converters.asterix.decoding.gathering import Gathered, Rows
from multiradar_converters.asterix.framing.containers import SKIPPED
from multiradar_converters.asterix.framing.datagrams import CutDatagrams, Datagrams
from multiradar_converters.asterix.layout.columns import Flags, Integers
from multiradar_schemas.measurements.directions import REPORT_SCHEMA
from multiradar_schemas.reject import RejectCode

#: Dispositions of a target report.
DISPOSITIONS = ("measurement", "duplicate", "left_out", "refused")

_NO_ROWS = pl.DataFrame(schema=REPORT_SCHEMA)


@dataclass(frozen=True)
class RejectedOctets:
    """Rejected octets of a datagram, with the reason."""

    datagram: int
    offset: int
    octets: bytes
    code: RejectCode
    reason: str


@dataclass
class LiveBatch:
    """Result of decoding datagrams.

    Attributes
    ----------
    frame : DataFrame
        Measurements, columns of `REPORT_SCHEMA`, in the order of reception.
    datagram : int64[m]
        The datagram of each measurement.
    rejected : list of RejectedOctets
        Rejected octets.
    octets : dict of int64[n]
        Octets of each datagram that were framing (a header or footer), decoded, skipped and
        quarantined.
    records : dict of int64[n]
        Target reports of each datagram by disposition: measurement, duplicate, left_out (no
        aircraft or no position), or rejected (`refused`).
    categories : Counter
        Records by category.
    clocks : dict
        Clock offset, latency and alarm of each sensor so far, by identifier.
    """

    frame: pl.DataFrame
    datagram: Integers
    rejected: list[RejectedOctets]
    octets: dict[str, Integers]
    records: dict[str, Integers]
    categories: Counter[int]
    clocks: dict[str, dict[str, object]] = field(default_factory=dict)


def new_batch(gathered: Gathered, datagrams: Datagrams, cut: CutDatagrams) -> LiveBatch:
    """Account for the octets of datagrams; the target reports are added later.

    Parameters
    ----------
    gathered : Gathered
        Their decoded blocks.
    datagrams : Datagrams
        The datagrams.
    cut : CutDatagrams
        The datagram of each block.

    Returns
    -------
    LiveBatch
        Without measurements.
    """
    rejected = _broken(gathered, datagrams)
    categories = Counter[int]()
    for (category, _source), count in gathered.records.items():
        categories[category] += count
    return LiveBatch(
        frame=_NO_ROWS,
        datagram=np.empty(0, np.int64),
        rejected=rejected,
        octets=_octets(gathered, rejected, cut),
        records={name: np.zeros(len(datagrams), np.int64) for name in DISPOSITIONS},
        categories=categories,
    )


def unreadable(datagrams: Datagrams, reason: str) -> LiveBatch:
    """Reject whole datagrams.

    Parameters
    ----------
    datagrams : Datagrams
        The datagrams.
    reason : str
        Reason in words.

    Returns
    -------
    LiveBatch
        All octets are quarantined.
    """
    count = len(datagrams)
    rejected = [
        RejectedOctets(
            place,
            0,
            datagrams.data[datagrams.begins[place] : datagrams.ends[place]].tobytes(),
            RejectCode.MALFORMED_BLOCK,
            reason,
        )
        for place in range(count)
    ]
    nothing = np.zeros(count, np.int64)
    return LiveBatch(
        frame=_NO_ROWS,
        datagram=np.empty(0, np.int64),
        rejected=rejected,
        octets={
            "framing": nothing,
            "decoded": nothing,
            "skipped": nothing,
            "quarantined": datagrams.ends - datagrams.begins,
        },
        records=dict.fromkeys(DISPOSITIONS, nothing),
        categories=Counter(),
    )


class Tally:
    """Counts the disposition of records by datagram."""

    def __init__(self, batch: LiveBatch, datagrams: Datagrams) -> None:
        self._batch = batch
        self._datagrams = datagrams

    def datagram(self, rows: Rows) -> Integers:
        """Return the datagram of each record; empty ones have none."""
        return np.searchsorted(self._datagrams.begins, rows.begin, side="right") - 1

    def count(self, rows: Rows, own: Flags, name: str) -> None:
        """Count records under a name."""
        places = self.datagram(rows)[own]
        self._batch.records[name] += np.bincount(places, minlength=len(self._datagrams))

    def reject(
        self, rows: Rows, wrong: Flags, code: RejectCode, reason: Callable[[int], str]
    ) -> None:
        """Reject records, with a reason depending on their source; their octets are retained."""
        if not wrong.any():
            return
        self.count(rows, wrong, "refused")
        data, begins = self._datagrams.data, self._datagrams.begins
        for place, source, begin, end in zip(
            self.datagram(rows)[wrong].tolist(),
            rows.source[wrong].tolist(),
            rows.begin[wrong].tolist(),
            rows.end[wrong].tolist(),
            strict=True,
        ):
            octets = data[begin:end].tobytes()
            offset = begin - int(begins[place])
            self._batch.rejected.append(RejectedOctets(place, offset, octets, code, reason(source)))


def _broken(gathered: Gathered, datagrams: Datagrams) -> list[RejectedOctets]:
    """Return blocks that do not fit, and octets outside blocks."""
    rejected = []
    for one in gathered.broken:
        place = int(np.searchsorted(datagrams.begins, one.offset, side="right")) - 1
        octets = datagrams.data[one.offset : one.offset + one.octets].tobytes()
        offset = one.offset - int(datagrams.begins[place])
        rejected.append(RejectedOctets(place, offset, octets, one.code, one.reason))
    empty = np.flatnonzero(datagrams.begins == datagrams.ends).tolist()
    rejected += [
        RejectedOctets(place, 0, b"", RejectCode.TRUNCATED, "an empty datagram") for place in empty
    ]
    return rejected


def _octets(
    gathered: Gathered, rejected: list[RejectedOctets], cut: CutDatagrams
) -> dict[str, Integers]:
    """Return the disposition of the octets of each datagram."""
    blocks = gathered.blocks
    lengths = blocks.ends - blocks.begins
    skipped = np.isin(blocks.data[blocks.begins], SKIPPED)
    broken = np.isin(blocks.begins, np.array([one.offset for one in gathered.broken], np.int64))
    count = len(cut.framing)
    quarantined = np.zeros(count, dtype=np.int64)
    for one in rejected:
        quarantined[one.datagram] += len(one.octets)
    octets = {"framing": cut.framing, "quarantined": quarantined}
    for name, own in (("decoded", ~skipped & ~broken), ("skipped", skipped)):
        sums = np.bincount(cut.datagram[own], weights=lengths[own], minlength=count)
        octets[name] = sums.astype(np.int64)
    return octets
