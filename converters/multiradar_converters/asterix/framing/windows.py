"""The blocks of a recording in windows of bounded size, for recordings larger than the memory.

A window ends where a block or an envelope begins, so that none is divided. Each is split as if it
were a file of its own, after the header of the file, or of the section of a capture, it is in.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing import capture
from multiradar_converters.asterix.framing.containers import (
    BLOCKS,
    CAPTURE,
    GPS_HEADERS,
    GPS_TRAILER,
    Blocks,
    form_of,
    read_octets,
    split_octets,
)

#: Octets read at a time; bounds the memory.
WINDOW_OCTETS = 1 << 21
# A block, its trailer, and blocks that confirm it: those that begin in these last octets of a
# window belong to the next.
_MARGIN = 1 << 17


def block_windows(path: Path, octets: int = WINDOW_OCTETS) -> Iterator[Blocks]:
    """Yield the blocks of a file, window by window.

    Parameters
    ----------
    path : Path
        The file.
    octets : int
        Octets of a window, at least twice the longest block.

    Yields
    ------
    Blocks
        The blocks of a window; `size`, `framing` and `gaps` are those of the window, their sum over
        all windows is that of the file. Offsets are those in the file.

    Raises
    ------
    LayoutError
        The file cannot be read, is compressed, or is a capture of unknown type.
    """
    data = read_octets(path, 0, octets)
    size = path.stat().st_size
    form = form_of(path, data)
    head, at = np.empty(0, np.uint8), 0
    while True:
        last = at + len(data) - len(head) >= size
        blocks, _ = split_octets(path, data, form)
        end = len(data) if last else _end(blocks)
        yield _moved(_until(blocks, end), len(head), at - len(head))
        at += end - len(head)
        if last:
            return
        head = _head(data[:end], form)
        data = np.concatenate([head, read_octets(path, at, octets)])


def _head(data: NDArray[np.uint8], form: str) -> NDArray[np.uint8]:
    """Return the octets up to the end of a window without which the rest cannot be read."""
    if form in GPS_HEADERS:
        return data[: GPS_HEADERS[form]]
    if form == CAPTURE:
        return capture.head_of(data)
    return data[:0]


def _end(blocks: Blocks) -> int:
    """Return where the next window begins in the data of this one."""
    size = blocks.size
    if blocks.form in (BLOCKS, *GPS_HEADERS):
        limit = size - _MARGIN
        late = np.searchsorted(blocks.begins, limit)
        if late < len(blocks.begins):
            return int(blocks.begins[late])
        trailer = GPS_TRAILER if blocks.form in GPS_HEADERS else 0
        return max(limit, int(blocks.ends.max(initial=-trailer)) + trailer)
    # Incomplete fragments of a capture are gaps inside packets.
    gaps = [
        (at, octets)
        for at, octets, reason in blocks.gaps
        if blocks.form != CAPTURE or reason == capture.CUT_PACKET
    ]
    at, octets = max(gaps, default=(size, 0))
    # More than an envelope are octets of another form; they are quarantined.
    return at if at + octets == size and octets < _MARGIN else size


def _until(blocks: Blocks, end: int) -> Blocks:
    """Return the blocks and gaps before an octet of the data; the rest belongs to the next."""
    if end == blocks.size:
        return blocks
    own, trailers = np.ones(len(blocks.begins), dtype=np.bool_), 0
    if blocks.form in (BLOCKS, *GPS_HEADERS):
        own = blocks.begins < end
        trailers = GPS_TRAILER * int((~own).sum()) if blocks.form in GPS_HEADERS else 0
    return replace(
        blocks,
        size=end,
        begins=blocks.begins[own],
        ends=blocks.ends[own],
        offsets=blocks.offsets[own],
        received_s=blocks.received_s[own],
        gaps=[
            (at, min(octets, end - at), reason) for at, octets, reason in blocks.gaps if at < end
        ],
        framing=blocks.framing - trailers,
        cut=0,
    )


def _moved(blocks: Blocks, head: int, moved: int) -> Blocks:
    """Return blocks with the offsets of the file, without the repeated header of the file."""
    return replace(
        blocks,
        size=blocks.size - head,
        framing=blocks.framing - head,
        offsets=blocks.offsets + moved,
        gaps=[(at + moved, octets, reason) for at, octets, reason in blocks.gaps],
    )
