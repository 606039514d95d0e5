"""Days of files in order of time: records have times of day only.

A file that starts more than half a day before the previous one starts on the next day.
"""

from collections.abc import Iterable

import numpy as np

from multiradar_converters.asterix.layout.columns import Numbers

_DAY_S = 86_400.0


class FileOrder:
    """Adds files in the order in which they were given.

    Attributes
    ----------
    exchanged : list of (str, str)
        Files that end before the file given before them starts, and that file.
    """

    def __init__(self) -> None:
        self.exchanged: list[tuple[str, str]] = []
        self._previous = ""
        self._start_s = -np.inf
        self._moved_s = 0.0

    def add(self, file: str, times_s: Iterable[Numbers]) -> float:
        """Return what to add to the times of a file, s: whole days.

        Parameters
        ----------
        file : str
            Its name.
        times_s : iterable of float64[n]
            Its times, s; NaN where missing.
        """
        known = np.concatenate([*times_s, np.empty(0)])
        known = known[np.isfinite(known)]
        if not len(known):
            return self._moved_s
        start_s, end_s = float(known.min()), float(known.max())
        if start_s + self._moved_s < self._start_s - 0.5 * _DAY_S:
            self._moved_s += _DAY_S
        elif end_s + self._moved_s < self._start_s:
            self.exchanged.append((file, self._previous))
        self._previous, self._start_s = file, start_s + self._moved_s
        return self._moved_s
