"""Recorded feeds: what was received, in a file, or files of `aircraft.json`.

======================== =====================================================================
form                     how it is made
======================== =====================================================================
readsb lines             `nc HOST 30047 > FILE`: an aircraft a line
snapshots by line        `curl -s …/data/aircraft.json | jq -c . >> FILE`, again and again
snapshots                `aircraft.json`, `history_0.json`, or several in one file
BaseStation              `nc HOST 30003 > FILE`
mlat-server              `--write-csv`
======================== =====================================================================
"""

import re
from collections.abc import Iterable, Iterator

from multiradar_converters.adsb.reading.batches import Batch
from multiradar_converters.adsb.reading.splitting import RECORD_BYTES_MAX, Lines, Piece
from multiradar_converters.errors import LayoutError
from multiradar_converters.feeds import basestation, multilateration, readsb
from multiradar_converters.feeds.decoder import FeedDecoder
from multiradar_converters.feeds.layouts import Form
from multiradar_converters.vid.text.lines import RejectedError

#: Maximum size of a snapshot, and of a file of snapshots spanning several lines, bytes.
SNAPSHOT_BYTES_MAX = 1 << 26

# A recording may begin within a line.
_LINES_TRIED = 10
_NAMES = re.compile(rb'"(?:now|messages|files|ac|aircraft)"\s*:')
_LIST = re.compile(rb'"(?:aircraft|ac)"\s*:\s*\[')
_HEAD_BYTES = 1 << 16


def is_cut(head: bytes) -> bool:
    """Return whether the text is the beginning of a snapshot that is longer than it."""
    text = head.lstrip()
    return b"\n" not in text and text.startswith(readsb.BEGIN) and _is_snapshot(text)


def form_of(head: bytes) -> Form | None:
    """Return the form of a recorded feed by the beginning of its text; None if it is none."""
    text = head.lstrip()
    # A column of times may precede one of addresses in CSV with a line of names, too.
    if multilateration.BEGIN.match(text):
        return "mlat-server"
    forms = (_form_of_line(line) for line in text.split(b"\n", _LINES_TRIED)[:_LINES_TRIED])
    found = next((form for form in forms if form is not None), None)
    if found is None and text.startswith(readsb.BEGIN) and _is_snapshot(text):
        return "snapshots"
    return found


def _form_of_line(line: bytes) -> Form | None:
    if basestation.BEGIN.match(line):
        return "BaseStation"
    if not line.startswith(readsb.BEGIN):
        return None
    try:
        values = readsb.parsed(line.strip().decode("latin-1"))
    except RejectedError:
        return None
    if readsb.is_snapshot(values):
        return "snapshots by line"
    return "readsb lines" if "now" in values and "hex" in values else None


def _is_snapshot(text: bytes) -> bool:
    start = text[:_HEAD_BYTES]
    return _LIST.search(start) is not None and _NAMES.search(start[:200]) is not None


def lines_of(form: Form) -> Lines | None:
    """Return the splitter of a form; None if its records are not lines."""
    if form == "snapshots":
        return None
    return Lines(SNAPSHOT_BYTES_MAX if form == "snapshots by line" else RECORD_BYTES_MAX)


def batches_of_lines(decoder: FeedDecoder, pieces: Iterable[Piece]) -> Iterator[Batch]:
    """Decode lines.

    Parameters
    ----------
    decoder : FeedDecoder
        The decoder.
    pieces : iterable of Piece
        The lines.

    Yields
    ------
    Batch
        Their reports.
    """
    for piece in pieces:
        for fault in piece.faults:
            decoder.reject(fault.place, fault.code, fault.reason, fault.raw)
        for k, place in enumerate(piece.places.tolist()):
            decoder.line(piece.raw(k), place)
        yield decoder.drain()


def batches_of_text(decoder: FeedDecoder, file: str, blocks: Iterable[bytes]) -> Iterator[Batch]:
    """Decode snapshots spanning several lines, which are held in memory.

    Parameters
    ----------
    decoder : FeedDecoder
        The decoder.
    file : str
        Name of the file, for messages.
    blocks : iterable of bytes
        The text.

    Yields
    ------
    Batch
        Their reports.

    Raises
    ------
    LayoutError
        There is more text than `SNAPSHOT_BYTES_MAX`.
    """
    text = bytearray()
    for block in blocks:
        text += block
        if len(text) > SNAPSHOT_BYTES_MAX:
            msg = (
                f"{file}: expected at most {SNAPSHOT_BYTES_MAX >> 20} MiB of multi-line snapshots, "
                "found more; write one snapshot per line (jq -c .)"
            )
            raise LayoutError(msg)
    decoder.document(bytes(text), 0)
    yield decoder.drain()
