"""Compiled parsing of records and items, and reading of bits.

A *program* describes a layout in arrays, a row per *node*: an item, a sub-item or a further part of
an extended item. The begins of the nodes of a record are a row of `starts`.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Words = NDArray[np.int64]
Places = NDArray[np.int32]
Octets = NDArray[np.uint8]


# Kinds of nodes.
FIXED, EXTENDED, LIST, REPETITIVE, EXPLICIT, COMPOUND, RFS, PART = 0, 1, 2, 3, 4, 5, 6, 7
# Columns of a program: kind; octets; number of children or parts; the first; whether it ends with
# FX.
KIND, OCTETS, COUNT, FIRST, MORE = 0, 1, 2, 3, 4
# Reasons why a block cannot be decoded.
FITS, TOO_SHORT, NO_ITEM, ZERO_LENGTH, EMPTY_RECORD, LONG_FIELD_SPECIFICATION = 0, 1, 2, 3, 4, 5
# Maximum number of items of a profile.
PLACES_MAX = 64
_FX, _SEVEN = 1, 7


@in_loop
def _extended_end(
    data: Octets, at: int, end: int, node: int, program: Words, starts: Places
) -> tuple[int, int]:
    """Skip an extended item, including octets after the last part in the table."""
    place = at + program[node, OCTETS]
    if place > end:
        return TOO_SHORT, at
    more = program[node, MORE]
    part = program[node, FIRST]
    last = part + program[node, COUNT] - 1
    while more and data[place - 1] & _FX:
        octets = 1
        if part <= last:
            starts[part] = place
            octets = program[part, OCTETS]
            more = program[part, MORE]
            part += 1
        place += octets
        if place > end:
            return TOO_SHORT, at
    return FITS, place


@in_loop
def _list_end(data: Octets, at: int, end: int, octets: int) -> tuple[int, int]:
    place = at + octets
    while place <= end and data[place - 1] & _FX:
        place += octets
    return (FITS, place) if place <= end else (TOO_SHORT, at)


@loop
def _simple_end(
    data: Octets, at: int, end: int, node: int, program: Words, starts: Places
) -> tuple[int, int]:
    """Skip an item that is not compound; return the error, and its end."""
    starts[node] = at
    kind = program[node, KIND]
    octets = program[node, OCTETS]
    if kind == FIXED:
        place = at + octets
    elif kind == EXTENDED:
        return _extended_end(data, at, end, node, program, starts)
    elif kind == LIST:
        return _list_end(data, at, end, octets)
    elif at >= end:
        return TOO_SHORT, at
    elif kind == REPETITIVE:
        place = at + 1 + int(data[at]) * octets
    else:
        if data[at] == 0:
            return ZERO_LENGTH, at
        place = at + int(data[at])
    if place > end:
        return TOO_SHORT, at
    return FITS, place


@loop
def _compound_end(
    data: Octets, at: int, end: int, node: int, program: Words, starts: Places
) -> tuple[int, int, int]:
    """Skip a compound item; return the error, its end, and the invalid node."""
    starts[node] = at
    place = at
    count = program[node, COUNT]
    more = 1
    while more:
        if place >= end:
            return TOO_SHORT, at, node
        more = data[place] & _FX
        place += 1
    octets = place - at
    if octets * _SEVEN > PLACES_MAX:
        return LONG_FIELD_SPECIFICATION, at, node
    for k in range(octets * _SEVEN):
        if int(data[at + k // _SEVEN]) >> (_SEVEN - k % _SEVEN) & 1 == 0:
            continue
        child = program[node, FIRST] + k
        if k >= count or program[child, KIND] < 0:
            return NO_ITEM, place, node
        reason, place = _simple_end(data, place, end, child, program, starts)
        if reason != FITS:
            return reason, place, child
    return FITS, place, node


@loop
def _item_end(
    data: Octets, at: int, end: int, node: int, program: Words, starts: Places
) -> tuple[int, int, int]:
    if program[node, KIND] == COMPOUND:
        return _compound_end(data, at, end, node, program, starts)
    reason, place = _simple_end(data, at, end, node, program, starts)
    return reason, place, node


@loop
def _random_end(
    data: Octets, at: int, end: int, node: int, profile: Words, program: Words, starts: Places
) -> tuple[int, int, int]:
    """Skip items in random order, each preceded by its number."""
    starts[node] = at
    if at >= end:
        return TOO_SHORT, at, node
    place = at + 1
    for _ in range(data[at]):
        if place >= end:
            return TOO_SHORT, place, node
        number = int(data[place]) - 1
        if number < 0 or number >= len(profile) or profile[number] < 0:
            return NO_ITEM, place, node
        item = profile[number]
        if program[item, KIND] == RFS:
            return NO_ITEM, place, node
        reason, place, wrong = _item_end(data, place + 1, end, item, program, starts)
        if reason != FITS:
            return reason, place, wrong
    return FITS, place, node


@loop
def record_end(
    data: Octets, at: int, end: int, profiles: Words, chooser: int, program: Words, starts: Places
) -> tuple[int, int, int]:
    """Skip a record; return the error, its end (or that of the error) and node (-1: none)."""
    starts[:] = -1
    place = at
    more = 1
    while more:
        if place >= end:
            return TOO_SHORT, at, -1
        more = data[place] & _FX
        place += 1
    octets = place - at
    if octets * _SEVEN > PLACES_MAX:
        return LONG_FIELD_SPECIFICATION, at, -1
    profile = profiles[0]
    empty = True
    for k in range(octets * _SEVEN):
        if int(data[at + k // _SEVEN]) >> (_SEVEN - k % _SEVEN) & 1 == 0:
            continue
        if k >= len(profile) or profile[k] < 0:
            return NO_ITEM, place, -2 - k
        node = profile[k]
        empty = False
        if program[node, KIND] == RFS:
            reason, place, node = _random_end(data, place, end, node, profile, program, starts)
        else:
            reason, place, node = _item_end(data, place, end, node, program, starts)
        if reason != FITS:
            return reason, place, node
        if node == chooser and data[starts[node]] & 0x80:
            profile = profiles[1]
    if empty:
        return EMPTY_RECORD, at, -1
    return FITS, place, -1


@loop
def walk(
    data: Octets,
    begins: Words,
    ends: Words,
    profiles: Words,
    chooser: int,
    program: Words,
    starts: Places,
    records: Words,
    faults: Words,
) -> tuple[int, int]:
    """Parse blocks of one layout.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    begins, ends : int64[n]
        Begin and end of the records of each block.
    profiles : int64[2, places]
        Node of each position of the field specification, -1 for none.
    chooser : int
        The node whose first bit selects the second profile; -1 for none.
    program : int64[nodes, 5]
        The layout.
    starts : int32[m, nodes]
        Filled: begin of each node of each record, -1 if absent.
    records : int64[m, 3]
        Filled: block, begin and end of each record.
    faults : int64[n, 3]
        Filled: reason, position and node (-1: none, -2 - k: position k of the profile) of each
        block.

    Returns
    -------
    tuple of int
        Blocks processed (fewer than n when `starts` is full) and records.
    """
    count = 0
    for block in range(len(begins)):
        first = count
        at = begins[block]
        end = ends[block]
        faults[block, 0] = FITS
        while at < end:
            if count == len(starts):
                return block, first
            reason, place, node = record_end(
                data, at, end, profiles, chooser, program, starts[count]
            )
            if reason != FITS:
                faults[block, 0] = reason
                faults[block, 1] = place
                faults[block, 2] = node
                count = first
                break
            records[count, 0] = block
            records[count, 1] = at
            records[count, 2] = place
            count += 1
            at = place
    return len(begins), count


@loop
def read_bits(
    data: Octets, places: Places, begin: int, bits: int, signed: bool, absent: int, out: Words
) -> None:
    """Read a field of at most 62 bits of every record.

    Parameters
    ----------
    data : uint8[b]
        The bytes.
    places : int32[n]
        Begin of the part; negative if absent.
    begin, bits : int
        First bit in the part, and their number.
    signed : bool
        Whether the field is two's complement.
    absent : int
        Value of absent fields.
    out : int64[n]
        Filled.
    """
    for k in range(len(places)):
        if places[k] < 0:
            out[k] = absent
            continue
        value = 0
        last = begin + bits
        bit = begin
        while bit < last:
            offset = bit & 7
            taken = min(8 - offset, last - bit)
            octet = int(data[places[k] + (bit >> 3)])
            value = value << taken | (octet >> (8 - offset - taken)) & ((1 << taken) - 1)
            bit += taken
        if signed and value >> (bits - 1):
            value -= 1 << bits
        out[k] = value
