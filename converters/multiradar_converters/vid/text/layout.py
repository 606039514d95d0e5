"""How one file of a dump is laid out: its form, separator, columns, units and times."""

from dataclasses import dataclass
from typing import Literal

from multiradar_converters.vid.fields import Table

TAB, LF, CR, BLANK, COMMA, SEMICOLON = 9, 10, 13, 32, 44, 59

#: Names of the separators in profiles; a blank stands for a run of blanks and tabs.
SEPARATORS = {"tab": TAB, "semicolon": SEMICOLON, "comma": COMMA, "blank": BLANK}

Form = Literal["columns", "pairs"]
TimeForm = Literal["seconds-of-day", "iso8601", "unix"]


@dataclass(frozen=True)
class FileLayout:
    """The layout of one file, found or given.

    Attributes
    ----------
    table : Table
        Which of the three files it is.
    names : tuple of str
        What the dump calls each role of the table, in the order of `table.roles`.
    form : str
        Columns under a header, or pairs of name and value.
    terminator : int
        The byte that ends a line.
    separator : int
        The byte between columns.
    columns : tuple of int
        Role of each column.
    keys, key_roles : tuple
        Known names of pairs, as bytes of the file, and their roles.
    header : bytes or None
        The header line, without its end mark.
    data_offset : int
        Where the first line of data begins, bytes.
    time_form : str or None
        What the times are; None where no row tells.
    encoding : str
        Of names and of raw text in rejects.
    low, high, scale : tuple of float
        Bounds in SI, both allowed, and the factor to SI of each number, by role.
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
        """Whether times are written as dates and times of day."""
        return self.time_form == "iso8601"

    def name_of(self, role: int) -> str:
        """Return what the dump calls a role."""
        return self.names[self.table.roles.index(role)]
