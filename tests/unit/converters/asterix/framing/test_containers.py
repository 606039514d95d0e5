"""Files are split into blocks: each octet belongs to a block, the framing, or a reported gap."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.framing.containers import Blocks, read_blocks
from multiradar_converters.errors import LayoutError
from support.asterix.octets import (
    block,
    datagram,
    frame,
    gps,
    north_mark,
    octets,
    pcap,
    pcapng,
    plot_048,
    record,
)
from support.asterix.surface_records import mlat_020, surface_010, update_cycle_010

ONE = block(48, plot_048(1.0))
TWO = block(48, plot_048(2.0), plot_048(2.5))
NORTH = north_mark(3.0)
PRIVATE = block(255, record((1, "0102")))


def read(tmp_path: Path, content: bytes) -> Blocks:
    path = tmp_path / "recording"
    path.write_bytes(content)
    return read_blocks(path)


def cut(blocks: Blocks) -> list[bytes]:
    """Return the blocks; check that the octets of the file add up, and that offsets are true."""
    gaps = sum(octets for _, octets, _ in blocks.gaps)
    assert blocks.framing + gaps + int((blocks.ends - blocks.begins).sum()) == blocks.size
    return [
        blocks.data[begin:end].tobytes()
        for begin, end in zip(blocks.begins, blocks.ends, strict=True)
    ]


def test_blocks_back_to_back(tmp_path: Path) -> None:
    blocks = read(tmp_path, ONE + TWO + NORTH)
    assert blocks.form == "blocks"
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert blocks.offsets.tolist() == [0, len(ONE), len(ONE + TWO)]
    assert np.isnan(blocks.received_s).all()


def test_an_empty_file_has_no_blocks(tmp_path: Path) -> None:
    assert cut(read(tmp_path, b"")) == []


@pytest.mark.parametrize(
    "noise", [b"\x30\x00", b"\x00\x30\x00", b"\x30\x00\x02\xff\xff", b"\x31" * 40]
)
def test_blocks_after_noise_are_found_again(tmp_path: Path, noise: bytes) -> None:
    blocks = read(tmp_path, ONE + noise + TWO + NORTH)
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert blocks.gaps == [(len(ONE), len(noise), "there is no block at this position")]


@pytest.mark.parametrize("octets_of_padding", [1, 2, 3, 7, 32])
def test_zeros_between_blocks_are_padding(tmp_path: Path, octets_of_padding: int) -> None:
    """After zeros, the octets of a length can look like a category: 00 30 00 of 00 00 30 00."""
    zeros = bytes(octets_of_padding)
    blocks = read(tmp_path, zeros + ONE + zeros + TWO + zeros + NORTH + zeros)
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert {reason for _, _, reason in blocks.gaps} == {"padding"}
    found = gather(blocks, Editions())
    assert (found.broken, found.octets["framing"]) == ([], 4 * len(zeros))


def test_zeros_and_the_octets_after_them_are_no_block_of_category_zero(tmp_path: Path) -> None:
    """00 00 0a would be one of ten octets, and 2a of the time of day category 042 after it."""
    blocks = [
        one
        for time_s in range(86_100, 86_200)
        for one in (
            block(
                10,
                update_cycle_010(time_s),
                *(surface_010(time_s, local=(90.0 * n, n)) for n in range(11)),
            ),
            block(20, *(mlat_020(time_s + 0.3, local=(90.0 * n, n)) for n in range(12))),
        )
    ]
    assert cut(read(tmp_path, b"\0\0".join(blocks))) == blocks


def test_many_zeros_between_blocks_are_a_gap(tmp_path: Path) -> None:
    blocks = read(tmp_path, ONE + bytes(33) + TWO)
    assert cut(blocks) == [ONE, TWO]
    assert blocks.gaps == [(len(ONE), 33, "there is no block at this position")]


def test_a_block_that_is_cut_off_is_a_gap(tmp_path: Path) -> None:
    blocks = read(tmp_path, ONE + TWO[:-1])
    assert cut(blocks) == [ONE]
    assert blocks.gaps == [(len(ONE), len(TWO) - 1, "there is no block at this position")]


def test_blocks_of_unknown_categories_are_blocks_where_others_follow(tmp_path: Path) -> None:
    assert cut(read(tmp_path, PRIVATE + PRIVATE + ONE + PRIVATE)) == [
        PRIVATE,
        PRIVATE,
        ONE,
        PRIVATE,
    ]


def test_blocks_of_one_unknown_source_confirm_each_other(tmp_path: Path) -> None:
    """However many follow each other, and although some of their octets look like a block."""
    unknown = [
        block(62, record((1, "14fa"), (2, f"{number:02x}{ONE[:4].hex()}"))) for number in range(50)
    ]
    assert cut(read(tmp_path, b"".join(unknown) + ONE)) == [*unknown, ONE]


def test_a_gps_recording_gives_the_time_of_reception(tmp_path: Path) -> None:
    blocks = read(tmp_path, gps([(28800.5, ONE), (28801.0, NORTH)]))
    assert blocks.form == "gps"
    assert cut(blocks) == [ONE, NORTH]
    assert blocks.received_s.tolist() == [28800.5, 28801.0]
    assert blocks.framing == 2200 + 20


@pytest.mark.parametrize("ending", [".gps", ".GPS"])
def test_a_gps_recording_with_another_header_is_reported_by_its_name(
    tmp_path: Path, ending: str
) -> None:
    path = tmp_path / f"recording{ending}"
    path.write_bytes(b"recorder 7".ljust(2200) + gps([(1.0, ONE), (2.0, TWO)])[2200:])
    blocks = read_blocks(path)
    assert (blocks.form, cut(blocks)) == ("gps", [ONE, TWO])
    path.write_bytes((ONE + TWO) * 40)
    assert read_blocks(path).form == "blocks"


def test_a_gps_recording_without_its_header_loses_no_block(tmp_path: Path) -> None:
    """Regression: its first 2 200 octets were skipped as a header, without a message."""
    path = tmp_path / "recording.gps"
    rows = [(float(number), (ONE, TWO, NORTH)[number % 3]) for number in range(90)]
    path.write_bytes(gps(rows)[2200:])
    blocks = read_blocks(path)
    assert cut(blocks) == [one for _, one in rows]
    assert (blocks.form, blocks.gaps, blocks.framing) == ("gps without header", [], 900)
    assert blocks.received_s.tolist() == [time_s for time_s, _ in rows]


def test_a_gps_recording_goes_on_after_noise(tmp_path: Path) -> None:
    whole = gps([(1.0, ONE)]) + octets("ff 0000 11") + gps([(2.0, TWO), (3.0, NORTH)])[2200:]
    blocks = read(tmp_path, whole)
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert [octets for _, octets, _ in blocks.gaps] == [4]


def test_a_capture_gives_several_blocks_of_a_datagram(tmp_path: Path) -> None:
    arp = bytes(12) + octets("0806") + bytes(28)
    packets = [(1000.25, datagram(ONE + TWO)), (1000.5, arp), (1001.0, datagram(NORTH, vlan=True))]
    blocks = read(tmp_path, pcap(packets))
    assert blocks.form == "capture"
    assert cut(blocks) == [ONE, TWO, NORTH]
    assert blocks.received_s.tolist() == [1000.25, 1000.25, 1001.0]
    assert blocks.offsets[0] == 24 + 16 + 14 + 20 + 8


def test_padding_of_short_frames_is_no_payload(tmp_path: Path) -> None:
    assert cut(read(tmp_path, pcap([(1.0, datagram(NORTH) + bytes(9))]))) == [NORTH]


def fragments(payload: bytes) -> tuple[bytes, bytes]:
    udp = bytes.fromhex("2198 2198") + (len(payload) + 8).to_bytes(2, "big") + bytes(2) + payload
    return frame(udp[:24], flags=0x2000), frame(udp[24:], flags=3)


@pytest.mark.parametrize("turned", [False, True])
def test_fragments_are_put_together_in_either_order(tmp_path: Path, turned: bool) -> None:
    parts = fragments(ONE + TWO)
    packets = [(1.0, one) for one in (reversed(parts) if turned else parts)]
    assert cut(read(tmp_path, pcap(packets))) == [ONE, TWO]


def test_a_fragment_without_its_rest_is_reported(tmp_path: Path) -> None:
    first, _ = fragments(ONE + TWO)
    blocks = read(tmp_path, pcap([(1.0, first), (2.0, datagram(NORTH))]))
    assert cut(blocks) == [NORTH]
    assert [reason for *_, reason in blocks.gaps] == ["fragments of this datagram are missing"]


@pytest.mark.fault(2)
def test_a_truncated_capture_is_read_up_to_its_end(tmp_path: Path) -> None:
    blocks = read(tmp_path, pcap([(1.0, datagram(ONE)), (2.0, datagram(TWO))])[:-3])
    assert cut(blocks) == [ONE]
    assert [reason for *_, reason in blocks.gaps] == ["a packet is truncated"]


def test_a_capture_of_the_next_generation(tmp_path: Path) -> None:
    packet = datagram(ONE)
    nanoseconds = 5_250_000_000
    header = (
        bytes(4)
        + (nanoseconds >> 32).to_bytes(4, "little")
        + (nanoseconds & 0xFFFFFFFF).to_bytes(4, "little")
        + 2 * len(packet).to_bytes(4, "little")
    )
    whole = pcapng(
        (1, octets("0100 0000 00000000 0900 0100 09000000")), (6, header + packet)
    )  # fmt: skip
    blocks = read(tmp_path, whole)
    assert cut(blocks) == [ONE]
    assert blocks.received_s.tolist() == pytest.approx([5.25])


def test_an_unknown_link_is_rejected_by_name(tmp_path: Path) -> None:
    whole = bytearray(pcap([(1.0, datagram(ONE))]))
    whole[20] = 147
    with pytest.raises(LayoutError, match="found link type 147"):
        read(tmp_path, bytes(whole))


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(LayoutError, match="cannot be read"):
        read_blocks(tmp_path / "missing")
