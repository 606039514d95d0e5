"""Final format: envelopes with times of reception, and what is left of damaged ones."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.framing.containers import Blocks, read_blocks, read_datagrams
from support.asterix.octets import block, final_format, north_mark, plot_048, rply

ONE = block(48, plot_048(1.0))
TWO = block(48, plot_048(2.0), plot_048(2.5))
NORTH = north_mark(3.0)
# The record ends with octets of the footer, which then overlap it.
LIKE_A_FOOTER = block(48, plot_048(4.0, address="a5a5a5"))
THREE = final_format([(28800.5, ONE), (28800.51, TWO), (28801.0, NORTH)])


def read(tmp_path: Path, content: bytes, name: str = "recording") -> Blocks:
    (tmp_path / name).write_bytes(content)
    return read_blocks(tmp_path / name)


def cut(blocks: Blocks) -> list[bytes]:
    """Return the blocks; check that the octets of the file add up, and that offsets are true."""
    gaps = sum(octets for _, octets, _ in blocks.gaps)
    assert blocks.form == "final"
    assert blocks.framing + gaps + int((blocks.ends - blocks.begins).sum()) == blocks.size
    assert (blocks.offsets == blocks.begins).all()
    return [
        blocks.data[begin:end].tobytes()
        for begin, end in zip(blocks.begins, blocks.ends, strict=True)
    ]


@pytest.mark.parametrize("name", ["recording.ff", "recording.astfin", "recording.gps", "recording"])
def test_envelopes_are_recognised_by_their_content(tmp_path: Path, name: str) -> None:
    blocks = read(tmp_path, THREE, name)
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert blocks.received_s.tolist() == [28800.5, 28800.51, 28801.0]
    assert (blocks.framing, blocks.gaps, blocks.cut) == (36, [], 0)


def test_several_blocks_of_an_envelope_have_one_time(tmp_path: Path) -> None:
    blocks = read(tmp_path, final_format([(5.0, ONE + TWO), (6.0, NORTH)]))
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert blocks.received_s.tolist() == [5.0, 5.0, 6.0]


def test_the_day_of_the_recording_is_no_part_of_the_time(tmp_path: Path) -> None:
    second_day = bytearray(THREE)
    second_day[4] = 2
    assert read(tmp_path, bytes(second_day)).received_s.tolist()[0] == 28800.5


def test_a_time_beyond_a_day_is_unknown(tmp_path: Path) -> None:
    blocks = read(tmp_path, final_format([(86_400.0, ONE), (86_399.99, TWO)]))
    assert np.isnan(blocks.received_s[0])
    assert blocks.received_s[1] == 86_399.99


def test_a_single_envelope_is_recognised(tmp_path: Path) -> None:
    assert cut(read(tmp_path, final_format([(1.0, ONE)]))) == [ONE]


@pytest.mark.parametrize("begin", [1, 5, 15, len(ONE) + 10])
def test_a_recording_that_begins_inside_an_envelope_is_read_from_the_next(
    tmp_path: Path, begin: int
) -> None:
    blocks = read(tmp_path, THREE[begin:])
    assert cut(blocks) == [TWO, NORTH]
    assert blocks.gaps == [
        (0, len(ONE) + 12 - begin, "there is no Final format envelope at this position")
    ]


@pytest.mark.parametrize("noise", [b"\x00", b"\x00\x0d", b"\xff" * 40, b"\xa5" * 9, ONE])
def test_octets_between_envelopes_are_a_gap(tmp_path: Path, noise: bytes) -> None:
    envelopes = [final_format([(float(k), one)]) for k, one in enumerate((ONE, TWO, NORTH, ONE))]
    blocks = read(tmp_path, envelopes[0] + envelopes[1] + noise + envelopes[2] + envelopes[3])
    assert cut(blocks) == [ONE, TWO, NORTH, ONE]
    assert [octets for _, octets, _ in blocks.gaps] == [len(noise)]


@pytest.mark.parametrize("length", [0, 11, 13, 200, 65_535])
def test_a_wrong_length_costs_one_envelope(tmp_path: Path, length: int) -> None:
    envelopes = [final_format([(float(k), one)]) for k, one in enumerate((ONE, NORTH, TWO, ONE))]
    damaged = length.to_bytes(2, "big") + envelopes[2][2:]
    blocks = read(tmp_path, envelopes[0] + envelopes[1] + damaged + envelopes[3])
    assert cut(blocks) == [ONE, NORTH, ONE]


def test_a_wrong_length_that_reaches_a_later_footer_costs_one_envelope(tmp_path: Path) -> None:
    envelopes = [final_format([(float(k), one)]) for k, one in enumerate((ONE, NORTH, TWO, ONE))]
    both = len(envelopes[2]) + len(envelopes[3])
    damaged = both.to_bytes(2, "big") + envelopes[2][2:]
    blocks = read(tmp_path, envelopes[0] + envelopes[1] + damaged + envelopes[3])
    assert cut(blocks) == [ONE, NORTH, ONE]


def test_octets_of_a_footer_inside_a_block_are_data(tmp_path: Path) -> None:
    inside = block(48, plot_048(1.0, range_nm=0.0, code="a5a5", level="a5a5"))
    parts = [(1.0, LIKE_A_FOOTER), (2.0, inside), (3.0, LIKE_A_FOOTER), (4.0, NORTH)]
    whole = final_format(parts)
    assert cut(read(tmp_path, whole)) == [one for _, one in parts]
    # Found again after damage, too.
    first = len(final_format(parts[:2]))
    assert cut(read(tmp_path, whole[:first] + b"\x00" + whole[first:]))[2:] == [
        LIKE_A_FOOTER,
        NORTH,
    ]


def test_a_recording_that_ends_inside_an_envelope_is_reported(tmp_path: Path) -> None:
    blocks = read(tmp_path, THREE[:-5])
    assert cut(blocks) == [ONE, TWO]
    last = len(NORTH) + 12
    assert blocks.gaps == [(len(THREE) - last, last - 5, "a Final format envelope is truncated")]
    assert blocks.cut == last


def test_other_recordings_are_not_final_format(tmp_path: Path) -> None:
    assert read(tmp_path, ONE + b"\xa5" * 4 + TWO).form == "blocks"
    assert read(tmp_path, rply([(0, ONE), (0xA5A5, TWO)])).form == "rply"


def test_replay_has_the_datagrams_and_their_times(tmp_path: Path) -> None:
    (tmp_path / "recording.ff").write_bytes(THREE)
    _, datagrams = read_datagrams(tmp_path / "recording.ff")
    assert datagrams.received_s.tolist() == [28800.5, 28800.51, 28801.0]
