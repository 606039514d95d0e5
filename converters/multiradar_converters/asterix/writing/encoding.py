"""Encoding of records from columns, with the layout tables of the decoder.

A field is described once, in `categories`: position, bits and LSB.
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

#: A block of this size, header included, fits into a datagram without fragmentation.
BLOCK_OCTETS_MAX = 1400
HEADER_OCTETS = 3

_VALUE = "VALUE"


@dataclass(frozen=True)
class Written:
    """Concatenated records.

    Attributes
    ----------
    data : uint8[b]
        Their octets.
    ends : int64[m]
        End of each.
    """

    data: NDArray[np.uint8]
    ends: Integers


@dataclass
class Records:
    """Records of one layout, filled item by item.

    Attributes
    ----------
    layout : Layout
        Their layout; fixed, extended and compound items can be written.
    count : int
        Number of records.
    left_out : dict
        Number of values that were too large for their item and omitted with it, by item.
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
        """Fill an item, a sub-item or a further part with raw integers.

        Parameters
        ----------
        node : str
            Such as `040`, `380/ADR` or `080+1` for a second part.
        fields : mapping of int array_like, or int array_like
            Values by field, one for all records or (m,); other fields are 0. Not a mapping: the
            only field. Excess bits are truncated.
        where : bool array_like
            Which records have it. A compound item is present if a sub-item is, and a part if a
            later part is.

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
            Numbers in the unit of the field; with NaN the item is omitted.
        where : bool array_like
            Which records have it.
        clamped : bool
            Whether a number that is too large is written as the maximum (if the standard says
            "maximum value or above"); otherwise the item is omitted, and that is counted.
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
        """Return the octets of the records; each has at least one item."""
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
    """Convert numbers in the unit of a field to raw integers.

    Parameters
    ----------
    described : Field
        The field.
    numbers : float64[n]
        In its unit; without NaN.

    Returns
    -------
    raw : int64[n]
        Rounded and clamped to the range of the field.
    fits : bool[n]
        Whether the number is within the range.
    """
    least = -(1 << (described.bits - 1)) if described.form == "signed" else 0
    most = (1 << (described.bits - (described.form == "signed"))) - 1
    scaled = np.rint(numbers * (described.denominator / described.numerator))
    fits = (scaled >= least) & (scaled <= most)
    return np.clip(scaled, least, most).astype(np.int64), fits


def blocks(category: int, written: Written, octets_max: int = BLOCK_OCTETS_MAX) -> list[bytes]:
    """Group records into blocks.

    Parameters
    ----------
    category : int
        Their category.
    written : Written
        The records.
    octets_max : int
        Maximum size of a block, unless a single record is longer.

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
    # Sub-items of each compound node; nodes of items that cannot be written have none.
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
    # All writable nodes, and an octet of field specification for every seven of them.
    program = program_of(layout)
    plain = np.isin(program.nodes[:, KIND], (FIXED, EXTENDED, PART))
    compound = program.nodes[:, KIND] == COMPOUND
    bits: int = program.profiles.shape[1] + int(program.nodes[compound, COUNT].sum())
    return int(program.nodes[plain, OCTETS].sum()) + bits + 1
