"""The notation of the items of the ASTERIX standards in `categories`.

A line is an item, in the order of the user application profile (UAP) of the category; `-` is an
unused number of the profile; `== plot` begins a separate profile. The kind follows the name, the
title follows `#`. Sub-items of a compound item are indented.

=============  ==================================================================================
fixed          fields that fill whole octets
extended       octets whose last bit (FX) indicates that the next part, after `|`, follows; a part
               that ends with `nofx` has no such bit
list           the same part, repeated while FX is set
repetitive     a count (one octet), then the fields so many times
explicit       a length (one octet, included), then octets that the category does not describe
compound       bits (seven per octet, and FX) that indicate which sub-items follow
rfs            a count, then so many items, each preceded by its number in the profile
=============  ==================================================================================

A field is `NAME:BITS`; `-:BITS` are spare bits. After the bits: `s` signed (two's complement),
`o` octal digits, `x` hexadecimal digits, `c` six-bit characters, `a` ASCII; `*45/1024deg`: the
value of the least significant bit (LSB), and its unit.
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
    """A bit field of a part: position and interpretation.

    Attributes
    ----------
    name : str
        Name as in the standard; empty for spare bits.
    begin, bits : int
        First bit, from 0 at the first octet of the part, and number of bits.
    form : str
        unsigned, signed, octal, hexadecimal, icao or ascii.
    numerator, denominator : int
        Value of the LSB, in `unit`.
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
    """Whole octets and their fields; `more` if they end with an FX bit."""

    octets: int
    fields: tuple[Field, ...]
    more: bool = False


@dataclass(frozen=True)
class Item:
    """An item or sub-item; an extended item has several `parts`, others at most one."""

    name: str
    kind: str
    title: str
    parts: tuple[Part, ...] = ()
    members: tuple["Item | None", ...] = ()


Profile = tuple[Item | None, ...]


@dataclass(frozen=True)
class Layout:
    """The layout of a category in some of its editions.

    Attributes
    ----------
    category : int
        The category.
    editions : tuple of str
        The editions, the newest first.
    profiles : tuple of profiles
        Items by position in the field specification. Of two profiles, the first is for plots and
        the second for tracks.
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
    """Parse a table.

    Parameters
    ----------
    category : int
        The category.
    editions : tuple of str
        Its editions, the newest first.
    text : str
        The table.

    Raises
    ------
    ValueError
        The table violates the notation.
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
    """Return a table with the line of an item, or indented sub-item, replaced."""
    name = line[: line.index(" ", len(line) - len(line.lstrip()))]
    lines = [line if old.startswith(f"{name} ") else old for old in text.splitlines()]
    if lines == text.splitlines():
        msg = f"no item {name} to replace"
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
        msg = f"expected fields that fill whole octets, was {text!r}"
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
        msg = "missing sub-items of a compound item"
        raise ValueError(msg)
    return Item(item.name, item.kind, item.title, members=tuple(members))
