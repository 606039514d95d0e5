"""Headers and footers of datagrams are framing where many agree in their lengths."""

import random
from pathlib import Path

import pytest

from multiradar_converters.asterix.framing import datagrams
from multiradar_converters.asterix.framing.containers import Blocks, read_blocks
from support.asterix.octets import (
    block,
    datagram,
    final_format,
    north_mark,
    pcap,
    plot_048,
    record,
    rply,
)

ONE = block(48, plot_048(1.0))
TWO = ONE + block(48, plot_048(2.0), plot_048(2.5))
NORTH = north_mark(3.0)
CONTENTS = (ONE, TWO, NORTH, NORTH + ONE)


def read(tmp_path: Path, payloads: list[bytes], form: str = "capture") -> Blocks:
    """Return the blocks of a recording; check that its octets add up."""
    times = range(len(payloads))
    whole = {
        "capture": lambda: pcap((1.0 + k, datagram(payloads[k])) for k in times),
        "final": lambda: final_format((1.0 + k, payloads[k]) for k in times),
        "rply": lambda: rply((40, payloads[k]) for k in times),
    }[form]()
    (tmp_path / "recording").write_bytes(whole)
    blocks = read_blocks(tmp_path / "recording")
    assert blocks.form == form
    gaps = sum(octets for _, octets, _ in blocks.gaps)
    assert blocks.framing + gaps + int((blocks.ends - blocks.begins).sum()) == blocks.size
    return blocks


def content(blocks: Blocks) -> bytes:
    """Return the octets of all blocks."""
    return b"".join(
        blocks.data[begin:end].tobytes()
        for begin, end in zip(blocks.begins, blocks.ends, strict=True)
    )


@pytest.mark.parametrize(("header", "footer"), [(0, 8), (6, 0), (6, 8), (32, 32), (1, 0), (0, 1)])
@pytest.mark.parametrize("form", ["capture", "final"])
def test_octets_around_the_blocks_of_every_datagram_are_framing(
    tmp_path: Path, form: str, header: int, footer: int
) -> None:
    """Whatever they contain: counters, times, checks."""
    generator = random.Random(7)
    inner = [generator.choice(CONTENTS) for _ in range(60)]
    payloads = [generator.randbytes(header) + one + generator.randbytes(footer) for one in inner]
    blocks = read(tmp_path, payloads, form)
    plain = read(tmp_path, inner, form)
    assert blocks.gaps == []
    assert content(blocks) == b"".join(inner)
    assert blocks.framing == plain.framing + 60 * (header + footer)


def test_footers_in_a_replay_file_are_framing(tmp_path: Path) -> None:
    blocks = read(tmp_path, [ONE + bytes([k] * 8) for k in range(20)], "rply")
    assert (content(blocks), blocks.gaps) == (ONE * 20, [])


def test_flows_with_and_without_footers_are_distinguished(tmp_path: Path) -> None:
    payloads = [one for k in range(20) for one in (ONE, TWO + bytes([k] * 8), b"\xff" * 4 + NORTH)]
    blocks = read(tmp_path, payloads)
    assert blocks.gaps == []
    assert content(blocks) == (ONE + TWO + NORTH) * 20


def test_a_footer_in_the_form_of_a_block_is_framing(tmp_path: Path) -> None:
    payloads = [ONE + bytes([48 if k % 4 == 0 else 7, 0, 200, k]) for k in range(40)]
    assert read(tmp_path, payloads).gaps == []


def test_octets_after_few_datagrams_are_not_framing(tmp_path: Path) -> None:
    blocks = read(tmp_path, [ONE] * 50 + [ONE + bytes(8)] * 4)
    assert [octets for _, octets, _ in blocks.gaps] == [8] * 4


def test_damage_of_any_length_is_not_framing(tmp_path: Path) -> None:
    payloads = [ONE + bytes([255] * (1 + k % 16)) for k in range(64)]
    assert len(read(tmp_path, payloads).gaps) == 64


def test_blocks_cut_off_by_the_recorder_are_not_framing(tmp_path: Path) -> None:
    blocks = read(tmp_path, [TWO[: len(ONE) + 20]] * 50)
    assert content(blocks) == ONE * 50
    assert len(blocks.gaps) == 50


def test_a_block_of_an_unknown_category_at_the_end_is_a_block(tmp_path: Path) -> None:
    private = block(253, record((1, "0102"), (2, "00")))
    blocks = read(tmp_path, [ONE + private] * 50)
    assert (content(blocks), blocks.gaps) == ((ONE + private) * 50, [])


def test_damaged_datagrams_among_those_with_a_footer_are_gaps(tmp_path: Path) -> None:
    good, bad = ONE + bytes(8), ONE[:-3] + bytes(8)
    blocks = read(tmp_path, [good] * 30 + [bad] + [good] * 30)
    assert len(blocks.begins) >= 60
    assert len(blocks.gaps) >= 1


def test_datagrams_have_the_same_blocks_however_many_are_split_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    generator = random.Random(8)
    payloads = [generator.choice([*CONTENTS, ONE[:-3], ONE + bytes(3)]) for _ in range(300)]
    at_once = read(tmp_path, payloads)
    monkeypatch.setattr(datagrams, "_NOTED", 64)
    in_parts = read(tmp_path, payloads)
    assert at_once.gaps
    assert in_parts.gaps == at_once.gaps
    assert (in_parts.begins.tolist(), in_parts.ends.tolist()) == (
        at_once.begins.tolist(), at_once.ends.tolist()
    )  # fmt: skip
