"""Compiled splitting of datagrams into blocks."""

from multiradar_compiled.kernels import loop
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
