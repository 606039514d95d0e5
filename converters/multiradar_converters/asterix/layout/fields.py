"""All fields of a record by name, for `records.ndjson` and for checks."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.layout.notation import Field, Item, Part
from multiradar_converters.asterix.layout.program import Program

_ICAO = (
    {code: chr(64 + code) for code in range(1, 27)}
    | {32: " "}
    | {48 + digit: str(digit) for digit in range(10)}
)
_SINGLE = "VALUE"

#: A number, text, or dicts and lists of these.
Value = object


def record_fields(
    program: Program, data: NDArray[np.uint8], starts: NDArray[np.int32]
) -> dict[str, Value]:
    """Read every field of a record.

    Parameters
    ----------
    program : Program
        The layout.
    data : uint8[b]
        The bytes.
    starts : int32[n]
        Begin of the nodes of the record.

    Returns
    -------
    dict
        Items by name in the order of the record. An item is a dict of its fields by name, or the
        value of its only field; list and repetitive items are lists of these; compound items are
        dicts of their sub-items; explicit items are hexadecimal digits without the length.
    """
    items = program.layout.items()
    present = [name for name in items if starts[program.places[name]] >= 0]
    present.sort(key=lambda name: starts[program.places[name]])
    return {name: _read(program, data, starts, name, items[name]) for name in present}


def _read(
    program: Program, data: NDArray[np.uint8], starts: NDArray[np.int32], name: str, item: Item
) -> Value:
    if item.kind == "compound":
        return {
            one.name: _read(program, data, starts, f"{name}/{one.name}", one)
            for one in item.members
            if one and starts[program.places[f"{name}/{one.name}"]] >= 0
        }
    if item.kind == "extended":
        return _merged(_extended(program, data, starts, name, item))
    return _simple(data, int(starts[program.places[name]]), item)


def _simple(data: NDArray[np.uint8], at: int, item: Item) -> Value:
    if item.kind == "list":
        return [_merged(_part(data, place, item.parts[0])) for place in _listed(data, at, item)]
    if item.kind == "repetitive":
        octets = item.parts[0].octets
        return [
            _merged(_part(data, at + 1 + k * octets, item.parts[0])) for k in range(int(data[at]))
        ]
    if item.kind == "explicit":
        return bytes(data[at + 1 : at + int(data[at])]).hex()
    if item.kind == "rfs":
        return int(data[at])
    return _merged(_part(data, at, item.parts[0]))


def _listed(data: NDArray[np.uint8], at: int, item: Item) -> Iterator[int]:
    octets = item.parts[0].octets
    while True:
        yield at
        at += octets
        if not data[at - 1] & 1:
            return


def _extended(
    program: Program, data: NDArray[np.uint8], starts: NDArray[np.int32], name: str, item: Item
) -> dict[str, Value]:
    values = {}
    for number, part in enumerate(item.parts):
        place = starts[program.places[f"{name}+{number}" if number else name]]
        if place >= 0:
            values.update(_part(data, int(place), part))
    return values


def _part(data: NDArray[np.uint8], at: int, part: Part) -> dict[str, Value]:
    whole = int.from_bytes(bytes(data[at : at + part.octets]), "big")
    return {
        field.name: _value(field, whole >> (8 * part.octets - field.begin - field.bits))
        for field in part.fields
        if field.name
    }


def _value(field: Field, shifted: int) -> Value:
    raw = shifted & ((1 << field.bits) - 1)
    if field.form == "octal":
        return f"{raw:0{-(-field.bits // 3)}o}"
    if field.form == "hexadecimal":
        return f"{raw:0{field.bits // 4}x}"
    if field.form == "icao":
        return letters(raw, field.bits).rstrip()
    if field.form == "ascii":
        return raw.to_bytes(field.bits // 8, "big").decode("latin-1").rstrip()
    if field.form == "signed" and raw >> (field.bits - 1):
        raw -= 1 << field.bits
    if (field.numerator, field.denominator) == (1, 1):
        return raw
    return float(Fraction(raw * field.numerator, field.denominator))


def letters(raw: int, bits: int, invalid: str = " ") -> str:
    """Decode six-bit characters of ICAO Annex 10; those not assigned become `invalid`."""
    return "".join(_ICAO.get(raw >> k & 63, invalid) for k in range(bits - 6, -1, -6))


def _merged(values: dict[str, Value]) -> Value:
    return values[_SINGLE] if list(values) == [_SINGLE] else values
