"""Records of a layout from columns: the tables of the reader, read the other way round.

A field is described once, in `categories`: its place and bits, and what its last bit is worth.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar_converters.asterix.layout._kernels import (
    COMPOUND,
    COUNT,
    EXTENDED,
    FIRST,
    FIXED,
    KIND,
    OCTETS,
    PART,
)
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.layout.notation import Field, Layout
from multiradar_converters.asterix.layout.program import program_of
from multiradar_converters.asterix.writing import _writing_kernels as kernels

#: A block, with its three octets of header, fits into a datagram that is not cut up on the way.
BLOCK_OCTETS_MAX = 1400
HEADER_OCTETS = 3

_VALUE = "VALUE"


@dataclass(frozen=True)
class Written:
    """Records, one after another.

    Attributes
    ----------
    data : uint8[b]
        Their octets.
    ends : int64[m]
        Where each ends.
    """

    data: NDArray[np.uint8]
    ends: Integers


@dataclass
class Records:
    """Records of one layout that are being filled, item by item.

    Attributes
    ----------
    layout : Layout
        What they are records of: items that are fixed, extended or compound can be written.
    count : int
        How many records.
    left_out : dict
        How many values were too large for their item and left out with it, by item.
    """

    layout: Layout
    count: int
    left_out: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._program = program_of(self.layout)
        self._present = np.zeros((len(self._program.nodes), self.count), dtype=np.bool_)
        self._values: list[Integers] = []
        self._fields: list[tuple[int, int, int, int]] = []

    def put(
        self, node: str, fields: Mapping[str, ArrayLike] | ArrayLike, where: ArrayLike = True
    ) -> None:
        """Fill an item, a sub-item or a further part with whole numbers as they stand.

        Parameters
        ----------
        node : str
            Such as `040`, `380/ADR` or `080+1` for a second part.
        fields : mapping of int array_like, or int array_like
            Values by field, one for all records or (m,); fields that are not named are 0. Not a
            mapping: the only field. What is more than the bits of the field is cut off.
        where : bool array_like
            Which records have it. A compound item is there where a sub-item is, and a part where
            one after it is.

        Raises
        ------
        KeyError
            The layout has no such item or field.
        """
        number = self._program.places[node]
        self._mark(number, node, np.broadcast_to(np.asarray(where, dtype=np.bool_), self.count))
        for name, values in self._named(fields).items():
            described = self._program.fields[node, name]
            row = np.broadcast_to(np.asarray(values, dtype=np.int64), self.count)
            self._fields.append((number, described.begin, described.bits, len(self._values)))
            self._values.append(row)

    def measure(
        self,
        node: str,
        fields: Mapping[str, ArrayLike] | ArrayLike,
        where: ArrayLike = True,
        *,
        clamped: bool = False,
    ) -> None:
        """Fill an item, a sub-item or a further part with numbers in its unit.

        Parameters
        ----------
        node : str
            As for `put`.
        fields : mapping of array_like, or array_like
            Numbers in the unit of the field; NaN where there is none: the record is then without.
        where : bool array_like
            Which records have it.
        clamped : bool
            Whether a number that is too large is written as the largest there is (where the
            standard says "maximum value or above"); otherwise the record is without the item, and
            that is counted.
        """
        known = np.broadcast_to(np.asarray(where, dtype=np.bool_), self.count).copy()
        whole: dict[str, ArrayLike] = {}
        fitting = known.copy()
        for name, numbers in self._named(fields).items():
            described = self._program.fields[node, name]
            column = np.broadcast_to(np.asarray(numbers, dtype=np.float64), self.count)
            known &= ~np.isnan(column)
            whole[name], fits = raw_of(described, np.where(np.isnan(column), 0.0, column))
            if not clamped:
                fitting &= fits
        lost = int((known & ~fitting).sum())
        if lost:
            self.left_out[node] = self.left_out.get(node, 0) + lost
        self.put(node, whole, known & fitting)

    def written(self) -> Written:
        """Return the octets of the records; each has an item at least."""
        program = self._program
        rows = sorted(self._fields)
        fields = np.array([row[1:] for row in rows], dtype=np.int64).reshape(-1, 3)
        begins = np.searchsorted([row[0] for row in rows], np.arange(len(program.nodes) + 1))
        ranges = np.stack([begins[:-1], begins[1:]], axis=1).astype(np.int64)
        values = np.zeros((max(len(self._values), 1), self.count), dtype=np.int64)
        for number, column in enumerate(self._values):
            values[number] = column
        out = np.empty(self.count * _octets_max(self.layout), dtype=np.uint8)
        ends = np.empty(self.count, dtype=np.int64)
        size: int = kernels.write_records(
            self._present, values, program.profiles[0], _children(self.layout), program.nodes,
            fields, ranges, out, ends,
        )  # fmt: skip
        return Written(out[:size], ends)

    def _named(self, fields: Mapping[str, ArrayLike] | ArrayLike) -> dict[str, ArrayLike]:
        return dict(fields) if isinstance(fields, Mapping) else {_VALUE: fields}

    def _mark(self, number: int, node: str, where: Flags) -> None:
        self._present[number] |= where
        item, _, part = node.partition("+")
        if part:
            first = self._program.places[item]
            self._present[first] |= where
            self._present[self._program.nodes[first, FIRST] : number] |= where
        parent = item.partition("/")[0]
        if parent != item:
            self._present[self._program.places[parent]] |= where


def raw_of(described: Field, numbers: Numbers) -> tuple[Integers, Flags]:
    """Turn numbers in the unit of a field into whole numbers as they stand in a record.

    Parameters
    ----------
    described : Field
        The field.
    numbers : float64[n]
        In its unit; no NaN.

    Returns
    -------
    raw : int64[n]
        The nearest, at most the largest and at least the smallest that the field holds.
    fits : bool[n]
        Whether the number lies between these.
    """
    least = -(1 << (described.bits - 1)) if described.form == "signed" else 0
    most = (1 << (described.bits - (described.form == "signed"))) - 1
    scaled = np.rint(numbers * (described.denominator / described.numerator))
    fits = (scaled >= least) & (scaled <= most)
    return np.clip(scaled, least, most).astype(np.int64), fits


def blocks(category: int, written: Written, octets_max: int = BLOCK_OCTETS_MAX) -> list[bytes]:
    """Cut records into blocks.

    Parameters
    ----------
    category : int
        Their category.
    written : Written
        The records.
    octets_max : int
        A block is not longer, unless one record alone is.

    Returns
    -------
    list of bytes
        Blocks with as many whole records as fit, in order.
    """
    cut: list[bytes] = []
    ends = written.ends
    first, begin = 0, 0
    while first < len(ends):
        room = begin + octets_max - HEADER_OCTETS
        last = max(int(np.searchsorted(ends, room, side="right")), first + 1)
        body = written.data[begin : int(ends[last - 1])].tobytes()
        cut.append(bytes([category]) + (len(body) + HEADER_OCTETS).to_bytes(2, "big") + body)
        first, begin = last, int(ends[last - 1])
    return cut


@functools.cache
def _children(layout: Layout) -> NDArray[np.int64]:
    # Sub-items of each node that is compound; nodes of items that cannot be written have none.
    program = program_of(layout)
    compound = program.nodes[:, KIND] == COMPOUND
    width = int(program.nodes[compound, COUNT].max()) if compound.any() else 1
    children = np.full((len(program.nodes), width), -1, dtype=np.int64)
    for node in np.flatnonzero(compound).tolist():
        first, count = program.nodes[node, FIRST], program.nodes[node, COUNT]
        numbers = np.arange(first, first + count)
        children[node, :count] = np.where(program.nodes[numbers, KIND] >= 0, numbers, -1)
    return children


@functools.cache
def _octets_max(layout: Layout) -> int:
    # All nodes that can be written, and a field specification for every seven of them.
    program = program_of(layout)
    plain = np.isin(program.nodes[:, KIND], (FIXED, EXTENDED, PART))
    compound = program.nodes[:, KIND] == COMPOUND
    bits: int = program.profiles.shape[1] + int(program.nodes[compound, COUNT].sum())
    return int(program.nodes[plain, OCTETS].sum()) + bits + 1
