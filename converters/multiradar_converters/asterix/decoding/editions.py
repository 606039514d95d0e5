"""Edition of the blocks of a sensor: as selected, else the newest that fits."""

import re
from dataclasses import dataclass, field

import numpy as np

from multiradar_converters.asterix.framing.containers import Blocks
from multiradar_converters.asterix.layout import _block_kernels, _kernels
from multiradar_converters.asterix.layout.catalogue import layout_of, layouts_of
from multiradar_converters.asterix.layout.columns import Columns, Integers
from multiradar_converters.asterix.layout.notation import Layout
from multiradar_converters.asterix.layout.program import program_of, walk
from multiradar_converters.errors import ProfileError

#: Maximum blocks of a sensor and category that are tried.
TRIED_MAX = 200

_DAY_S = 86_400.0
_CHOICE = re.compile(r"(?:(\d{1,3})-(\d{1,3})/)?(\d{1,3})=(\S+)")

Source = int


@dataclass
class Editions:
    """The layout of each category and source.

    Attributes
    ----------
    chosen : dict
        Selected layouts, by category, and by category and source.
    found : dict
        Layout of every category and source found.
    misfits : dict
        Blocks tried, and misfits of each layout, by category and source.
    """

    chosen: dict[tuple[int, Source | None], Layout] = field(default_factory=dict)
    found: dict[tuple[int, Source], Layout] = field(default_factory=dict)
    misfits: dict[tuple[int, Source], tuple[int, list[tuple[int, int]]]] = field(
        default_factory=dict
    )

    def detect(self, blocks: Blocks, sources: Integers, *, revise: bool = False) -> None:
        """Detect the layout of every new category and source.

        Parameters
        ----------
        blocks : Blocks
            The blocks.
        sources : int64[n]
            Source of each.
        revise : bool
            Whether further blocks may revise a detection from few blocks, for live input.
        """
        pairs, place = _pairs(blocks, sources)
        for number, (category, source) in enumerate(pairs):
            known = (category, source) in self.found
            tried = self.misfits.get((category, source), (TRIED_MAX, []))[0]
            if layouts_of(category) and (not known or (revise and tried < TRIED_MAX)):
                own = np.flatnonzero(place == number)
                self.found[category, source] = self._layout(blocks, category, source, own)

    def layouts(self, blocks: Blocks, sources: Integers) -> tuple[list[Layout], Integers]:
        """Return layouts, and the index of the layout of each block, int64[n]; -1 for none."""
        pairs, place = _pairs(blocks, sources)
        found = [self.found.get(pair) for pair in pairs]
        # By name, because hashing a layout is slow.
        used = {one.name: one for one in found if one is not None}
        numbers = [-1 if one is None else list(used).index(one.name) for one in found]
        return list(used.values()), np.array(numbers, dtype=np.int64)[place]

    def names(self) -> dict[str, dict[str, str]]:
        """Return the newest edition of each detected layout, by category and sensor."""
        names: dict[str, dict[str, str]] = {}
        for (category, source), layout in sorted(self.found.items()):
            names.setdefault(f"{category:03d}", {})[source_name(source)] = layout.editions[0]
        return names

    def _layout(self, blocks: Blocks, category: int, source: Source, own: Integers) -> Layout:
        for key in ((category, source), (category, None)):
            if key in self.chosen:
                return self.chosen[key]
        layouts = layouts_of(category)
        if len(layouts) == 1:
            return layouts[0]
        tried, sums = self.misfits.get((category, source), (0, [(0, 0)] * len(layouts)))
        some = own[: TRIED_MAX - tried]
        sums = [
            (sum_of[0] + more[0], sum_of[1] + more[1])
            for sum_of, more in zip(
                sums, (_misfit(blocks, layout, some) for layout in layouts), strict=True
            )
        ]
        self.misfits[category, source] = tried + len(some), sums
        return layouts[min(range(len(layouts)), key=sums.__getitem__)]


def parse_editions(texts: list[str]) -> Editions:
    """Parse selections such as `021=0.26` or `20-130/001=1.1`.

    Raises
    ------
    ProfileError
        A selection is malformed, or names an unsupported edition.
    """
    editions = Editions()
    for text in texts:
        match = _CHOICE.fullmatch(text)
        if match is None:
            msg = f"expected CATEGORY=EDITION or SAC-SIC/CATEGORY=EDITION, was {text!r}"
            raise ProfileError(msg)
        sac, sic, category, edition = match.groups()
        source = None if sac is None else int(sac) << 8 | int(sic)
        try:
            layout = layout_of(int(category), edition)
        except KeyError as error:
            known = [name for one in layouts_of(int(category)) for name in one.editions]
            msg = f"expected an edition of {', '.join(known) or 'a known category'}, was {text!r}"
            raise ProfileError(msg) from error
        editions.chosen[int(category), source] = layout
    return editions


def source_name(source: Source) -> str:
    """Return `SAC-SIC`, or `unnamed` for records without a source."""
    return f"{source >> 8}-{source & 255}" if source >= 0 else "unnamed"


def sources_of(blocks: Blocks) -> Integers:
    """Return the source of the first record of each block, -1 for none."""
    sources = np.empty(len(blocks.begins), dtype=np.int64)
    _block_kernels.read_sources(blocks.data, blocks.begins + 3, blocks.ends, sources)
    return sources


def _pairs(blocks: Blocks, sources: Integers) -> tuple[list[tuple[int, Source]], Integers]:
    """Return the categories and sources, and their index for each block."""
    keys = blocks.data[blocks.begins].astype(np.int64) << 32 | (sources + 1)
    distinct, place = np.unique(keys, return_inverse=True)
    return [(key >> 32, (key & 0xFFFFFFFF) - 1) for key in distinct.tolist()], place


def _misfit(blocks: Blocks, layout: Layout, some: Integers) -> tuple[int, int]:
    """Count blocks that do not fit a layout, and impossible values."""
    program = program_of(layout)
    walked = walk(program, blocks.data, blocks.begins[some] + 3, blocks.ends[some])
    columns = Columns(walked, blocks.data)
    strange = 0
    for (node, name), described in program.fields.items():
        values = columns.numbers(node, name)
        if described.unit == "s" and described.bits == 24:
            strange += int((values >= _DAY_S).sum())
        elif name == "LAT":
            strange += int((np.abs(values) > 90.0).sum())
    return int((walked.faults[:, 0] != _kernels.FITS).sum()), strange
