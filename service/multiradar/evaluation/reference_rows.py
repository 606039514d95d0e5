"""Screening of the rows of a reference: values out of range, and positions no aircraft flies to.

A wrong position, such as an ADS-B position decoded with the wrong zone, lies far away from those
before and after it. Rows of an aircraft are joined to chains whose consecutive rows an aircraft can
reach. A chain is wrong where a longer one continues on both sides of it, and at an end where it has
fewer than `CHAIN_MIN` rows. Two long chains in succession both stay: nothing says which is wrong.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl

from multiradar.evaluation.coverage import CoveredRegion, covered_rows
from multiradar.evaluation.trajectories import (
    NUMBER_MAX,
    Flags,
    Floats,
    Indices,
    RejectedRow,
    RowCounts,
    Uncovered,
)
from multiradar.geodesy.wgs84 import enu_rotation

#: Bounds of columns; others may have any finite number.
BOUNDS = {"latitude_deg": 90.0, "longitude_deg": 360.0}
#: Maximum speed of aircraft, m/s (Mach 2), and the error of times in recordings, s: latencies of
#: reports differ by seconds.
SPEED_MAX_MPS, TIME_ERROR_S = 600.0, 3.0
#: Shorter chains at the start or the end of an aircraft's rows are rejected.
CHAIN_MIN = 3
#: Chains that may be continued; of more, the longest ones.
OPEN_MAX = 16
#: A name of more chains is not that of one aircraft; each of them is compared with all.
CHAINS_MAX = 1000
#: Rows farther from the centre of the reference do not fit on one plane, degrees.
FAR_DEG = 55.0
#: Optional columns with the location of each row: the index in its table, or a line of a file.
ROW_COLUMN, FILE_COLUMN, LINE_COLUMN = "index", "file", "line"

_EARTH_RADIUS_M = 6_371_000.0


def screened(
    frame: pl.DataFrame,
    numbers: Sequence[str],
    source: str,
    regions: Sequence[CoveredRegion] = (),
) -> tuple[pl.DataFrame, RowCounts]:
    """Separate the rows of a reference that can be used from those that cannot.

    Parameters
    ----------
    frame : DataFrame
        Positions with `name`, `time_s`, `latitude_deg` and `longitude_deg`, in any order; optional
        `index`, or `file` and `line`, locate each row.
    numbers : sequence of str
        Columns that need a number in every row, with the three above.
    source : str
        Name of the input.
    regions : sequence of CoveredRegion
        Of the sensors; without any, or if all rows are outside, nothing is cut off.

    Returns
    -------
    frame : DataFrame
        The accepted rows in the regions, by aircraft and time.
    counts : RowCounts
        Counts and rejects.
    """
    reasons: dict[int, str] = {}
    values = {name: frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in numbers}
    for row in np.flatnonzero(frame["name"].is_null().to_numpy()).tolist():
        reasons[row] = "no track number and no Mode S address"
    for name, column in values.items():
        bound = BOUNDS.get(name, NUMBER_MAX)
        expected = f" from {-bound:g} to {bound:g}" if name in BOUNDS else ""
        for row in np.flatnonzero(~(np.abs(column) <= bound)).tolist():
            reason = f"{name}: expected a number{expected}, was {frame[name][row]}"
            reasons.setdefault(row, reason)
    usable = np.setdiff1d(np.arange(len(frame)), list(reasons)).astype(np.int64)
    direction = enu_rotation(
        np.radians(values["latitude_deg"][usable]), np.radians(values["longitude_deg"][usable])
    )[:, 2]
    _, aircraft = np.unique(
        frame["name"].gather(usable).to_numpy().astype(np.str_), return_inverse=True
    )
    order = np.lexsort((values["time_s"][usable], aircraft))
    usable, direction, aircraft = usable[order], direction[order], aircraft[order]
    wrong = _unreachable(aircraft, values["time_s"][usable], direction)
    reasons |= {int(usable[row]): reason for row, reason in wrong.items()}
    good = np.setdiff1d(np.arange(len(usable)), list(wrong)).astype(np.int64)
    usable, direction, aircraft = usable[good], direction[good], aircraft[good]
    # Wrong rows are found with those outside, and distances with those inside only.
    inside, uncovered = _covered(frame, usable, aircraft, values, regions)
    for row in np.flatnonzero(inside & _far(direction[inside], direction)).tolist():
        reason = f"more than {FAR_DEG:g}° from the centre of the reference"
        reasons.setdefault(int(usable[row]), reason)
    kept = frame[np.setdiff1d(usable[inside], list(reasons))]
    accepted = kept.unique(["name", "time_s"], keep="first", maintain_order=True)
    rejects = tuple(_rejected(frame, row, reasons[row], source) for row in sorted(reasons))
    counts = RowCounts(
        read=len(frame),
        accepted=len(accepted) + uncovered.total,
        duplicate=len(kept) - len(accepted),
        rejects=rejects,
        uncovered=uncovered,
    )
    return accepted.sort("name", "time_s"), counts


def _covered(
    frame: pl.DataFrame,
    rows: Indices,
    aircraft: Indices,
    values: Mapping[str, Floats],
    regions: Sequence[CoveredRegion],
) -> tuple[Flags, Uncovered]:
    if regions:
        height = frame["height_m"].cast(pl.Float64).fill_null(np.nan).to_numpy()
        place = (np.radians(values[name][rows]) for name in ("latitude_deg", "longitude_deg"))
        inside, uncovered = covered_rows(
            regions, aircraft, values["time_s"][rows], (next(place), next(place)), height[rows]
        )
        # Another time or area is reported as such.
        if inside.any():
            return inside, uncovered
    return np.ones(len(rows), np.bool_), Uncovered()


def _rejected(frame: pl.DataFrame, row: int, reason: str, source: str) -> RejectedRow:
    name = frame["name"][row]
    if LINE_COLUMN in frame.columns:
        return RejectedRow(frame[FILE_COLUMN][row], frame[LINE_COLUMN][row], None, name, reason)
    place = int(frame[ROW_COLUMN][row]) if ROW_COLUMN in frame.columns else row
    return RejectedRow(source, None, place, name, reason)


_MANY_CHAINS = (
    f"the positions under this name are on more than {CHAINS_MAX} paths between which no aircraft "
    "can fly: several aircraft with one name (an anonymised address?), or times in another unit"
)


# Rows sorted by aircraft and time; directions are unit vectors. Returns the reason by row.
def _unreachable(aircraft: Indices, time_s: Floats, direction: Floats) -> dict[int, str]:
    same = np.diff(aircraft) == 0
    broken = same & ~reachable(np.diff(time_s), direction[1:], direction[:-1])
    reasons: dict[int, str] = {}
    for one in np.unique(aircraft[:-1][broken]).tolist():
        first, end = np.searchsorted(aircraft, [one, one + 1]).tolist()
        own = slice(first, end)
        cuts = np.flatnonzero(broken[first : end - 1]) + 1
        wrong = _wrong_rows(
            np.append(0, cuts), np.append(cuts, end - first), time_s[own], direction[own]
        )
        if wrong is None:
            reasons |= dict.fromkeys(range(first, end), _MANY_CHAINS)
            continue
        good = np.flatnonzero(~wrong)
        for row in np.flatnonzero(wrong).tolist():
            near = int(good[np.argmin(np.abs(good - row))])
            reasons[first + row] = _jump(row, near, time_s[own], direction[own])
    return reasons


def _wrong_rows(begin: Indices, end: Indices, time_s: Floats, direction: Floats) -> Flags | None:
    # Runs of reachable rows, begin to end; a chain is a list of runs, named by their numbers. None
    # if there are too many.
    chains: list[list[int]] = []
    rows: list[int] = []
    still_open: list[int] = []
    for run, first in enumerate(begin.tolist()):
        last = np.array([end[chains[one][-1]] - 1 for one in still_open], np.int64)
        near = reachable(time_s[first] - time_s[last], direction[last], direction[first])
        joined = [one for one, fits in zip(still_open, near.tolist(), strict=True) if fits]
        if joined:
            # Those that may be continued are ordered by length.
            chains[joined[0]].append(run)
            rows[joined[0]] += int(end[run]) - first
        elif len(chains) == CHAINS_MAX:
            return None
        else:
            still_open.append(len(chains))
            chains.append([run])
            rows.append(int(end[run]) - first)
        still_open = sorted(still_open, key=lambda one: -rows[one])[:OPEN_MAX]
    head = np.array([begin[one[0]] for one in chains])
    tail = np.array([end[one[-1]] - 1 for one in chains])
    count = np.array(rows)
    wrong: Flags = np.zeros(len(time_s), np.bool_)
    for number, runs in enumerate(chains):
        longer = count > count[number]
        around = longer & (head < head[number]) & (tail > tail[number])
        # Before it, or after it; a chain that overlaps it at one end only is neither.
        apart = longer & (count >= CHAIN_MIN) & ((tail < head[number]) | (head > tail[number]))
        before = tail < head[number]
        passed = np.where(
            before, time_s[head[number]] - time_s[tail], time_s[head] - time_s[tail[number]]
        )
        near_end = np.where(before[:, None], direction[tail], direction[head])
        own_end = np.where(before[:, None], direction[head[number]], direction[tail[number]])
        apart &= ~reachable(passed, near_end, own_end)
        if around.any() or (count[number] < CHAIN_MIN and apart.any()):
            for run in runs:
                wrong[begin[run] : end[run]] = True
    return wrong


def reachable(passed_s: Floats, before: Floats, after: Floats) -> Flags:
    """Return whether aircraft can fly between positions.

    Parameters
    ----------
    passed_s : (n,) float64
        Times between them, s; either sign.
    before, after : (n, 3) float64
        The positions as unit vectors of the vertical.

    Returns
    -------
    (n,) bool
        Whether `SPEED_MAX_MPS` suffices, with times off by `TIME_ERROR_S`.
    """
    reach: Flags = _distance_m(before, after) <= SPEED_MAX_MPS * (np.abs(passed_s) + TIME_ERROR_S)
    return reach


def _distance_m(one: Floats, other: Floats) -> Floats:
    chord = np.linalg.norm(one - other, axis=-1)
    distance: Floats = 2.0 * _EARTH_RADIUS_M * np.arcsin(np.minimum(0.5 * chord, 1.0))
    return distance


def _jump(row: int, near: int, time_s: Floats, direction: Floats) -> str:
    far_km = float(_distance_m(direction[row], direction[near])) / 1e3
    passed_s = float(time_s[near] - time_s[row])
    order = "later" if passed_s > 0.0 else "earlier"
    return (
        f"{far_km:,.0f} km from the position {abs(passed_s):.3g} s {order}, farther than an "
        "aircraft can fly in that time; the other positions of the aircraft are consistent"
    )


def _far(used: Floats, direction: Floats) -> Flags:
    if not len(used):
        return np.zeros(len(direction), np.bool_)
    middle = np.median(used, axis=0)
    length = float(np.linalg.norm(middle))
    far: Flags = direction @ middle < np.cos(np.radians(FAR_DEG)) * length
    return far
