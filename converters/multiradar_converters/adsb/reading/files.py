"""Parsing of trajectory files into columns: JSON lists, JSON lines, JSON columns, CSV, traces.

=========== =====================================================================================
form        what it is
=========== =====================================================================================
list        `[{"timestamp": 1533101250000, "icao24": "3003ae", …}, …]`
lines       such objects one after another
columns     `{"timestamp": {"0": 1533101250000, …}, …}`, as pandas writes tables; held in memory
csv         a line of names, then a line per record; comma, semicolon or tab
trace       a trace of readsb or tar1090, see `trace`
feeds       what a receiver sends, see `feeds.recorded`
=========== =====================================================================================

The form is detected from the content, not from the name.
"""

import codecs
import itertools
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from multiradar_converters.adsb.reading import cells, trace
from multiradar_converters.adsb.reading.batches import Batch, batch_of, read_columns, read_objects
from multiradar_converters.adsb.reading.layout import Layout, lay_out
from multiradar_converters.adsb.reading.splitting import (
    RECORD_BYTES_MAX,
    Elements,
    Fault,
    Lines,
    Piece,
)
from multiradar_converters.adsb.reading.unpacking import Unpacked, read_text
from multiradar_converters.errors import LayoutError
from multiradar_converters.feeds import layouts, recorded
from multiradar_converters.feeds.decoder import FeedDecoder
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode

#: Maximum size of JSON columns, which cannot be read piece by piece, bytes.
COLUMNS_BYTES_MAX = 1 << 26

#: Number of first records from which the layout is detected.
_SAMPLES = 200
_COLUMNS = re.compile(rb'\s*\{\s*"(?:[^"\\]|\\.)*"\s*:\s*\{')
#: A list of records as the first member of an object, as interfaces of web services give it.
_WRAPPED = re.compile(rb'\s*\{\s*"(?:[^"\\]|\\.)*"\s*:\s*\[\s*\{')
#: Forms that other members of an object may follow.
_WITHIN_OBJECTS = ("trace", "wrapped list")
_SEPARATORS = (b",", b";", b"\t")


@dataclass
class Source:
    """An open file.

    Attributes
    ----------
    file : str
        Its name.
    form : str
        Its form.
    layout : Layout
        Layout of its records.
    unpacked : Unpacked
        Counts bytes.
    batches : iterator of Batch
        Its records.
    lines : Lines or None
        Counts lines, of CSV and of feeds.
    is_feed : bool
        Whether it is a recorded feed.
    """

    file: str
    form: str
    layout: Layout
    unpacked: Unpacked
    batches: Iterator[Batch]
    lines: Lines | None = None
    is_feed: bool = False


def open_source(path: Path, progress: Callable[[int], None], utc_offset_s: float = 0.0) -> Source:
    """Open a file.

    Parameters
    ----------
    path : Path
        The file.
    progress : callable
        Called with the number of bytes read.
    utc_offset_s : float
        Local time of BaseStation messages minus UTC, s.

    Returns
    -------
    Source
        Its layout and its records.

    Raises
    ------
    LayoutError
        It cannot be read, or its form is unknown.
    """
    unpacked = Unpacked(path)
    blocks = read_text(unpacked, progress)
    head = next(blocks, b"").removeprefix(codecs.BOM_UTF8)
    while not head.strip() and (block := next(blocks, b"")):
        head = block
    file = path.name
    first = head.lstrip()[:1]
    if not first:
        msg = f"{path}: no trajectories: {unpacked.damage or 'the file is empty'}"
        raise LayoutError(msg)
    if first == b"[":
        return _list(file, unpacked, head, blocks)
    if first == b"{" and trace.TRACE.search(head):
        return _trace(file, unpacked, head, blocks)
    head = _whole_line(head, blocks)
    form = recorded.form_of(head)
    if form is not None:
        return _feed(form, file, unpacked, itertools.chain([head], blocks), utc_offset_s)
    if first != b"{":
        return _csv(file, unpacked, head, blocks)
    return _objects(file, unpacked, head, blocks)


def _whole_line(head: bytes, blocks: Iterator[bytes]) -> bytes:
    """Return the text with what is missing of a snapshot at its beginning."""
    while recorded.is_cut(head) and len(head) < recorded.SNAPSHOT_BYTES_MAX:
        block = next(blocks, b"")
        if not block:
            break
        head += block
    return head


def _before(unpacked: Unpacked, head: bytes) -> int:
    """Return the byte offset of a head in the file."""
    return unpacked.text_bytes - len(head)


def _list(
    file: str, unpacked: Unpacked, head: bytes, blocks: Iterator[bytes], form: str = "list"
) -> Source:
    begin = head.index(b"[") + 1
    elements = Elements(_before(unpacked, head) + begin)
    return _json(form, file, unpacked, elements, itertools.chain([head[begin:]], blocks))


def _objects(file: str, unpacked: Unpacked, head: bytes, blocks: Iterator[bytes]) -> Source:
    if _WRAPPED.match(head):
        return _list(file, unpacked, head, blocks, "wrapped list")
    if _COLUMNS.match(head):
        return _of_columns(file, unpacked, head, blocks)
    elements = Elements(_before(unpacked, head))
    return _json("lines", file, unpacked, elements, itertools.chain([head], blocks))


def _json(
    form: str, file: str, unpacked: Unpacked, elements: Elements, blocks: Iterator[bytes]
) -> Source:
    pieces = _element_pieces(elements, blocks, unpacked, form)
    first: list[Piece] = []
    for piece in pieces:
        first.append(piece)
        if sum(len(each.begins) for each in first) >= _SAMPLES:
            break
    layout = _layout_of_objects(file, first)
    return _source(form, file, layout, unpacked, itertools.chain(first, pieces))


def _source(
    form: str, file: str, layout: Layout, unpacked: Unpacked, pieces: Iterator[Piece]
) -> Source:
    cells_of = partial(cells.object_cells, layout=layout)
    batches = (batch_of(piece, layout, cells_of, read_objects) for piece in pieces)
    return Source(file, form, layout, unpacked, batches)


def _element_pieces(
    elements: Elements, blocks: Iterator[bytes], unpacked: Unpacked, form: str
) -> Iterator[Piece]:
    for block in blocks:
        yield from elements.push(block)
    if unpacked.damage or form == "lines" or elements.ended:
        why = unpacked.damage or "the text ends in the middle of a record"
    else:
        why = "the list is incomplete"
    fault = elements.finish(why)
    if fault is None and (unpacked.damage or (form != "lines" and not elements.ended)):
        fault = Fault(unpacked.text_bytes, b"", RejectCode.TRUNCATED, why)
    if fault is not None:
        yield _fault_piece(fault)
    if elements.rest and form not in _WITHIN_OBJECTS:
        reason = "unexpected data after the list"
        yield _fault_piece(
            Fault(elements.rest_place, elements.rest, RejectCode.MALFORMED_JSON, reason)
        )


def _fault_piece(fault: Fault) -> Piece:
    none = np.empty(0, dtype=np.int64)
    return Piece(np.frombuffer(b"", dtype=np.uint8), none, none, none, [fault])


def _layout_of_objects(file: str, pieces: list[Piece]) -> Layout:
    names: dict[str, list[str]] = {}
    raws = (piece.raw(k) for piece in pieces for k in range(len(piece.begins)))
    for raw in itertools.islice(raws, _SAMPLES):
        try:
            pairs = cells.object_pairs(raw)
        except RejectedError:
            # Reported with its place when the record is read.
            continue
        for name, value in pairs:
            names.setdefault(name, []).append(cells.json_text(value))
    if not names:
        msg = f"{file}: contains no JSON objects; expected one object per record"
        raise LayoutError(msg)
    return lay_out(file, list(names), names)


def _trace(file: str, unpacked: Unpacked, head: bytes, blocks: Iterator[bytes]) -> Source:
    match = trace.TRACE.search(head)
    begin = match.end() if match else 0
    cells_of = trace.trace_reader(file, head[:begin])
    elements = Elements(_before(unpacked, head) + begin, b"[")
    pieces = _element_pieces(elements, itertools.chain([head[begin:]], blocks), unpacked, "trace")
    batches = (batch_of(piece, trace.LAYOUT, cells_of, None) for piece in pieces)
    return Source(file, "trace", trace.LAYOUT, unpacked, batches)


def _of_columns(file: str, unpacked: Unpacked, head: bytes, blocks: Iterator[bytes]) -> Source:
    text = bytearray(head)
    for block in blocks:
        text += block
        if len(text) > COLUMNS_BYTES_MAX:
            msg = (
                f"{file}: too large: JSON columns may be at most {COLUMNS_BYTES_MAX} bytes, "
                "because they are read as a whole; use a list of records"
            )
            raise LayoutError(msg)
    if unpacked.damage:
        msg = f"{file}: the JSON columns are incomplete: {unpacked.damage}"
        raise LayoutError(msg)
    try:
        table = json.loads(text)
        columns = {str(name): dict(column) for name, column in table.items()}
    except (ValueError, TypeError, RecursionError) as error:
        msg = f"{file}: expected JSON columns, each an object keyed by row"
        raise LayoutError(msg) from error
    rows = list(dict.fromkeys(itertools.chain.from_iterable(columns.values())))
    lines = (
        json.dumps({name: column.get(row) for name, column in columns.items()}).encode() + b"\n"
        for row in rows
    )
    elements = Elements(0)
    pieces: list[Piece] = []
    row = 0
    for group in _grouped(lines):
        for piece in elements.push(group):
            count = len(piece.begins)
            places = row + np.arange(count)
            pieces.append(Piece(piece.text, piece.begins, piece.ends, places, piece.faults))
            row += count
    return _source("columns", file, _layout_of_objects(file, pieces), unpacked, iter(pieces))


def _grouped(lines: Iterator[bytes]) -> Iterator[bytes]:
    while group := b"".join(itertools.islice(lines, 4096)):
        yield group


def _csv(file: str, unpacked: Unpacked, head: bytes, blocks: Iterator[bytes]) -> Source:
    if b"\0" in head or (len(head) > RECORD_BYTES_MAX and b"\n" not in head[:RECORD_BYTES_MAX]):
        msg = f"{file}: neither JSON nor CSV with a header line"
        raise LayoutError(msg)
    lines = Lines()
    pieces = _line_pieces(lines, itertools.chain([head], blocks), unpacked)
    # Overlong lines may precede the names.
    before: list[Fault] = []
    header = None
    for piece in pieces:
        before += piece.faults
        if len(piece.begins):
            header = piece
            break
    if header is None:
        msg = f"{file}: neither JSON nor CSV with a header line"
        raise LayoutError(msg)
    separator = max(_SEPARATORS, key=header.raw(0).count)
    names, samples = _sampled(file, header, separator)
    layout = lay_out(file, names, samples, separator)
    rest = Piece(header.text, header.begins[1:], header.ends[1:], header.places[1:], before)
    cells_of = partial(cells.line_cells, layout=layout)
    batches = (
        batch_of(piece, layout, cells_of, read_columns) for piece in itertools.chain([rest], pieces)
    )
    return Source(file, "csv", layout, unpacked, batches, lines)


def _feed(
    form: layouts.Form, file: str, unpacked: Unpacked, blocks: Iterator[bytes], utc_offset_s: float
) -> Source:
    decoder = FeedDecoder(utc_offset_s=utc_offset_s)
    lines = recorded.lines_of(form)
    if lines is None:
        batches = recorded.batches_of_text(decoder, file, blocks)
    else:
        batches = recorded.batches_of_lines(decoder, _line_pieces(lines, blocks, unpacked))
    layout = layouts.of_form(form)
    return Source(file, form, layout, unpacked, batches, lines, is_feed=True)


def _sampled(file: str, piece: Piece, separator: bytes) -> tuple[list[str], dict[str, list[str]]]:
    """Read the names of the columns, and their values in the first lines."""
    try:
        names = cells.split_line(piece.raw(0), separator)
    except RejectedError as error:
        msg = f"{file}: neither JSON nor CSV with a header line: {error.reason}"
        raise LayoutError(msg) from error
    samples: dict[str, list[str]] = {name: [] for name in names}
    for k in range(1, min(len(piece.begins), _SAMPLES)):
        try:
            fields = cells.split_line(piece.raw(k), separator)
        except RejectedError:
            # Reported with its place when the record is read.
            continue
        for name, text in zip(names, fields, strict=False):
            samples[name].append(text)
    return names, samples


def _line_pieces(lines: Lines, blocks: Iterator[bytes], unpacked: Unpacked) -> Iterator[Piece]:
    for block in blocks:
        yield from lines.push(block)
    if unpacked.damage:
        yield _fault_piece(
            Fault(lines.lines + 1, lines.carry, RejectCode.TRUNCATED, unpacked.damage)
        )
    else:
        yield from lines.push(b"", at_end=True)
