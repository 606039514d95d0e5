"""Comparison of the aircraft of files: whether they are of the same day.

Of the moving aircraft of a file, the first report of each minute is compared with that of another
file in the same minute. On the same day, both are at the same place; on different days, the
aircraft is elsewhere.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data.plausibility import wrapped_deg

Numbers = NDArray[np.float64]
Words = NDArray[np.int64]

#: Duration of a cell, of which the first report of an aircraft is compared, s.
CELL_S = 60.0
#: Cells with reports of both files, at least.
CELLS_MIN = 5
#: Aircraft that are elsewhere, at least: an address may be used by two aircraft.
ELSEWHERE_MIN = 2
#: Reports of a file that are compared, at most: those of a fraction of the addresses.
SAMPLE_MAX = 1 << 16
#: Maximum distance between reports of an aircraft at the same time, m, and its increase, m/s.
APART_MAX_M, SPEED_MAX_MPS = 3_000.0, 350.0
#: Minimum distance from one cell to the next one of a moving aircraft, m.
MOVED_MIN_M = 500.0

_DEGREE_M = 111_195.0
# Odd constant of xxHash32.
_MIX = 2654435761
# Number of cells; more than a recording has.
_CELLS_MAX = 1 << 32


class Sample:
    """First reports of aircraft in each minute of a file."""

    def __init__(self) -> None:
        # Address, time, s, latitude and longitude, degrees, part, and time in each form, s.
        self._rows = np.empty((8, 0))
        self._step = 1

    def push(self, address: Words, times_s: Numbers, place_deg: Numbers, part: Words) -> None:
        """Add reports.

        Parameters
        ----------
        address : int64[n]
            Mode S addresses.
        times_s : float64[3, n]
            Times in each form of the file, of which one is chosen later, s.
        place_deg : float64[2, n]
            Latitudes and longitudes, degrees.
        part : int64[n]
            Number of the part of the file of each report.
        """
        own = self._chosen(address)
        # By time in the second form, in which minutes of different days differ.
        rows = np.vstack(
            [address[own], times_s[1, own], place_deg[:, own], part[own], times_s[:, own]]
        )
        self._rows = np.hstack([self._rows, _firsts(rows)])
        while self._rows.shape[1] > SAMPLE_MAX:
            self._rows = _firsts(self._rows)
            if self._rows.shape[1] > SAMPLE_MAX // 2:
                self._step *= 2
                self._rows = self._rows[:, self._chosen(self._rows[0].astype(np.int64))]

    def choose(self, form: int, *, in_parts: bool) -> None:
        """Choose the form of times, and whether the file has several parts."""
        self._rows[1] = self._rows[5 + form]
        self._rows[4] *= in_parts

    def _chosen(self, address: Words) -> NDArray[np.bool_]:
        chosen: NDArray[np.bool_] = (address * _MIX >> 8) % self._step == 0
        return chosen

    def moving(self, moved_s: Numbers) -> Numbers:
        """Return the reports of moving aircraft in the recording.

        Parameters
        ----------
        moved_s : float64[p]
            What to add to the times of each part, s.

        Returns
        -------
        float64[4, n]
            Address, time, s, latitude and longitude, degrees, by address and time.
        """
        rows = self._rows.copy()
        rows[1] += moved_s[rows[4].astype(np.int64)]
        rows = _firsts(rows)[:4]
        far = (_apart_m(rows[:, 1:], rows[:, :-1]) > MOVED_MIN_M) & (np.diff(rows[0]) == 0.0)
        return rows[:, np.append(far, False) | np.append(False, far)]


def compared(one: Numbers, other: Numbers) -> int:
    """Return 1 if the aircraft of two files are at the same places, -1 if elsewhere, else 0.

    Parameters
    ----------
    one, other : float64[4, n], float64[4, m]
        Reports of each, as of `Sample.moving`.
    """
    _, at, other_at = np.intersect1d(_cells(one), _cells(other), True, True)
    if len(at) < CELLS_MIN:
        return 0
    first, second = one[:, at], other[:, other_at]
    reach_m = APART_MAX_M + SPEED_MAX_MPS * np.abs(first[1] - second[1])
    elsewhere = _apart_m(first, second) > reach_m
    if elsewhere.mean() < 0.5:
        return 1
    return -1 if len(np.unique(first[0, elsewhere])) >= ELSEWHERE_MIN else 0


def _firsts(rows: Numbers) -> Numbers:
    """Return the first of the reports of each cell, by address and time."""
    rows = rows[:, np.lexsort((rows[1], rows[0]))]
    _, firsts = np.unique(_cells(rows), return_index=True)
    return rows[:, np.sort(firsts)]


def _cells(rows: Numbers) -> Words:
    minute = np.floor(rows[1] / CELL_S).astype(np.int64) % _CELLS_MAX
    cells: Words = rows[0].astype(np.int64) * _CELLS_MAX + minute
    return cells


def _apart_m(one: Numbers, other: Numbers) -> Numbers:
    """Return the distance of reports, m; approximate, which distinguishes far from near."""
    north_deg = one[2] - other[2]
    east_deg = wrapped_deg(one[3] - other[3])
    apart: Numbers = _DEGREE_M * np.hypot(north_deg, east_deg * np.cos(np.radians(one[2])))
    return apart
