"""Compiled splitting of datagrams into blocks."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.asterix.layout._block_kernels import split_blocks
from multiradar_converters.asterix.layout._kernels import Octets, Places, Words

# Minimum octets of a valid block.
_BLOCK_OCTETS_MIN = 4


@loop
def split_datagrams(
    data: Octets,
    begins: Words,
    ends: Words,
    nodes: Words,
    profiles: Words,
    layouts: Words,
    categories: Words,
    starts: Places,
    blocks: Words,
    gaps: Words,
) -> tuple[int, int, int]:
    """Split datagrams into blocks; a block never continues in the next datagram.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    begins, ends : int64[n]
        Begin and end of each datagram.
    nodes, profiles, layouts, categories, starts
        As for `split_blocks`.
    blocks, gaps : int64[m, 3]
        Filled: begin, end and datagram of each block, and of bytes outside blocks.

    Returns
    -------
    tuple of int
        Datagrams processed (fewer than n when the arrays are full), blocks, gaps.
    """
    count = 0
    gap_count = 0
    for datagram in range(len(begins)):
        begin, end = begins[datagram], ends[datagram]
        # Between gaps there are blocks.
        room = (end - begin) // _BLOCK_OCTETS_MIN + 2
        if count + room > len(blocks) or gap_count + room > len(gaps):
            return datagram, count, gap_count
        found, lost, _at = split_blocks(
            data[begin:end],
            0,
            0,
            nodes,
            profiles,
            layouts,
            categories,
            starts,
            blocks[count:],
            gaps[gap_count:],
        )
        for k in range(count, count + found):
            blocks[k, 0] += begin
            blocks[k, 1] += begin
            blocks[k, 2] = datagram
        for k in range(gap_count, gap_count + lost):
            gaps[k, 0] += begin
            gaps[k, 1] += begin
            gaps[k, 2] = datagram
        count += found
        gap_count += lost
    return len(begins), count, gap_count


@loop
def find_framing(
    data: Octets,
    begins: Words,
    ends: Words,
    known: NDArray[np.bool_],
    header_max: int,
    footer_max: int,
    found: Words,
) -> None:
    """Find the octets around the blocks of datagrams.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    begins, ends : int64[n]
        Begin and end of each datagram.
    known : bool[256]
        Whether blocks of each category are known.
    header_max, footer_max : int
        Maximum octets before and after the blocks.
    found : int64[n, 2]
        Filled: octets before and after the blocks; 0 and 0 if blocks of any category are all of
        it, -1 and -1 if no known block begins so early, or the rest is too long or a cut block.
    """
    for datagram in range(len(begins)):
        begin, end = begins[datagram], ends[datagram]
        found[datagram] = -1
        if _chained(data, begin, end, known, False) == end:
            found[datagram] = 0
            continue
        for header in range(min(header_max, end - begin) + 1):
            at = _chained(data, begin + header, end, known, True)
            if at == begin + header or end - at > footer_max:
                continue
            # A block of a known category whose length exceeds the rest.
            cut = at + 3 <= end and known[data[at]] and (data[at + 1] or data[at + 2] > 3)
            if not cut:
                found[datagram, 0] = header
                found[datagram, 1] = end - at
                break


@loop
def has_framing(
    data: Octets,
    begin: int,
    end: int,
    known: NDArray[np.bool_],
    header: int,
    footer: int,
) -> bool:
    """Return whether blocks of known categories are all between a header and a footer."""
    first, last = begin + header, end - footer
    return last > first and _chained(data, first, last, known, True) == last


@in_loop
def _chained(data: Octets, at: int, end: int, known: NDArray[np.bool_], of_known: bool) -> int:
    """Return the end of the blocks that follow each other by their lengths."""
    while at + 3 <= end and (known[data[at]] or not of_known):
        octets = int(data[at + 1]) << 8 | int(data[at + 2])
        if octets < _BLOCK_OCTETS_MIN or at + octets > end:
            break
        at += octets
    return at
