"""libasterix, an independent decoder, with results in the form of `record_fields`: leaves in order.

It is no dependency of the project: `pip install libasterix` in an environment of its own.
"""

from collections.abc import Iterator
from typing import Any

Leaf = tuple[str, int | float | str]

#: Class names of libasterix for the newest edition of each layout that both know.
PEER_EDITIONS = {
    "001 1.4": "Cat_001_1_4",
    "002 1.2": "Cat_002_1_2",
    "004 1.13": "Cat_004_1_13",
    "008 1.3": "Cat_008_1_3",
    "010 1.1": "Cat_010_1_1",
    "019 1.3": "Cat_019_1_3",
    "020 1.11": "Cat_020_1_11",
    "021 2.7": "Cat_021_2_7",
    "021 0.26": "Cat_021_0_26",
    "034 1.29": "Cat_034_1_29",
    "048 1.32": "Cat_048_1_32",
    "062 1.21": "Cat_062_1_21",
    "063 1.7": "Cat_063_1_7",
    "065 1.6": "Cat_065_1_6",
    "247 1.3": "Cat_247_1_3",
}


#: Items of category 010 with a last bit of 1/16 in libasterix 0.36, of 1/4 m/s(²) in the standard.
_OTHER_UNITS = ("202/VX", "202/VY", "210/AX", "210/AY")


def peer_records(generated: Any, base: Any, layout: str, body: bytes) -> list[list[Leaf]] | None:
    """Decode the records of a block; None where libasterix rejects it."""
    uap = getattr(generated, PEER_EDITIONS[layout]).cv_uap
    bits = base.Bits.from_bytes(body)
    if not issubclass(uap, base.UapMultiple):
        parsed = uap.parse(bits)
        return None if isinstance(parsed, ValueError) else [_record(base, one) for one in parsed]
    records = []
    while len(bits):
        one = _either(base, uap, bits)
        if one is None:
            return None
        record, bits = one
        records.append(_record(base, record))
    return records


def _either(base: Any, uap: Any, bits: Any) -> tuple[Any, Any] | None:
    """Parse as a plot, or as a track where the plot is marked as one."""
    mode = base.ParsingMode.StrictParsing
    track = uap.cv_uaps["track"]._parse(mode, bits)
    if not isinstance(track, ValueError) and _leaf(base, track[0], "020", "TYP") == 1:
        return track[0], track[1]
    plot = uap.cv_uaps["plot"]._parse(mode, bits)
    return None if isinstance(plot, ValueError) else (plot[0], plot[1])


def _leaf(base: Any, record: Any, item: str, name: str) -> int | float | str | None:
    for path, value in _record(base, record):
        if path == f"{item}/{name}":
            return value
    return None


def _record(base: Any, record: Any) -> list[Leaf]:
    leaves: list[Leaf] = []
    for name, item in record.items_regular.items():
        leaves += _variation(base, item.arg.arg, name)
    for group in record.items_rfs:
        for name, item in group:
            leaves += _variation(base, item.arg.arg, name)
    return sorted(leaves, key=lambda leaf: leaf[0].split("/")[0])


def _variation(base: Any, variation: Any, path: str) -> Iterator[Leaf]:
    if isinstance(variation, base.Element):
        yield path, _value(base, variation)
    elif isinstance(variation, base.Explicit):
        yield path, variation.get_bytes().hex()
    elif isinstance(variation, base.Compound):
        for name, item in variation.arg.items():
            yield from _variation(base, item.arg.arg, f"{path}/{name}")
    else:
        yield from _several(base, variation, path)


def _several(base: Any, variation: Any, path: str) -> Iterator[Leaf]:
    for one in variation.arg:
        if isinstance(variation, base.Repetitive):
            yield from _variation(base, one, path)
        else:
            for item in one if isinstance(variation, base.Extended) else [one]:
                yield from _item(base, item, path)


def _item(base: Any, item: Any, path: str) -> Iterator[Leaf]:
    if isinstance(item, base.Item):
        name = item.cv_non_spare.cv_name
        yield from _variation(base, _ruled(base, item.arg.arg), f"{path}/{name}")


def _ruled(base: Any, rule: Any) -> Any:
    """Return the content of a rule; its default where it depends on other items."""
    if isinstance(rule, base.RuleVariationContextFree):
        return rule.arg
    variation, _ = rule.cv_default_variation._parse(rule.bs)
    return variation


def _value(base: Any, element: Any) -> int | float | str:
    rule = element._get_rule()
    if not isinstance(rule, base.RuleContentContextFree):
        return int(element.as_uint())
    content = rule._get_content()
    if isinstance(content, base.ContentQuantity):
        return float(content._as_quantity())
    if isinstance(content, base.ContentInteger):
        return int(content.as_integer())
    if isinstance(content, base.ContentString):
        return str(content.as_string())
    if isinstance(content, base.ContentBds):
        return f"{element.as_uint():0{element.cv_bit_size // 4}x}"
    return int(element.as_uint())


def own_leaves(fields: dict[str, object]) -> list[Leaf]:
    """Convert the result of `record_fields` to the same form."""
    leaves = [leaf for name, value in fields.items() for leaf in _leaves(value, name)]
    return sorted(leaves, key=lambda leaf: leaf[0].split("/")[0])


def _leaves(value: object, path: str) -> Iterator[Leaf]:
    if isinstance(value, dict):
        for name, one in value.items():
            yield from _leaves(one, f"{path}/{name}".replace("_", "/"))
    elif isinstance(value, list):
        for one in value:
            yield from _leaves(one, path)
    elif isinstance(value, int | float | str):
        yield path, value


def differences(layout: str, own: list[Leaf], peer: list[Leaf]) -> list[tuple[Leaf, Leaf]]:
    """Return the leaves that differ: numbers by more than rounding, text by more than blanks."""
    if len(own) != len(peer):
        return [(("number of leaves", len(own)), ("number of leaves", len(peer)))]
    other_units = _OTHER_UNITS if layout.startswith("010 ") else ()
    return [pair for pair in zip(own, peer, strict=True) if not _alike(*pair, other_units)]


def _alike(own: Leaf, peer: Leaf, other_units: tuple[str, ...]) -> bool:
    (path, mine), (other_path, theirs) = own, peer
    if path in other_units and isinstance(theirs, float):
        theirs *= 4
    if path != other_path:
        return False
    if isinstance(mine, str) and isinstance(theirs, str):
        # Codes without a letter are blanks here, question marks or nothing there.
        return _letters(mine) == _letters(theirs)
    if isinstance(mine, str) or isinstance(theirs, str):
        return False
    return abs(mine - theirs) <= 1e-9 * max(1.0, abs(theirs))


def _letters(text: str) -> str:
    return "".join(one for one in text if one.isascii() and one.isalnum())
