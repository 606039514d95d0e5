"""How the records of a file are laid out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb.reading.roles import (
    NUMBERS,
    POSITION_TIME,
    ROLE_NAMES,
    TIME,
    Chosen,
    choose_columns,
)
from multiradar_converters.adsb.reading.time_forms import DIVISOR, TimeForm, of_day, time_form
from multiradar_converters.errors import LayoutError

#: Places of a JSON object at which a guess is kept of what stands there.
_HINTS = 64

_WORDED = ("iso8601", "clock")


@dataclass
class Layout:
    """What the columns of a file are, for both ways of reading.

    Attributes
    ----------
    chosen : Chosen
        The columns that are used.
    time, position_time : TimeForm
        Forms of the times.
    columns : tuple of int
        Role of each column of a CSV file, -1 for one that is not used; empty for JSON.
    separator : bytes
        What stands between two columns.
    """

    chosen: Chosen
    time: TimeForm
    position_time: TimeForm
    columns: tuple[int, ...] = ()
    separator: bytes = b","
    keys: NDArray[np.uint8] = field(init=False)
    lengths: NDArray[np.int64] = field(init=False)
    key_roles: NDArray[np.int64] = field(init=False)
    hints: NDArray[np.int64] = field(init=False)
    scale: NDArray[np.float64] = field(init=False)
    divisor: NDArray[np.float64] = field(init=False)
    worded: NDArray[np.bool_] = field(init=False)
    roles: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        names = {role: name.encode() for role, name in self.chosen.names.items()}
        width = max(len(name) for name in names.values())
        padded = b"".join(name.ljust(width, b"\0") for name in names.values())
        self.keys = np.frombuffer(padded, dtype=np.uint8).reshape(-1, width)
        self.lengths = np.array([len(name) for name in names.values()], dtype=np.int64)
        self.key_roles = np.array(list(names), dtype=np.int64)
        self.hints = np.zeros(_HINTS, dtype=np.int64)
        self.scale = np.array([self.chosen.scale.get(k, 1.0) for k in range(NUMBERS)])
        self.divisor = np.ones(NUMBERS)
        self.divisor[TIME] = DIVISOR[self.time]
        self.divisor[POSITION_TIME] = DIVISOR[self.position_time]
        self.worded = np.zeros(NUMBERS, dtype=np.bool_)
        # What is no ISO 8601 the compiled form leaves to the plain one: times of day, too.
        self.worded[TIME] = self.time in _WORDED
        self.worded[POSITION_TIME] = self.position_time in _WORDED
        self.roles = {name: role for role, name in self.chosen.names.items()}

    def name_of(self, role: int) -> str:
        """Return what the file calls a role."""
        return self.chosen.names.get(role, ROLE_NAMES[role])

    def figures(self) -> dict[str, object]:
        """Return what was found, for `report.json`."""
        names = {ROLE_NAMES[role]: name for role, name in sorted(self.chosen.names.items())}
        return {"columns": names, "time": self.time}


def lay_out(
    file: str,
    found: list[str],
    samples: Mapping[str, Sequence[str]],
    separator: bytes | None = None,
) -> Layout:
    """Find the layout of a file from its first records.

    Parameters
    ----------
    file : str
        Its name, for messages.
    found : list of str
        Names of its columns, in their order.
    samples : mapping
        Values of the first records by name, as they stand.
    separator : bytes or None
        What stands between two columns of a CSV file.

    Returns
    -------
    Layout
        The layout.

    Raises
    ------
    LayoutError
        A column is missing, or its form or unit is not known.
    """
    chosen = choose_columns(file, found)
    name = chosen.names[TIME]
    time = time_form(file, name, samples.get(name, ()))
    position_name = chosen.names.get(POSITION_TIME)
    position_time = time
    told = [text for text in samples.get(position_name or "", ()) if text]
    # Of a column that is empty but for a row or two, these are refused, not the file.
    if position_name is not None and 2 * len(told) >= len(samples[name]):
        position_time = time_form(file, position_name, told)
        if of_day(position_time) != of_day(time):
            msg = (
                f"{file}: expected dates in both or none of {name!r} and {position_name!r}, was "
                f"{time} and {position_time}"
            )
            raise LayoutError(msg)
    if separator is None:
        return Layout(chosen, time, position_time)
    places = {name: role for role, name in chosen.names.items()}
    return Layout(
        chosen, time, position_time, tuple(places.get(each, -1) for each in found), separator
    )
