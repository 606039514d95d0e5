"""Random records of a layout: every kind of item, with octets that fit its table."""

import random

from multiradar_converters.asterix.layout.notation import Item, Layout


def random_block(layout: Layout, generator: random.Random, records: int = 3) -> bytes:
    """Write a block of random records; those of category 001 are plots or tracks."""
    body = b"".join(random_record(layout, generator) for _ in range(records))
    return bytes([layout.category]) + (len(body) + 3).to_bytes(2, "big") + body


def random_record(layout: Layout, generator: random.Random) -> bytes:
    """Write a record that begins with the data source."""
    track = len(layout.profiles) - 1 if generator.random() < 0.5 else 0
    profile = layout.profiles[track]
    chosen = [
        place
        for place, item in enumerate(profile)
        if item is not None
        and item.kind != "rfs"
        and (place == 0 or (track and place == 1) or generator.random() < 0.4)
    ]
    parts = [item_octets(profile[place], generator) for place in chosen]
    if len(layout.profiles) > 1 and 1 in chosen:
        # The first bit of item 020 selects the profile.
        parts[1] = bytes([parts[1][0] & 0x7F | track << 7]) + parts[1][1:]
    return _presence(chosen) + b"".join(parts)


def _presence(chosen: list[int]) -> bytes:
    octets = bytearray(chosen[-1] // 7 + 1)
    for place in chosen:
        octets[place // 7] |= 0x80 >> place % 7
    for k in range(len(octets) - 1):
        octets[k] |= 1
    return bytes(octets)


def item_octets(item: Item | None, generator: random.Random) -> bytes:
    """Write random octets of an item."""
    assert item is not None
    if item.kind == "fixed":
        return generator.randbytes(item.parts[0].octets)
    if item.kind == "explicit":
        length = generator.randint(1, 5)
        return bytes([length]) + generator.randbytes(length - 1)
    if item.kind == "repetitive":
        number = generator.randint(0, 3)
        return bytes([number]) + generator.randbytes(number * item.parts[0].octets)
    if item.kind == "list":
        number = generator.randint(1, 3)
        return b"".join(
            _with_more(generator.randbytes(item.parts[0].octets), k < number - 1)
            for k in range(number)
        )
    if item.kind == "extended":
        parts = item.parts[: generator.randint(1, len(item.parts))]
        return b"".join(
            _with_more(generator.randbytes(part.octets), part is not parts[-1])
            if part.more
            else generator.randbytes(part.octets)
            for part in parts
        )
    members = [k for k, one in enumerate(item.members) if one is not None]
    chosen = sorted(generator.sample(members, generator.randint(1, len(members))))
    return _presence(chosen) + b"".join(item_octets(item.members[k], generator) for k in chosen)


def _with_more(octets: bytes, more: bool) -> bytes:
    return octets[:-1] + bytes([octets[-1] & 0xFE | more])
