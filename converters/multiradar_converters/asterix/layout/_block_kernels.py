"""Compiled search for blocks in a stream of octets, and comparison of their records.

Programs and `starts` as in `_kernels`.
"""

import numpy as np

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.asterix.layout._kernels import (
    _FX,
    FITS,
    Octets,
    Places,
    Words,
    record_end,
)

# Maximum consecutive blocks accepted although their records do not fit.
_HOPS_MAX = 3
# After invalid bytes, blocks of at most so many octets are found again, by their first records;
# bounds the search.
_FOUND_MAX, _TRIED_MAX = 4096, 16


@loop
def split_blocks(
    data: Octets,
    at: int,
    trailer: int,
    nodes: Words,
    profiles: Words,
    layouts: Words,
    categories: Words,
    starts: Places,
    blocks: Words,
    gaps: Words,
) -> tuple[int, int, int]:
    """Split a stream into blocks; skip invalid bytes.

    A block is accepted if its length fits into the remaining bytes and its records fit a layout of
    its category. A block whose records do not fit is accepted, too, if consecutive blocks from its
    end reach one whose records fit, one of the same category and source, or the end of the bytes,
    and no two fitting blocks lie within it; but not after invalid bytes.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    at : int
        Begin.
    trailer : int
        Trailer octets after each block.
    nodes, profiles, layouts, categories : int64 [n, 5], [l, 2, places], [l, 3], [256, 2]
        All layouts: concatenated nodes; profiles; first node, end of nodes and chooser of each
        layout; first layout of each category and their number.
    starts : int32[n]
        Scratch for the nodes of one layout.
    blocks : int64[n, 2]
        Filled: begin and end of each block.
    gaps : int64[m, 2]
        Filled: begin and end of invalid bytes.

    Returns
    -------
    tuple of int
        Blocks, gaps, and the end position: earlier than the end if an array is full.
    """
    count = 0
    gap_count = 0
    lost = -1
    size = len(data)
    while at < size and count < len(blocks) and gap_count < len(gaps):
        end = _block_end(data, at, trailer)
        if end == 0:
            believed = False
        elif lost < 0:
            believed = _fits(
                data, at, end, nodes, profiles, layouts, categories, starts, False
            ) or _is_followed(data, at, end, trailer, nodes, profiles, layouts, categories, starts)
        else:
            believed = _fits(data, at, end, nodes, profiles, layouts, categories, starts, True)
        if not believed:
            if lost < 0:
                after = _after_zeros(data, at)
                end = _block_end(data, after, trailer)
                fits = end > 0 and _fits(
                    data, after, end, nodes, profiles, layouts, categories, starts, False
                )
                if after > at and (fits or after == size):
                    gaps[gap_count, 0] = at
                    gaps[gap_count, 1] = after
                    gap_count += 1
                    at = after
                    continue
                lost = at
            at += 1
            continue
        if lost >= 0:
            gaps[gap_count, 0] = lost
            gaps[gap_count, 1] = at
            gap_count += 1
            lost = -1
        blocks[count, 0] = at
        blocks[count, 1] = end
        count += 1
        at = end + trailer
    if lost >= 0:
        if gap_count < len(gaps):
            gaps[gap_count, 0] = lost
            gaps[gap_count, 1] = at
            gap_count += 1
        else:
            at = lost
    return count, gap_count, min(at, size)


@in_loop
def _after_zeros(data: Octets, at: int) -> int:
    """Return the end of the zeros that begin here; no category is zero, so they are padding."""
    while at < len(data) and data[at] == 0:
        at += 1
    return at


@in_loop
def _block_end(data: Octets, at: int, trailer: int) -> int:
    """Return the end of the block, 0 if none begins here."""
    if at + 3 > len(data) or data[at] == 0:
        return 0
    length = int(data[at + 1]) << 8 | int(data[at + 2])
    if length < 4 or at + length + trailer > len(data):
        return 0
    return at + length


@loop
def _fits(
    data: Octets,
    at: int,
    end: int,
    nodes: Words,
    profiles: Words,
    layouts: Words,
    categories: Words,
    starts: Places,
    bounded: bool,
) -> bool:
    """Return whether the records of a block fit a layout of its category.

    If `bounded`, only the first records are tried, and only in blocks that are not too long.
    """
    if bounded and end - at > _FOUND_MAX:
        return False
    records_max = _TRIED_MAX if bounded else end
    first, number = categories[data[at], 0], categories[data[at], 1]
    for layout in range(first, first + number):
        program = nodes[layouts[layout, 0] : layouts[layout, 1]]
        place = at + 3
        reason = FITS
        count = 0
        while reason == FITS and place < end and count < records_max:
            count += 1
            reason, place, _node = record_end(
                data,
                place,
                end,
                profiles[layout],
                layouts[layout, 2],
                program,
                starts[: len(program)],
            )
        if reason == FITS:
            return True
    return False


@in_loop
def _source(data: Octets, at: int, end: int) -> int:
    """Return item 010 of the record, -1 if it does not begin with it."""
    if at >= end or data[at] & 0x80 == 0:
        return -1
    while at < end and data[at] & _FX:
        at += 1
    if at + 3 > end:
        return -1
    return int(data[at + 1]) << 8 | int(data[at + 2])


@loop
def _is_followed(
    data: Octets,
    at: int,
    end: int,
    trailer: int,
    nodes: Words,
    profiles: Words,
    layouts: Words,
    categories: Words,
    starts: Places,
) -> bool:
    """Return whether the length of a block whose records do not fit is plausible."""
    source = _source(data, at + 3, end)
    place = end + trailer
    for _ in range(_HOPS_MAX):
        if place == len(data):
            break
        next_end = _block_end(data, place, trailer)
        if next_end == 0:
            return False
        # A source that writes an unknown edition: each of its blocks confirms the others.
        if 0 <= source == _source(data, place + 3, next_end) and data[place] == data[at]:
            break
        if _fits(data, place, next_end, nodes, profiles, layouts, categories, starts, False):
            break
        place = next_end + trailer
    # Two consecutive blocks within it: its length is wrong.
    for place in range(at + 1, end):
        for step in range(2):
            next_end = _block_end(data, place, trailer)
            if next_end == 0 or not _fits(
                data, place, next_end, nodes, profiles, layouts, categories, starts, True
            ):
                break
            place = next_end + trailer
            if step == 1 or place == len(data):
                return False
    return True


@loop
def read_sources(data: Octets, begins: Words, ends: Words, out: Words) -> None:
    """Read item 010 of the first record of each block: 256 × SAC + SIC.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    begins, ends : int64[n]
        Begin and end of the records of each block.
    out : int64[n]
        Filled; -1 if the first record does not begin with it.
    """
    for k in range(len(begins)):
        out[k] = _source(data, begins[k], ends[k])


@loop
def hash_records(data: Octets, begins: Words, ends: Words, out: Words) -> None:
    """Fill `out` with the FNV-1a hash (64 bits) of the octets of each record."""
    for k in range(len(begins)):
        value = np.uint64(14695981039346656037)
        for at in range(begins[k], ends[k]):
            value = (value ^ np.uint64(data[at])) * np.uint64(1099511628211)
        out[k] = np.int64(value >> np.uint64(1))
