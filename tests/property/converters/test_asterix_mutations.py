"""No octets crash or stop the decoder, and each octet is accounted for.

A million blocks: `TEST_ASTERIX_MUTATIONS=1000000 pytest` with this file (some eight minutes).
"""

import os
import random
from pathlib import Path

import pytest

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.decoding.timing import time_targets
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.catalogue import layouts
from support.asterix.octets import (
    block,
    datagram,
    final_format,
    gps,
    mutated,
    north_mark,
    pcap,
    plot_001,
    plot_048,
    record,
)

BLOCKS = int(os.environ.get("TEST_ASTERIX_MUTATIONS", "12000"))
AT_ONCE = 2000

SEEDS = (
    block(48, plot_048(1.0), plot_048(2.0, source="14 01")),
    block(1, plot_001(3.0), plot_001(None)),
    block(1, record((1, "1482"), (2, "a1 80"), (3, "00bb"), (4, "1900 4000"), (13, "03 05 02"))),
    north_mark(4.0),
    block(34, record((1, "1482"), (2, "02"), (3, "000200"), (4, "40"), (6, "94 40 60 4400"))),
    block(20, record((1, "14c9"), (2, "41 00"), (3, "00ff00"), (4, "00200000 00100000"))),
    block(21, record((1, "0003"), (2, "01 08"), (6, "214fba 08bee1"), (11, "1a4b65"))),
    block(21, record((1, "0005"), (2, "40 54"), (3, "1c293e"), (4, "006e4cc9 ffe606d6"))),
    block(62, record((1, "0004"), (11, "c1 20 4b18f3 204271e311e0 00fd"), (26, "2101 03 200100"))),
    block(8, record((1, "1482"), (2, "fe"), (4, "02 010203 040506"))),
    block(10, record((1, "0000"), (2, "01"), (5, "123875f5 0fc4ed20"))),
    block(63, record((1, "0005"), (5, "03 05 04"), (6, "ffcb"))),
    block(30, record((1, "0001"), (15, "05 0f 11 80"), (50, "0617cf 0617ce"))),
    block(252, record((1, "0007"), (4, "32"), (5, "04"), (6, "01 400b"))),
)


def test_the_seeds_are_whole() -> None:
    known = {layout.category for layout in layouts()}
    assert {one[0] for one in SEEDS} <= known


def mutations(count: int, seed: int, share: float) -> list[bytes]:
    generator = random.Random(seed)
    return [
        mutated(generator.choice(SEEDS), generator) if generator.random() < share else one
        for one in (generator.choice(SEEDS) for _ in range(count))
    ]


@pytest.mark.parametrize(
    ("form", "share", "kept"),
    # Back to back, a block with a wrong length takes those after it along.
    [
        ("blocks", 0.1, 0.8),
        ("gps", 0.1, 0.8),
        ("blocks", 0.8, 0.0),
        ("capture", 0.8, 0.3),
        ("final", 0.8, 0.3),
    ],
)
@pytest.mark.fault(1)
def test_every_octet_of_mutated_blocks_is_accounted_for(
    tmp_path: Path, form: str, share: float, kept: float
) -> None:
    broken = records = 0
    for seed in range(-(-BLOCKS // AT_ONCE)):
        parts = mutations(AT_ONCE, seed, share)
        if form == "blocks":
            whole = b"".join(parts)
        elif form == "gps":
            whole = gps((float(k), one) for k, one in enumerate(parts))
        elif form == "final":
            whole = final_format((float(k), one) for k, one in enumerate(parts))
        else:
            whole = pcap((1.0 + k, datagram(one)) for k, one in enumerate(parts))
        path = tmp_path / "mutated"
        path.write_bytes(whole)
        gathered = gather(read_blocks(path), Editions())
        assert sum(gathered.octets.values()) == len(whole)
        time_targets(gathered)
        broken += len(gathered.broken)
        records += sum(gathered.records.values())
    assert broken > 0.02 * BLOCKS
    assert records > kept * BLOCKS


@pytest.mark.fault(2)
def test_every_octet_of_damaged_envelopes_is_accounted_for(tmp_path: Path) -> None:
    records = 0
    for seed in range(4):
        generator = random.Random(seed)
        envelopes = [
            final_format([(float(k), generator.choice(SEEDS))]) for k in range(AT_ONCE // 2)
        ]
        whole = b"".join(
            mutated(one, generator) if generator.random() < 0.2 else one for one in envelopes
        )
        path = tmp_path / "mutated"
        path.write_bytes(whole)
        blocks = read_blocks(path)
        gathered = gather(blocks, Editions())
        assert blocks.form == "final"
        assert sum(gathered.octets.values()) == len(whole)
        records += sum(gathered.records.values())
    # A damaged envelope costs its own block, and rarely that of a neighbour.
    assert records > 0.75 * 2 * AT_ONCE


def test_mutated_files_as_a_whole_are_accounted_for(tmp_path: Path) -> None:
    generator = random.Random(5)
    whole = {
        "gps": gps((float(k), one) for k, one in enumerate(SEEDS)),
        "capture": pcap((1.0 + k, datagram(one)) for k, one in enumerate(SEEDS)),
    }
    path = tmp_path / "mutated"
    for k in range(max(BLOCKS // 40, 1)):
        content = mutated(whole["gps" if k % 2 else "capture"], generator)
        if content[:4] == whole["capture"][:4] and content[20:24] != whole["capture"][20:24]:
            # Another link type is rejected as a whole.
            continue
        path.write_bytes(content)
        gathered = gather(read_blocks(path), Editions())
        assert sum(gathered.octets.values()) == len(content)


def test_runs_of_one_octet_are_skipped(tmp_path: Path) -> None:
    """What a bad disk leaves: some octets look like blocks at every place."""
    path = tmp_path / "run"
    good = SEEDS[0] * 3
    for octet in range(256):
        content = good + bytes([octet]) * 30_000 + good
        path.write_bytes(content)
        gathered = gather(read_blocks(path), Editions())
        assert sum(gathered.octets.values()) == len(content)
        assert gathered.records[48, 20 << 8 | 130] >= 3
