"""Which tracks a frame has, where there are more than a page can show."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.outputs import STATE_TENTATIVE

#: With at most so many tracks a frame has all of them, the same for every page.
WHOLE_MAX = 4_000
#: Otherwise it has at most so many of its area.
SYMBOLS_MAX = 10_000
#: Rows and columns of cells among which they are distributed.
_CELLS = 64

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Columns = dict[str, NDArray[Any]]


class Area(NamedTuple):
    """An area in degrees; it crosses the antimeridian where west is greater than east."""

    west_deg: float
    south_deg: float
    east_deg: float
    north_deg: float


WORLD = Area(-180.0, -90.0, 180.0, 90.0)


def inside(area: Area, latitude_deg: Floats, longitude_deg: Floats) -> NDArray[np.bool_]:
    """Return whether positions are in an area."""
    east = (longitude_deg >= area.west_deg, longitude_deg <= area.east_deg)
    between = east[0] & east[1] if area.west_deg <= area.east_deg else east[0] | east[1]
    north = (latitude_deg >= area.south_deg) & (latitude_deg <= area.north_deg)
    return np.asarray(between & north)


def selected(
    area: Area, latitude_deg: Floats, longitude_deg: Floats, state: NDArray[np.int8],
    budget: int = SYMBOLS_MAX,
) -> Rows:  # fmt: skip
    """Return the tracks of an area, ascending, evenly over it where they are too many.

    Parameters
    ----------
    area : Area
        The area.
    latitude_deg, longitude_deg : (n,) ndarray
        Positions of the tracks.
    state : (n,) int8
        Their states; tentative tracks come last.
    budget : int
        Maximum number.

    Notes
    -----
    Each cell of a grid gives one track after the other, in their order, until the budget is
    reached: the same ones in the next frame.
    """
    rows = np.flatnonzero(inside(area, latitude_deg, longitude_deg))
    if len(rows) <= budget:
        return rows
    width = (area.east_deg - area.west_deg) % 360.0 or 360.0
    across = ((longitude_deg[rows] - area.west_deg) % 360.0) / width
    up = (latitude_deg[rows] - area.south_deg) / max(area.north_deg - area.south_deg, 1e-9)
    column = np.minimum((across * _CELLS).astype(np.int64), _CELLS - 1)
    line = np.minimum((up * _CELLS).astype(np.int64), _CELLS - 1)
    cell = line * _CELLS + column
    last = state[rows] == STATE_TENTATIVE
    order = np.lexsort((rows, last, cell))
    begins = np.r_[0, np.flatnonzero(np.diff(cell[order])) + 1]
    rank = np.arange(len(order)) - np.repeat(begins, np.diff(np.r_[begins, len(order)]))
    chosen = order[np.lexsort((rows[order], rank, last[order]))[:budget]]
    return np.sort(rows[chosen])


def shown(tracks: Columns, area: Area, track: int | None) -> Rows:
    """Return the rows of a table of tracks that are in an area, as `selected`, and of one track."""
    rows = selected(area, tracks["latitude_deg"], tracks["longitude_deg"], tracks["state"])
    if track is None:
        return rows
    return np.union1d(rows, np.flatnonzero(tracks["track_id"] == track))


def at(columns: Columns, rows: NDArray[Any]) -> Columns:
    """Return rows of a table, by their numbers or by a mask."""
    return {name: column[rows] for name, column in columns.items()}
