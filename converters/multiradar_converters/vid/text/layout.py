"""Layout of a dump file: its form, separator, columns, units and times."""

from dataclasses import dataclass
from typing import Literal

from multiradar_converters.vid.fields import Table

TAB, LF, CR, BLANK, COMMA, SEMICOLON = 9, 10, 13, 32, 44, 59

#: Names of the separators in profiles; `blank` is a run of blanks and tabs.
SEPARATORS = {"tab": TAB, "semicolon": SEMICOLON, "comma": COMMA, "blank": BLANK}

Form = Literal["columns", "pairs"]
TimeForm = Literal["seconds-of-day", "iso8601", "unix"]


@dataclass(frozen=True)
class FileLayout:
    """The layout of a file, detected or given.

    Attributes
    ----------
    table : Table
        Which of the three files it is.
    names : tuple of str
        Name of each role of the table in the dump, in the order of `table.roles`.
    form : str
        Columns under a header, or pairs of name and value.
    terminator : int
        Line end, a byte.
    separator : int
        Separator of columns, a byte.
    columns : tuple of int
        Role of each column.
    keys, key_roles : tuple
        Known names of pairs, as bytes, and their roles.
    header : bytes or None
        The header line without its line end.
    data_offset : int
        Byte offset of the first line of data.
    time_form : str or None
        Time format; None if unknown.
    encoding : str
        Encoding of names and of raw text in rejects.
    low, high, scale : tuple of float
        Bounds in SI (inclusive), and factor to SI of each number, by role.
    """

    table: Table
    names: tuple[str, ...]
    form: Form
    terminator: int
    separator: int
    columns: tuple[int, ...]
    keys: tuple[bytes, ...]
    key_roles: tuple[int, ...]
    header: bytes | None
    data_offset: int
    time_form: TimeForm | None
    encoding: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    scale: tuple[float, ...]

    @property
    def iso_time(self) -> bool:
        """Whether times are ISO 8601."""
        return self.time_form == "iso8601"

    def name_of(self, role: int) -> str:
        """Return the name of a role in the dump."""
        return self.names[self.table.roles.index(role)]
