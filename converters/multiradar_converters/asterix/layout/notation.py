"""The notation in which `categories` writes down the items of the ASTERIX standards.

A line is an item, in the order of the category's user application profile (UAP); `-` is a number
of the profile that names no item; `== plot` begins a profile of its own. After the name comes the
kind, after `#` the title. Sub-items of a compound item follow indented.

=============  ==================================================================================
fixed          fields that fill whole octets
extended       octets of which the last bit (FX) tells whether the next part, after `|`, follows;
               a part that ends with `nofx` has no such bit
list           the same part again and again while FX is set
repetitive     a number (one octet), then so many times the fields
explicit       a length (one octet, counted in), then octets that the category does not describe
compound       bits (seven an octet, and FX) that tell which of the sub-items follow
rfs            a number, then so many items, each after its number in the profile
=============  ==================================================================================

A field is `NAME:BITS`; `-:BITS` are spare bits. After the bits: `s` signed (two's complement),
`o` octal digits, `x` hexadecimal digits, `c` letters of six bits, `a` ASCII; `*45/1024deg`: the
value of the last bit, and its unit.
"""

import re
from dataclasses import dataclass

_FIELD = re.compile(
    r"(?P<name>[A-Z0-9_]+|-):(?P<bits>\d+)(?P<form>[soxca]?)"
    r"(?:\*(?P<numerator>\d+)(?:/(?P<denominator>\d+))?(?P<unit>[^\d\s]\S*)?)?"
)
_FORMS = {
    "": "unsigned",
    "s": "signed",
    "o": "octal",
    "x": "hexadecimal",
    "c": "icao",
    "a": "ascii",
}
_NO_FX = "nofx"


@dataclass(frozen=True)
class Field:
    """Some bits of a part: their place, and how they are read.

    Attributes
    ----------
    name : str
        Name as in the standard; empty for spare bits.
    begin, bits : int
        First bit, from 0 at the part's first octet, and their number.
    form : str
        unsigned, signed, octal, hexadecimal, icao or ascii.
    numerator, denominator : int
        Value of the last bit, in `unit`.
    """

    name: str
    begin: int
    bits: int
    form: str = "unsigned"
    numerator: int = 1
    denominator: int = 1
    unit: str = ""


@dataclass(frozen=True)
class Part:
    """Whole octets and their fields; `more` says whether an FX bit ends them."""

    octets: int
    fields: tuple[Field, ...]
    more: bool = False


@dataclass(frozen=True)
class Item:
    """An item or sub-item; `parts` are those of an extended one, else at most one."""

    name: str
    kind: str
    title: str
    parts: tuple[Part, ...] = ()
    members: tuple["Item | None", ...] = ()


Profile = tuple[Item | None, ...]


@dataclass(frozen=True)
class Layout:
    """A category as some of its editions write it.

    Attributes
    ----------
    category : int
        The category.
    editions : tuple of str
        The editions, the newest first.
    profiles : tuple of profiles
        Items by place in the field specification. Of two profiles, the first is that of plots and
        the second that of tracks.
    """

    category: int
    editions: tuple[str, ...]
    profiles: tuple[Profile, ...]

    @property
    def name(self) -> str:
        """Return category and newest edition, such as `048 1.32`."""
        return f"{self.category:03d} {self.editions[0]}"

    def items(self) -> dict[str, Item]:
        """Return all items by name."""
        return {item.name: item for profile in self.profiles for item in profile if item}


def read_layout(category: int, editions: tuple[str, ...], text: str) -> Layout:
    """Read a table.

    Parameters
    ----------
    category : int
        The category.
    editions : tuple of str
        The editions that it describes, the newest first.
    text : str
        The table.

    Returns
    -------
    Layout
        The same as objects.

    Raises
    ------
    ValueError
        The table breaks a rule of the notation.
    """
    profiles: list[list[Item | None]] = []
    members: list[Item | None] = []
    for line in [*text.splitlines(), "=="]:
        if not line.startswith(" ") and members:
            profiles[-1][-1] = _with_members(profiles[-1][-1], members)
            members = []
        if line.startswith("=="):
            profiles.append([])
        elif line.startswith(" "):
            members.append(_item(line.strip()))
        else:
            if not profiles:
                profiles.append([])
            profiles[-1].append(_item(line))
    return Layout(category, editions, tuple(tuple(profile) for profile in profiles if profile))


def replaced(text: str, line: str) -> str:
    """Return a table with another line for the item, or indented sub-item, that the line names."""
    name = line[: line.index(" ", len(line) - len(line.lstrip()))]
    lines = [line if old.startswith(f"{name} ") else old for old in text.splitlines()]
    if lines == text.splitlines():
        msg = f"expected an item {name} to replace, found none"
        raise ValueError(msg)
    return "\n".join(lines)


def _item(line: str) -> Item | None:
    if line == "-":
        return None
    body, _, title = line.partition("#")
    name, kind, *fields = body.split()
    texts = " ".join(fields).split("|") if fields else []
    parts = tuple(_part(text, more=kind in ("extended", "list")) for text in texts)
    return Item(name, kind, title.strip(), parts)


def _part(text: str, *, more: bool) -> Part:
    fields = []
    begin = 0
    for word in text.split():
        if word == _NO_FX:
            more = False
            continue
        field = _field(word, begin)
        fields.append(field)
        begin += field.bits
    octets, over = divmod(begin + more, 8)
    if over:
        msg = f"expected fields that fill octets, was {text!r}"
        raise ValueError(msg)
    return Part(octets, tuple(fields), more)


def _field(word: str, begin: int) -> Field:
    match = _FIELD.fullmatch(word)
    if match is None:
        msg = f"expected NAME:BITS and a form, was {word!r}"
        raise ValueError(msg)
    return Field(
        name=match["name"].strip("-"),
        begin=begin,
        bits=int(match["bits"]),
        form=_FORMS[match["form"]],
        numerator=int(match["numerator"] or 1),
        denominator=int(match["denominator"] or 1),
        unit=match["unit"] or "",
    )


def _with_members(item: Item | None, members: list[Item | None]) -> Item:
    if item is None or item.kind != "compound":
        msg = "expected sub-items below a compound item"
        raise ValueError(msg)
    return Item(item.name, item.kind, item.title, members=tuple(members))
