"""System tracks in an invented old order of items, which fits known editions by chance only."""

import random

from support.asterix.octets import block, record, time_of_day

#: Fraction of the records whose status has two octets: they fit the known order by one octet.
BY_CHANCE = 0.13


def old_system_track(generator: random.Random, seconds: float) -> bytes:
    """Write a block with a record of category 062 in an order that no known edition has.

    Its items are 010, the track number, the time of day, a position of three octets for each
    angle, the velocity, and the status.
    """
    return block(
        62,
        record(
            (1, "14fa"),
            (3, f"{generator.randrange(1 << 16):04x}"),
            (4, time_of_day(seconds)),
            (5, generator.randbytes(6).hex()),
            (7, generator.randbytes(4).hex()),
            (13, "01 20" if generator.random() < BY_CHANCE else "00"),
        ),
    )


def old_system_tracks(count: int, seed: int = 7) -> list[bytes]:
    """Write blocks, one for each track."""
    generator = random.Random(seed)
    return [old_system_track(generator, 28_800.0 + 0.05 * k) for k in range(count)]
