"""Decodes the blocks of a file, layout by layout and in bounded parts, into columns."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace

import numpy as np
import polars as pl

from multiradar_converters.asterix.decoding.editions import (
    UNFIT,
    UNKNOWN,
    Editions,
    source_name,
    sources_of,
)
from multiradar_converters.asterix.decoding.sensor_status import read_status
from multiradar_converters.asterix.decoding.services import Services, read_services
from multiradar_converters.asterix.decoding.system_tracks import read_system_tracks
from multiradar_converters.asterix.decoding.targets import Targets, read_targets
from multiradar_converters.asterix.framing.capture import CUT_PACKET
from multiradar_converters.asterix.framing.containers import (
    FINAL_FORMAT,
    HEAD,
    PADDING,
    REPLAY_FILE,
    SKIPPED,
    Blocks,
)
from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.columns import Columns, Flags, Integers, Numbers
from multiradar_converters.asterix.layout.notation import Layout
from multiradar_converters.asterix.layout.program import REASONS, Walked, program_of, walk
from multiradar_converters.distinct import distinct
from multiradar_schemas.reject import RejectCode

#: Categories of another SDPS: system tracks and sensor status.
SYSTEM_TRACKS, SENSOR_STATUS = 62, 63

#: Blocks decoded at a time; bounds the memory.
BLOCKS_AT_ONCE = 1 << 14

# Exceeds the records of a block, so that block index times this plus the index of the record in the
# block orders the records of a file.
_RECORDS_OF_BLOCK = 1 << 16

# What a file consists of, by its form, if not of blocks.
_UNITS = {FINAL_FORMAT: "envelope", REPLAY_FILE: "datagram"}


@dataclass(frozen=True)
class Broken:
    """An undecodable block, or octets outside blocks, for `rejects.ndjson`."""

    offset: int
    octets: int
    code: RejectCode
    reason: str
    begin: int
    category: int = -1
    source: int = -1


@dataclass(frozen=True)
class Rows:
    """Location of records.

    Attributes
    ----------
    order : int64[n]
        Order among the records of the file.
    source : int64[n]
        Source.
    begin, end : int64[n]
        Octets in the data of the file.
    offset : int64[n]
        Offset in the file.
    received_s : float64[n]
        Recorder's time, s; NaN for none.
    """

    order: Integers
    source: Integers
    begin: Integers
    end: Integers
    offset: Integers
    received_s: Numbers


def selected_rows(rows: Rows, own: Flags) -> Rows:
    """Return some of the records."""
    return Rows(**{one.name: getattr(rows, one.name)[own] for one in fields(Rows)})


@dataclass
class Gathered:
    """Decoded content of a file.

    Attributes
    ----------
    blocks : Blocks
        The blocks.
    targets, services : list
        Rows and columns of records, by category.
    tracks : list
        Rows and columns of system tracks.
    status : list
        Rows and columns of sensor status.
    records : Counter
        Records by category and source.
    items : Counter
        Items by category, source and name.
    octets : Counter
        Octets by disposition: framing, decoded, skipped, quarantined.
    skipped : Counter
        Skipped blocks by category.
    unfit : Counter
        Blocks quarantined because their source fits no known edition, by category and source.
    broken : list of Broken
        Undecodable octets.
    """

    blocks: Blocks
    targets: list[tuple[int, Rows, Targets]] = field(default_factory=list)
    services: list[tuple[int, Rows, Services]] = field(default_factory=list)
    tracks: list[tuple[Rows, pl.DataFrame]] = field(default_factory=list)
    status: list[tuple[Rows, pl.DataFrame]] = field(default_factory=list)
    records: Counter[tuple[int, int]] = field(default_factory=Counter)
    items: Counter[tuple[int, int, str]] = field(default_factory=Counter)
    octets: Counter[str] = field(default_factory=Counter)
    skipped: Counter[int] = field(default_factory=Counter)
    unfit: Counter[tuple[int, int]] = field(default_factory=Counter)
    broken: list[Broken] = field(default_factory=list)


def gather(
    blocks: Blocks,
    editions: Editions,
    at_once: int = BLOCKS_AT_ONCE,
    watch: Callable[[Walked, Rows], None] | None = None,
) -> Gathered:
    """Decode the blocks of a file.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    editions : Editions
        Layouts; those of new sources are added.
    at_once : int
        Blocks decoded at a time; only the lengths of the lists depend on it.
    watch : callable or None
        Called with the records of each category and source.

    Returns
    -------
    Gathered
        Columns, counts and undecodable octets.
    """
    sources = sources_of(blocks)
    editions.detect(blocks, sources)
    return decode_blocks(blocks, sources, editions, at_once, watch)


# The last gap of a file that ends too early; those of a capture are in no order.
def _mark_truncated(gathered: Gathered) -> None:
    blocks = gathered.blocks
    for number, (_, octets, reason) in enumerate(blocks.gaps):
        if reason == CUT_PACKET:
            _truncate(gathered, number, "packet", f"{octets} octets")
            return
    if blocks.cut:
        number = len(gathered.broken) - 1
        there = gathered.broken[number].octets
        counted = "1 octet" if there == 1 else f"{there} octets"
        # Without all octets of the length, it is unknown.
        after = f"{there} of {blocks.cut} octets" if there >= HEAD else counted
        what = _UNITS.get(blocks.form, "block")
        _truncate(gathered, number, what, after)


def _truncate(gathered: Gathered, number: int, what: str, after: str) -> None:
    broken = gathered.broken[number]
    reason = f"the file ends inside the {what} at octet {broken.offset}, after {after}"
    gathered.broken[number] = replace(broken, code=RejectCode.TRUNCATED, reason=reason)


def decode_blocks(
    blocks: Blocks,
    sources: Integers,
    editions: Editions,
    at_once: int = BLOCKS_AT_ONCE,
    watch: Callable[[Walked, Rows], None] | None = None,
    *,
    named: Integers | None = None,
    measurements_only: bool = False,
    with_aircraft_data: bool = True,
) -> Gathered:
    """Decode blocks whose layouts have been detected.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    sources : int64[n]
        Source of each block.
    editions : Editions
        Their layouts.
    at_once, watch
        As in `gather`.
    named : int64[n], optional
        Source of each block under which its edition was detected, if not its own.
    measurements_only : bool
        Omit item counts, and the data of another SDPS.
    with_aircraft_data : bool
        Read the aircraft-derived data of target reports.

    Returns
    -------
    Gathered
        Columns, counts and undecodable octets.
    """
    gathered = Gathered(blocks)
    gathered.octets["framing"] = blocks.framing
    for offset, octets, reason in blocks.gaps:
        if reason == PADDING:
            gathered.octets["framing"] += octets
            continue
        gathered.broken.append(Broken(offset, octets, RejectCode.MALFORMED_BLOCK, reason, offset))
    _mark_truncated(gathered)
    named = sources if named is None else named
    known, numbers = editions.layouts(blocks, named)
    _skip(gathered, np.flatnonzero(numbers == UNKNOWN))
    _quarantine_unfit(gathered, np.flatnonzero(numbers == UNFIT), named, editions)
    for first in range(0, len(numbers), at_once):
        part = numbers[first : first + at_once]
        for number in distinct(part[part >= 0]).tolist():
            own = first + np.flatnonzero(part == number)
            walked, rows = _decode(gathered, own, sources[own], known[number])
            if not len(rows.order):
                continue
            columns = Columns(walked, blocks.data, with_aircraft_data)
            _keep(gathered, rows, walked.program.layout.category, columns)
            if not measurements_only:
                _count_items(gathered, rows, walked)
                _keep_other_sdps(gathered, rows, columns)
            if watch is not None:
                watch(walked, rows)
    gathered.broken.sort(key=lambda one: one.offset)
    gathered.octets["quarantined"] = sum(one.octets for one in gathered.broken)
    return gathered


def _skip(gathered: Gathered, own: Integers) -> None:
    """Count skipped categories; quarantine unknown ones."""
    blocks = gathered.blocks
    for block in own.tolist():
        begin, end = int(blocks.begins[block]), int(blocks.ends[block])
        category = int(blocks.data[begin])
        if category in SKIPPED:
            gathered.skipped[category] += 1
            gathered.octets["skipped"] += end - begin
            continue
        reason = f"category {category:03d} is unknown"
        gathered.broken.append(
            Broken(
                int(blocks.offsets[block]),
                end - begin,
                RejectCode.UNKNOWN_KIND,
                reason,
                begin,
                category,
            )
        )


def _quarantine_unfit(
    gathered: Gathered, own: Integers, sources: Integers, editions: Editions
) -> None:
    """Quarantine the blocks of sources that fit no known edition."""
    blocks = gathered.blocks
    for block in own.tolist():
        begin, end = int(blocks.begins[block]), int(blocks.ends[block])
        category, source = int(blocks.data[begin]), int(sources[block])
        gathered.unfit[category, source] += 1
        gathered.broken.append(
            Broken(
                offset=int(blocks.offsets[block]),
                octets=end - begin,
                code=RejectCode.MALFORMED_BLOCK,
                reason=editions.why_unfit(category, source),
                begin=begin,
                category=category,
                source=source,
            )
        )


def _decode(
    gathered: Gathered, own: Integers, sources: Integers, layout: Layout
) -> tuple[Walked, Rows]:
    """Decode blocks of one layout; those that do not fit are quarantined."""
    blocks = gathered.blocks
    begins, ends = blocks.begins[own], blocks.ends[own]
    walked = walk(program_of(layout), blocks.data, begins + 3, ends)
    faulty = walked.faults[:, 0] != _kernels.FITS
    for place in np.flatnonzero(faulty).tolist():
        gathered.broken.append(_fault(blocks, int(own[place]), int(sources[place]), walked, place))
    gathered.octets["decoded"] += int((ends - begins)[~faulty].sum())
    rows = _rows(blocks, own, sources, walked)
    for source, count in zip(*np.unique(rows.source, return_counts=True), strict=True):
        gathered.records[layout.category, int(source)] += int(count)
    return walked, rows


def _keep(gathered: Gathered, rows: Rows, category: int, columns: Columns) -> None:
    for own, targets in read_targets(category, columns):
        gathered.targets.append((category, selected_rows(rows, own), targets))
    services = read_services(category, columns)
    if services is not None:
        gathered.services.append((category, rows, services))


def _keep_other_sdps(gathered: Gathered, rows: Rows, columns: Columns) -> None:
    category = columns.walked.program.layout.category
    if category == SYSTEM_TRACKS:
        gathered.tracks.append((rows, read_system_tracks(columns)))
    if category == SENSOR_STATUS:
        gathered.status.append((rows, read_status(columns)))


def _fault(blocks: Blocks, block: int, source: int, walked: Walked, place: int) -> Broken:
    fault, at, node = (int(value) for value in walked.faults[place])
    layout = walked.program.layout
    item = walked.program.wrong_item(node)
    begin, end = int(blocks.begins[block]), int(blocks.ends[block])
    where = f"{'item ' if node >= 0 else ''}{item}: " if item else ""
    return Broken(
        offset=int(blocks.offsets[block]),
        octets=end - begin,
        code=RejectCode.MALFORMED_BLOCK,
        reason=(
            f"category {layout.category:03d} of {source_name(source)}, edition "
            f"{layout.editions[0]}, {where}{REASONS[fault]}, at octet {at - begin} of the block"
        ),
        begin=begin,
        category=layout.category,
        source=source,
    )


def _rows(blocks: Blocks, own: Integers, sources: Integers, walked: Walked) -> Rows:
    block = own[walked.records[:, 0]]
    columns = Columns(walked, blocks.data)
    first = np.searchsorted(walked.records[:, 0], walked.records[:, 0], side="left")
    area, system = columns.integers("010", "SAC"), columns.integers("010", "SIC")
    begin = walked.records[:, 1]
    return Rows(
        order=block * _RECORDS_OF_BLOCK + np.arange(len(block)) - first,
        # In category 001 only the first record of a block has the source.
        source=np.where(area < 0, sources[walked.records[:, 0]], area << 8 | system),
        begin=begin,
        end=walked.records[:, 2],
        offset=begin - blocks.begins[block] + blocks.offsets[block],
        received_s=blocks.received_s[block],
    )


def _count_items(gathered: Gathered, rows: Rows, walked: Walked) -> None:
    category, names = walked.program.layout.category, walked.program.names
    items = [k for k, name in enumerate(names) if "/" not in name and "+" not in name]
    for source in distinct(rows.source).tolist():
        present = (walked.starts[rows.source == source][:, items] >= 0).sum(axis=0)
        for k, count in zip(items, present.tolist(), strict=True):
            if count:
                gathered.items[category, source, names[k]] += count
