"""Layout of the records of a file."""

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

#: Number of members of a JSON object whose names are guessed from the previous object.
_HINTS = 64

_WORDED = ("iso8601", "clock")


@dataclass
class Layout:
    """Columns of a file, for both forms of parsing.

    Attributes
    ----------
    chosen : Chosen
        The used columns.
    time, position_time : TimeForm
        Forms of the times.
    columns : tuple of int
        Role of each column of a CSV file, -1 if unused; empty for JSON.
    separator : bytes
        Separator of columns.
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
        # The compiled form leaves text other than ISO 8601 to the reference form, also times of
        # day.
        self.worded[TIME] = self.time in _WORDED
        self.worded[POSITION_TIME] = self.position_time in _WORDED
        self.roles = {name: role for role, name in self.chosen.names.items()}

    def name_of(self, role: int) -> str:
        """Return the name of a role in the file."""
        return self.chosen.names.get(role, ROLE_NAMES[role])

    def figures(self) -> dict[str, object]:
        """Return the detected layout, for `report.json`."""
        names = {ROLE_NAMES[role]: name for role, name in sorted(self.chosen.names.items())}
        return {"columns": names, "time": self.time}


def lay_out(
    file: str,
    found: list[str],
    samples: Mapping[str, Sequence[str]],
    separator: bytes | None = None,
) -> Layout:
    """Detect the layout of a file from its first records.

    Parameters
    ----------
    file : str
        Its name, for messages.
    found : list of str
        Names of its columns, in order.
    samples : mapping
        Text of the values of the first records, by name.
    separator : bytes or None
        Separator of columns of a CSV file.

    Raises
    ------
    LayoutError
        A column is missing, or its form or unit is unknown.
    """
    chosen = choose_columns(file, found)
    name = chosen.names[TIME]
    time = time_form(file, name, samples.get(name, ()))
    position_name = chosen.names.get(POSITION_TIME)
    position_time = time
    present = [text for text in samples.get(position_name or "", ()) if text]
    # If a column is nearly empty, its few rows are rejected, not the file.
    if position_name is not None and 2 * len(present) >= len(samples[name]):
        position_time = time_form(file, position_name, present)
        if of_day(position_time) != of_day(time):
            msg = (
                f"{file}: expected dates in both {name!r} and {position_name!r} or in neither, "
                f"found {time} and {position_time}"
            )
            raise LayoutError(msg)
    if separator is None:
        return Layout(chosen, time, position_time)
    places = {name: role for role, name in chosen.names.items()}
    return Layout(
        chosen, time, position_time, tuple(places.get(each, -1) for each in found), separator
    )
