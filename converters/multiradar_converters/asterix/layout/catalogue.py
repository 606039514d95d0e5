"""All layouts: supported categories and editions."""

import functools

from multiradar_converters.asterix.layout.categories import (
    cat001,
    cat002,
    cat004,
    cat008,
    cat010,
    cat019,
    cat020,
    cat021,
    cat023,
    cat030,
    cat034,
    cat048,
    cat062,
    cat063,
    cat065,
    cat247,
    cat252,
)
from multiradar_converters.asterix.layout.notation import Layout, read_layout

_TABLES = (
    (1, cat001.EDITIONS, cat001.TABLE),
    (2, cat002.EDITIONS, cat002.TABLE),
    (4, cat004.EDITIONS, cat004.TABLE),
    (8, cat008.EDITIONS, cat008.TABLE),
    (10, cat010.EDITIONS, cat010.TABLE),
    (10, cat010.EDITIONS_0_24, cat010.TABLE_0_24),
    (19, cat019.EDITIONS, cat019.TABLE),
    (20, cat020.EDITIONS, cat020.TABLE),
    (21, cat021.EDITIONS, cat021.TABLE),
    (21, cat021.EDITIONS_2_1, cat021.TABLE_2_1),
    (21, cat021.EDITIONS_0_26, cat021.TABLE_0_26),
    (21, cat021.EDITIONS_0_23, cat021.TABLE_0_23),
    (23, cat023.EDITIONS, cat023.TABLE),
    (30, cat030.EDITIONS, cat030.TABLE),
    (30, cat030.EDITIONS_STR, cat030.TABLE_STR),
    (34, cat034.EDITIONS, cat034.TABLE),
    (48, cat048.EDITIONS, cat048.TABLE),
    (62, cat062.EDITIONS, cat062.TABLE),
    (62, cat062.EDITIONS_EIGHT_LETTERS, cat062.TABLE_EIGHT_LETTERS),
    (63, cat063.EDITIONS, cat063.TABLE),
    (65, cat065.EDITIONS, cat065.TABLE),
    (247, cat247.EDITIONS, cat247.TABLE),
    (252, cat252.EDITIONS, cat252.TABLE),
    (252, cat252.EDITIONS_CONNECTION, cat252.TABLE_CONNECTION),
)


@functools.cache
def layouts() -> tuple[Layout, ...]:
    """Return all layouts, grouped by category, the newest first."""
    return tuple(read_layout(*table) for table in _TABLES)


def layouts_of(category: int) -> tuple[Layout, ...]:
    """Return the layouts of a category, the newest first; empty if it is unknown."""
    return tuple(layout for layout in layouts() if layout.category == category)


def layout_of(category: int, edition: str) -> Layout:
    """Return the layout of an edition.

    Raises
    ------
    KeyError
        There is no table for it.
    """
    for layout in layouts_of(category):
        if edition in layout.editions:
            return layout
    raise KeyError(f"{category:03d} {edition}")
