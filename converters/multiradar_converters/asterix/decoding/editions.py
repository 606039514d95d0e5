"""Edition of the blocks of a sensor: as selected, else the newest that fits.

An old edition with another order of items fits some blocks by chance, with wrong values. A source
is therefore quarantined as a whole if most of its blocks fit no layout.
"""

import re
from dataclasses import dataclass, field, fields

import numpy as np

from multiradar_converters.asterix.decoding.bounds import impossible_records
from multiradar_converters.asterix.framing.containers import Blocks
from multiradar_converters.asterix.layout import _block_kernels, _kernels
from multiradar_converters.asterix.layout.catalogue import layout_of, layouts_of
from multiradar_converters.asterix.layout.columns import Columns, Integers
from multiradar_converters.asterix.layout.notation import Layout
from multiradar_converters.asterix.layout.program import program_of, walk
from multiradar_converters.distinct import distinct, distinct_places
from multiradar_converters.errors import ProfileError

#: Maximum blocks of a sensor and category that are tried.
TRIED_MAX = 200

#: Minimum blocks that fit, or do not, for a decision whether a source has a known edition.
DECIDED_MIN = 3

#: Numbers of blocks without layout: of a category without one, and of a source that fits none.
UNKNOWN, UNFIT = -1, -2

_CHOICE = re.compile(r"(?:(\d{1,3})-(\d{1,3})/)?(\d{1,3})=(\S+)")

Source = int
#: Blocks that do not fit; of the others, blocks with impossible values.
Misfit = tuple[int, int]


@dataclass
class Editions:
    """The layout of each category and source.

    Attributes
    ----------
    chosen : dict
        Selected layouts, by category, and by category and source.
    texts : dict
        Text of each selection.
    found : dict
        Layout of every category and source found.
    misfits : dict
        Blocks tried, and misfits of each layout, by category and source.
    unfit : dict
        Blocks tried, and those that do not fit the best layout, of the categories and sources of
        which most blocks fit none.
    doubtful : dict
        Why a selected layout is probably wrong, by category and source.
    """

    chosen: dict[tuple[int, Source | None], Layout] = field(default_factory=dict)
    texts: dict[tuple[int, Source | None], str] = field(default_factory=dict)
    found: dict[tuple[int, Source], Layout] = field(default_factory=dict)
    misfits: dict[tuple[int, Source], tuple[int, list[Misfit]]] = field(default_factory=dict)
    unfit: dict[tuple[int, Source], tuple[int, int]] = field(default_factory=dict)
    doubtful: dict[tuple[int, Source], str] = field(default_factory=dict)

    def copied(self) -> "Editions":
        """Return the editions found so far, with the same layouts; detections extend one only."""
        return Editions(*(dict(getattr(self, one.name)) for one in fields(self)))

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
            pair = category, source
            tried = self.misfits.get(pair, (TRIED_MAX, []))[0]
            # A source that fits no layout is tried again and again.
            again = revise and (tried < TRIED_MAX or pair in self.unfit)
            if layouts_of(category) and (pair not in self.found or again):
                own = np.flatnonzero(place == number)
                self.found[pair] = self._layout(blocks, category, source, own)

    def layouts(self, blocks: Blocks, sources: Integers) -> tuple[list[Layout], Integers]:
        """Return layouts, and the index of that of each block, int64[n]; `UNKNOWN` or `UNFIT`."""
        pairs, place = _pairs(blocks, sources)
        found = [None if pair in self.unfit else self.found.get(pair) for pair in pairs]
        # By name, because hashing a layout is slow.
        used = {one.name: one for one in found if one is not None}
        numbers = [
            list(used).index(one.name) if one is not None else _without_layout(pair in self.unfit)
            for one, pair in zip(found, pairs, strict=True)
        ]
        return list(used.values()), np.array(numbers, dtype=np.int64)[place]

    def names(self) -> dict[str, dict[str, str]]:
        """Return the newest edition of each detected layout, by category and sensor."""
        names: dict[str, dict[str, str]] = {}
        for (category, source), layout in sorted(self.found.items()):
            if (category, source) not in self.unfit:
                names.setdefault(f"{category:03d}", {})[source_name(source)] = layout.editions[0]
        return names

    def why_unfit(self, category: int, source: Source) -> str:
        """Return why a source is quarantined as a whole."""
        tried, unfit = self.unfit[category, source]
        known = [name for one in layouts_of(category) for name in one.editions]
        return (
            f"category {category:03d} of {source_name(source)}: {unfit} of {tried} blocks match "
            f"no known edition ({', '.join(known)}), so all blocks are quarantined; to decode "
            "them anyway, select an edition"
        )

    def _layout(self, blocks: Blocks, category: int, source: Source, own: Integers) -> Layout:
        layouts = layouts_of(category)
        pair = category, source
        tried, sums = self.misfits.get(pair, (0, [(0, 0)] * len(layouts)))
        if tried >= TRIED_MAX:
            tried, sums = 0, [(0, 0)] * len(layouts)
        some = own[: TRIED_MAX - tried]
        tried += len(some)
        sums = [
            (sum_of[0] + more[0], sum_of[1] + more[1])
            for sum_of, more in zip(
                sums, (_misfit(blocks, layout, some) for layout in layouts), strict=True
            )
        ]
        self.misfits[pair] = tried, sums
        best = min(range(len(layouts)), key=sums.__getitem__)
        unfit = sum(sums[best])
        for key in (pair, (category, None)):
            if key in self.chosen:
                chosen = self.chosen[key]
                wrong = sum(sums[layouts.index(chosen)])
                if 2 * wrong > tried and 2 * unfit < wrong:
                    given, named = self.texts.get(key, chosen.name), layouts[best].editions[0]
                    self.doubtful[pair] = (
                        f"--edition {given}: {wrong} of {tried} blocks do not match this edition, "
                        f"or only with impossible values; edition {named} matches {tried - unfit} "
                        "of them; correct or omit the option"
                    )
                return chosen
        if max(unfit, tried - unfit) >= DECIDED_MIN:
            self.unfit.pop(pair, None)
            if 2 * unfit > tried:
                self.unfit[pair] = tried, unfit
        return layouts[best]


def _without_layout(unfit: bool) -> int:
    return UNFIT if unfit else UNKNOWN


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
            wanted = f"a known edition ({', '.join(known)})" if known else "a known category"
            msg = f"expected {wanted}, was {text!r}"
            raise ProfileError(msg) from error
        editions.chosen[int(category), source] = layout
        editions.texts[int(category), source] = text
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
    pairs, place = distinct_places(keys)
    return [(key >> 32, (key & 0xFFFFFFFF) - 1) for key in pairs.tolist()], place


def _misfit(blocks: Blocks, layout: Layout, some: Integers) -> Misfit:
    """Count blocks that do not fit a layout, and those with impossible values."""
    walked = walk(program_of(layout), blocks.data, blocks.begins[some] + 3, blocks.ends[some])
    impossible = impossible_records(Columns(walked, blocks.data))
    strange = len(distinct(walked.records[impossible, 0]))
    return int((walked.faults[:, 0] != _kernels.FITS).sum()), strange
