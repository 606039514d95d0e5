"""Layouts as arrays for the compiled parser, and parsing of blocks."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.catalogue import layouts
from multiradar_converters.asterix.layout.notation import Field, Item, Layout, Part

_KINDS = {
    "fixed": _kernels.FIXED,
    "extended": _kernels.EXTENDED,
    "list": _kernels.LIST,
    "repetitive": _kernels.REPETITIVE,
    "explicit": _kernels.EXPLICIT,
    "compound": _kernels.COMPOUND,
    "rfs": _kernels.RFS,
}
_ABSENT = -1
# In category 001, the first bit of this item distinguishes tracks from plots.
_CHOOSER = "020"
#: Records parsed at a time; bounds the memory.
RECORDS_MAX = 1 << 16

REASONS = {
    _kernels.TOO_SHORT: "extends past the end of the block",
    _kernels.NO_ITEM: "not defined in this edition",
    _kernels.ZERO_LENGTH: "has zero length",
    _kernels.EMPTY_RECORD: "the FSPEC is empty",
    _kernels.LONG_FIELD_SPECIFICATION: "FSPEC not terminated (FX set in the last octet)",
}


# Kinds of items that are not repeated.
_SINGLE = ("fixed", "extended")


@dataclass(frozen=True)
class Program:
    """A layout as arrays for `_kernels.walk`.

    Attributes
    ----------
    layout : Layout
        The layout.
    nodes : int64[n, 5]
        Its items, sub-items and further parts.
    names : tuple of str
        Names of the nodes, such as `040`, `130/SRL` or `020+1` for a second part.
    profiles : int64[p, places]
        Node of each position of the field specification, -1 for none.
    chooser : int
        Node whose first bit selects the second profile; -1 for none.
    """

    layout: Layout
    nodes: NDArray[np.int64]
    names: tuple[str, ...]
    profiles: NDArray[np.int64]
    chooser: int

    @functools.cached_property
    def places(self) -> dict[str, int]:
        """Return the number of each node by name."""
        return {name: number for number, name in enumerate(self.names)}

    @functools.cached_property
    def fields(self) -> dict[tuple[str, str], Field]:
        """Return the fields of items, further parts and sub-items by node and name."""
        found: dict[tuple[str, str], Field] = {}
        for name, item in self.layout.items().items():
            for one, path in ((item, name), *((m, f"{name}/{m.name}") for m in item.members if m)):
                for number, part in enumerate(one.parts):
                    node = f"{path}+{number}" if number else path
                    found |= {(node, field.name): field for field in part.fields if field.name}
        return found

    @functools.cached_property
    def bounded(self) -> dict[str, list[tuple[str, str]]]:
        """Return the nodes and names of the fields `time`, `LAT` and `LON` that are not repeated.

        A time is any field of a time of day.
        """
        items = self.layout.items()
        found: dict[str, list[tuple[str, str]]] = {"time": [], "LAT": [], "LON": []}
        for (node, name), described in self.fields.items():
            item, _, below = node.partition("/")
            whole = items[item.partition("+")[0]]
            one = next((m for m in whole.members if m and m.name == below), whole)
            if one.kind not in _SINGLE:
                continue
            if described.unit == "s" and described.bits == 24:
                found["time"].append((node, name))
            if name in ("LAT", "LON") and described.form == "signed" and described.unit == "deg":
                found[name].append((node, name))
        return found

    def wrong_item(self, node: int) -> str:
        """Return the name of the item at which parsing failed; empty for none."""
        if node >= 0:
            return self.names[node].partition("+")[0]
        return f"FRN {-1 - node}" if node < _ABSENT else ""


@dataclass(frozen=True)
class Walked:
    """Records of blocks of one layout.

    Attributes
    ----------
    program : Program
        The layout.
    records : int64[m, 3]
        Block, begin and end of each record.
    starts : int32[m, n]
        Begin of each node of each record, -1 if absent.
    faults : int64[b, 3]
        Reason (0: none), position and node of each block.
    """

    program: Program
    records: NDArray[np.int64]
    starts: NDArray[np.int32]
    faults: NDArray[np.int64]


class _Assembly:
    """Nodes in order: items first, then sub-items and parts, grouped by item."""

    def __init__(self) -> None:
        self.rows: list[list[int]] = []
        self.names: list[str] = []

    def add(self, name: str, *row: int) -> int:
        self.names.append(name)
        self.rows.append(list(row))
        return len(self.rows) - 1

    def reserve(self, name: str) -> int:
        return self.add(name, _ABSENT, 0, 0, 0, 0)

    def fill(self, node: int, name: str, item: Item) -> None:
        """Fill the row of an item; append its parts and members."""
        kind = _KINDS[item.kind]
        parts, members = item.parts, item.members
        first: Part | None = parts[0] if parts else None
        octets = first.octets if first else 0
        more = int(first.more) if first else 0
        count, below = 0, len(self.rows)
        if item.kind == "extended":
            count = len(parts) - 1
            for number, part in enumerate(parts[1:], 1):
                self.add(f"{name}+{number}", _kernels.PART, part.octets, 0, 0, int(part.more))
        elif members:
            count = len(members)
            children = [self.reserve(f"{name}/{one.name if one else '-'}") for one in members]
            for child, one in zip(children, members, strict=True):
                if one:
                    self.fill(child, f"{name}/{one.name}", one)
        self.rows[node] = [kind, octets, count, below, more]


# Programs by the identity of their layouts, which they keep: hashing a layout takes longer than
# parsing a window of its records.
_PROGRAMS: dict[int, Program] = {}


def program_of(layout: Layout) -> Program:
    """Return the layout as arrays."""
    known = _PROGRAMS.get(id(layout))
    if known is None:
        known = _PROGRAMS[id(layout)] = _assembled(layout)
    return known


def _assembled(layout: Layout) -> Program:
    assembly = _Assembly()
    items = layout.items()
    numbers = {name: assembly.reserve(name) for name in items}
    for name, item in items.items():
        assembly.fill(numbers[name], name, item)
    places = max(len(profile) for profile in layout.profiles)
    profiles = np.full((len(layout.profiles), places), _ABSENT, dtype=np.int64)
    for row, profile in zip(profiles, layout.profiles, strict=True):
        row[: len(profile)] = [numbers[item.name] if item else _ABSENT for item in profile]
    return Program(
        layout=layout,
        nodes=np.array(assembly.rows, dtype=np.int64),
        names=tuple(assembly.names),
        profiles=profiles,
        chooser=numbers[_CHOOSER] if len(layout.profiles) > 1 else _ABSENT,
    )


@dataclass(frozen=True)
class Catalogue:
    """All layouts as arrays for `_block_kernels.split_blocks`, which describes them."""

    nodes: NDArray[np.int64]
    profiles: NDArray[np.int64]
    layouts: NDArray[np.int64]
    categories: NDArray[np.int64]
    nodes_max: int


@functools.cache
def catalogue() -> Catalogue:
    """Return all layouts as arrays."""
    programs = [program_of(layout) for layout in layouts()]
    ends = np.cumsum([len(program.nodes) for program in programs])
    profiles = np.full((len(programs), 2, _kernels.PLACES_MAX), _ABSENT, dtype=np.int64)
    table = np.zeros((len(programs), 3), dtype=np.int64)
    categories = np.zeros((256, 2), dtype=np.int64)
    for number, program in enumerate(programs):
        rows, places = program.profiles.shape
        profiles[number, :rows, :places] = program.profiles
        table[number] = ends[number] - len(program.nodes), ends[number], program.chooser
        category = program.layout.category
        if categories[category, 1] == 0:
            categories[category, 0] = number
        categories[category, 1] += 1
    return Catalogue(
        nodes=np.concatenate([program.nodes for program in programs]),
        profiles=profiles,
        layouts=table,
        categories=categories,
        nodes_max=max(len(program.nodes) for program in programs),
    )


def walk(
    program: Program,
    data: NDArray[np.uint8],
    begins: NDArray[np.int64],
    ends: NDArray[np.int64],
    records_max: int = RECORDS_MAX,
) -> Walked:
    """Parse blocks of one layout.

    Parameters
    ----------
    program : Program
        The layout.
    data : uint8[b]
        The bytes.
    begins, ends : int64[n]
        Begin (after the three octets of the header) and end of the records of each block.
    records_max : int
        Minimum capacity for records; a single block may have more.

    Returns
    -------
    Walked
        Records and faults; a block with a fault has no records.
    """
    faults = np.zeros((len(begins), 3), dtype=np.int64)
    records, starts = [], []
    done, capacity = 0, records_max
    while done < len(begins):
        some = np.empty((capacity, 3), dtype=np.int64)
        places = np.empty((capacity, len(program.nodes)), dtype=np.int32)
        passed, count = _kernels.walk(
            data,
            begins[done:],
            ends[done:],
            program.profiles,
            program.chooser,
            program.nodes,
            places,
            some,
            faults[done:],
        )
        # A record has at least two octets, a block at most 65 532.
        capacity = records_max if passed else max(capacity, 1 << 15)
        some[:count, 0] += done
        records.append(some[:count].copy())
        starts.append(places[:count].copy())
        done += passed
    if not records:
        return Walked(program, np.empty((0, 3), np.int64), _no_starts(program), faults)
    return Walked(program, np.concatenate(records), np.concatenate(starts), faults)


def _no_starts(program: Program) -> NDArray[np.int32]:
    return np.empty((0, len(program.nodes)), dtype=np.int32)
