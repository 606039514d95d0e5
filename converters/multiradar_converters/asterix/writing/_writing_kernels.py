"""Compiled writing of records, the inverse of `_kernels.walk`.

References
----------
EUROCONTROL-SPEC-0149, part 1: field specification, extended and compound items; the loops are the
project's own.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop
from multiradar_converters.asterix.layout._kernels import (
    COMPOUND,
    COUNT,
    EXTENDED,
    FIRST,
    OCTETS,
    Octets,
    Words,
)

Flags = NDArray[np.bool_]

# Columns of written fields: first bit in the part; bits; row of the values.
BEGIN, BITS, ROW = 0, 1, 2
_FX, _SEVEN = 1, 7


@in_loop
def _write_part(
    k: int,
    node: int,
    at: int,
    values: Words,
    program: Words,
    fields: Words,
    ranges: Words,
    out: Octets,
) -> int:
    """Write the octets of a part; return their end."""
    end: int = at + program[node, OCTETS]
    for place in range(at, end):
        out[place] = 0
    for field in range(ranges[node, 0], ranges[node, 1]):
        value = values[fields[field, ROW], k]
        bit = fields[field, BEGIN]
        last = bit + fields[field, BITS]
        while bit < last:
            offset = bit & 7
            taken = min(8 - offset, last - bit)
            some = (value >> (last - bit - taken)) & ((1 << taken) - 1)
            out[at + (bit >> 3)] |= np.uint8(some << (8 - offset - taken))
            bit += taken
    return end


@loop
def _write_simple(
    k: int,
    node: int,
    at: int,
    present: Flags,
    values: Words,
    program: Words,
    fields: Words,
    ranges: Words,
    out: Octets,
) -> int:
    """Write a fixed item, or the present parts of an extended item."""
    end = _write_part(k, node, at, values, program, fields, ranges, out)
    if program[node, 0] == EXTENDED:
        for part in range(program[node, FIRST], program[node, FIRST] + program[node, COUNT]):
            if not present[part, k]:
                break
            out[end - 1] |= np.uint8(_FX)
            end = _write_part(k, part, end, values, program, fields, ranges, out)
    return end


@in_loop
def _write_specification(k: int, nodes: Words, at: int, present: Flags, out: Octets) -> int:
    """Write the presence bits of nodes, seven per octet; return the end of the octets."""
    last = -1
    for place in range(len(nodes)):
        if nodes[place] >= 0 and present[nodes[place], k]:
            last = place
    octets = last // _SEVEN + 1
    for number in range(octets):
        out[at + number] = 0 if number == octets - 1 else _FX
    for place in range(last + 1):
        if nodes[place] >= 0 and present[nodes[place], k]:
            out[at + place // _SEVEN] |= np.uint8(1 << (_SEVEN - place % _SEVEN))
    return at + octets


@loop
def write_records(
    present: Flags,
    values: Words,
    profile: Words,
    children: Words,
    program: Words,
    fields: Words,
    ranges: Words,
    out: Octets,
    ends: Words,
) -> int:
    """Write concatenated records.

    Parameters
    ----------
    present : bool[nodes, m]
        Nodes present in each record; a compound item has at least one sub-item.
    values : int64[rows, m]
        Raw values of the fields.
    profile : int64[places]
        Node of each position of the field specification, -1 for none.
    children : int64[nodes, c]
        Sub-items of each compound item, -1 for none.
    program : int64[nodes, 5]
        The layout, as for `_kernels.walk`.
    fields : int64[f, 3]
        Written fields, grouped by node: first bit, bits, row of `values`.
    ranges : int64[nodes, 2]
        First field of each node, and the end.
    out : uint8[b]
        Filled; large enough for the longest records.
    ends : int64[m]
        Filled: end of each record.

    Returns
    -------
    int
        Octets written.
    """
    at = 0
    for k in range(len(ends)):
        at = _write_specification(k, profile, at, present, out)
        for place in range(len(profile)):
            node = profile[place]
            if node < 0 or not present[node, k]:
                continue
            if program[node, 0] != COMPOUND:
                at = _write_simple(k, node, at, present, values, program, fields, ranges, out)
                continue
            at = _write_specification(k, children[node], at, present, out)
            for child in children[node]:
                if child >= 0 and present[child, k]:
                    at = _write_simple(k, child, at, present, values, program, fields, ranges, out)
        ends[k] = at
    return at
