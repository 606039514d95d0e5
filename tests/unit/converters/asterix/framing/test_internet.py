"""Datagrams are found in packets of every link, of both versions of IP, whole or in fragments."""

import math
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.framing.containers import Blocks, read_blocks
from multiradar_converters.asterix.framing.datagrams import Datagrams, split_datagrams
from support.asterix.octets import block, datagram, frame, north_mark, octets, pcap, pcapng

ONE = north_mark(1.0)
TWO = block(2, b"\xf0\x14\x82\x01\x00\x00\x00\x80")


def udp(payload: bytes) -> bytes:
    return struct.pack(">4H", 8600, 8600, len(payload) + 8, 0) + payload


def checksummed(whole: bytes, version: int) -> bytes:
    """Return a datagram between the addresses of the packets here, with a checksum."""
    addresses = bytes([10, 0, 0, 1, 239, 0, 0, 1]) if version == 4 else bytes(range(32))
    octets = addresses + struct.pack(">2H", 17, len(whole)) + whole + bytes(len(whole) % 2)
    total = sum(int.from_bytes(octets[k : k + 2], "big") for k in range(0, len(octets), 2))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return whole[:6] + ((total ^ 0xFFFF) or 0xFFFF).to_bytes(2, "big") + whole[8:]


def version_4(payload: bytes) -> bytes:
    return frame(udp(payload))[14:]


def version_6(body: bytes, following: int = 17) -> bytes:
    return struct.pack(">IHBB", 0x6000_0000, len(body), following, 1) + bytes(range(32)) + body


def ethernet(packet: bytes, kind: str = "0800", tags: str = "") -> bytes:
    return bytes(12) + octets(tags) + octets(kind) + packet


def capture(link: int, *packets: bytes) -> bytes:
    whole = bytearray(pcap((float(k), packet) for k, packet in enumerate(packets)))
    whole[20:24] = link.to_bytes(4, "little")
    return bytes(whole)


def read(folder: Path, whole: bytes) -> Blocks:
    path = folder / "recording"
    path.write_bytes(whole)
    blocks = read_blocks(path)
    taken = int((blocks.ends - blocks.begins).sum()) + sum(size for _, size, _ in blocks.gaps)
    assert blocks.framing + taken == len(whole)
    return blocks


def cut(blocks: Blocks) -> list[bytes]:
    pairs = zip(blocks.begins.tolist(), blocks.ends.tolist(), strict=True)
    return [blocks.data[a:b].tobytes() for a, b in pairs]


LINKS: dict[str, tuple[int, Callable[[bytes], bytes]]] = {
    "ethernet": (1, lambda b: ethernet(version_4(b))),
    "one tag": (1, lambda b: ethernet(version_4(b), tags="8100 0005")),
    "old tag": (1, lambda b: ethernet(version_4(b), tags="9100 0005 8100 0006")),
    "two tags": (1, lambda b: ethernet(version_4(b), tags="88a8 0005 8100 0006")),
    "version 6": (1, lambda b: ethernet(version_6(udp(b)), "86dd")),
    "raw": (101, version_4),
    "raw version 6": (229, lambda b: version_6(udp(b))),
    "cooked": (113, lambda b: bytes(14) + octets("0800") + version_4(b)),
    "cooked 2": (276, lambda b: octets("0800") + bytes(18) + version_4(b)),
    "loopback": (0, lambda b: octets("02000000") + version_4(b)),
}


@pytest.mark.parametrize("name", LINKS)
def test_every_link_is_read(name: str, tmp_path: Path) -> None:
    link, packet = LINKS[name]
    blocks = read(tmp_path, capture(link, packet(ONE + TWO), packet(TWO)))
    assert cut(blocks) == [ONE, TWO, TWO]
    assert blocks.received_s.tolist() == [0.0, 0.0, 1.0]


def test_a_length_that_is_left_to_the_card_is_that_of_the_packet(tmp_path: Path) -> None:
    packet = bytearray(datagram(ONE))
    packet[16:18] = b"\0\0"
    assert cut(read(tmp_path, capture(1, bytes(packet)))) == [ONE]


def test_what_is_no_udp_is_framing(tmp_path: Path) -> None:
    packets = [
        ethernet(b"\0" * 46, "0806"),
        ethernet(b"\x45" + bytes(60)),
        ethernet(version_6(b"\x3a" * 40, 58), "86dd"),
        ethernet(b"\x95" * 60),
        b"\x01\x02",
        ethernet(b""),
    ]
    blocks = read(tmp_path, capture(1, *packets, datagram(ONE)))
    assert cut(blocks) == [ONE]
    assert blocks.gaps == []


@pytest.mark.parametrize("turned", [False, True])
def test_fragments_of_version_6_are_put_together(turned: bool, tmp_path: Path) -> None:
    whole = udp(ONE * 5)
    parts = [
        version_6(struct.pack(">BBHI", 17, 0, place | more, 77) + whole[place:end], 44)
        for place, end, more in ((0, 24, 1), (24, 48, 1), (48, len(whole), 0))
    ]
    packets = [ethernet(part, "86dd") for part in (reversed(parts) if turned else parts)]
    assert cut(read(tmp_path, capture(1, *packets))) == [ONE] * 5


def test_packets_of_all_kinds_of_the_next_generation_are_read(tmp_path: Path) -> None:
    packet = datagram(ONE)
    sizes = struct.pack("<II", len(packet), len(packet))
    microseconds = struct.pack("<II", 0, 2_000_000)
    whole = pcapng(
        (1, struct.pack("<HHI", 1, 0, 0)),
        (1, struct.pack("<HHI", 147, 0, 0)),
        (3, struct.pack("<I", len(packet)) + packet),
        (2, struct.pack("<HH", 0, 9) + microseconds + sizes + packet),
        (6, struct.pack("<I", 0) + microseconds + sizes + packet),
        (6, struct.pack("<I", 1) + microseconds + sizes + packet),
        (6, struct.pack("<I", 2) + microseconds + sizes + packet),
        (6, struct.pack("<I", 0) + microseconds + struct.pack("<II", 999, 999) + packet),
        (3, b"\x01"),
    )
    blocks = read(tmp_path, whole)
    assert cut(blocks) == [ONE] * 3
    first, *others = blocks.received_s.tolist()
    assert math.isnan(first)
    assert others == [2.0, 2.0]
    assert [reason for *_, reason in blocks.gaps] == [
        "a packet without an interface description block",
        "a packet that does not fit into its block",
        "link type 147 is unknown",
    ]


def test_the_time_offset_of_an_interface_is_added(tmp_path: Path) -> None:
    packet = datagram(ONE)
    options = struct.pack("<2HB3x", 9, 1, 3) + struct.pack("<2Hq", 14, 8, 1_500_000_000)
    options += struct.pack("<2H", 0, 0)
    sizes = struct.pack("<II", len(packet), len(packet))
    whole = pcapng(
        (1, struct.pack("<HHI", 1, 0, 0) + options),
        (6, struct.pack("<3I", 0, 0, 2_500) + sizes + packet),
    )
    assert read(tmp_path, whole).received_s.tolist() == [1_500_000_002.5]


# Fragments of different datagrams with the same identification, each with its time of reception.
_OLD, _NEW = udp(ONE * 4), udp(TWO * 5)
_MISSING = "fragments of this datagram are missing"
#: The half that arrived first, of which the other is lost.
_FIRST, _SECOND = (_OLD, 0, 24), (_OLD, 24, len(_OLD))


def _fragment(whole: bytes, place: int, end: int) -> bytes:
    more = int(end < len(whole))
    header = struct.pack(">BBHI", 17, 0, place | more, 77)
    return ethernet(version_6(header + whole[place:end], 44), "86dd")


@pytest.mark.parametrize(
    ("lost", "after_s", "gaps"),
    [
        # A first fragment that differs starts another datagram, however soon.
        (_FIRST, 1.0, [(24, _MISSING)]),
        (_FIRST, 31.0, [(24, _MISSING)]),
        (_SECOND, 31.0, [(len(_OLD) - 24, _MISSING)]),
        # Files of different recorders, joined.
        (_SECOND, -31.0, [(len(_OLD) - 24, _MISSING)]),
    ],
)
def test_fragments_are_never_joined_with_a_later_datagram_of_the_same_identification(
    lost: tuple[bytes, int, int], after_s: float, gaps: list[tuple[int, str]], tmp_path: Path
) -> None:
    parts = [(40.0, _fragment(*lost))]
    parts += [
        (40.0 + after_s, _fragment(_NEW, place, end)) for place, end in ((0, 24), (24, len(_NEW)))
    ]
    blocks = read(tmp_path, pcap(parts))
    assert cut(blocks) == [TWO] * 5
    assert [(size, reason) for _, size, reason in blocks.gaps] == gaps


def test_fragments_of_up_to_30_s_and_repeated_ones_are_one_datagram(tmp_path: Path) -> None:
    first, second = _fragment(*_FIRST), _fragment(*_SECOND)
    blocks = read(tmp_path, pcap([(0.0, first), (1.0, first), (30.0, second)]))
    assert (cut(blocks), blocks.gaps) == ([ONE] * 4, [])


@pytest.mark.parametrize("order", ["f1 f1 f2 f2", "f1 f2 f1 f2", "f2 f2 f1 f1"])
def test_fragments_that_a_mirror_repeats_are_framing(order: str, tmp_path: Path) -> None:
    """The second copy of the last fragment became the end of the next datagram."""
    packets = []
    for whole in (_OLD, _NEW, udp(ONE * 6)):
        parts = {"f1": _fragment(whole, 0, 24), "f2": _fragment(whole, 24, len(whole))}
        packets += [(1.0, parts[name]) for name in order.split()]
    blocks = read(tmp_path, pcap(packets))
    assert (cut(blocks), blocks.gaps) == ([ONE] * 4 + [TWO] * 5 + [ONE] * 6, [])


@pytest.mark.parametrize("lost", [0, 24])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("version", [4, 6])
@pytest.mark.parametrize("checked", [False, True])
def test_a_fragment_of_a_previous_datagram_is_not_part_of_the_next_one(
    lost: int, turned: bool, version: int, checked: bool, tmp_path: Path
) -> None:
    """Both have the same identification, and without checksums different lengths."""
    own = north_mark(2.0) if checked else TWO
    old, new = (
        checksummed(udp(payload), version) if checked else udp(payload)
        for payload in (ONE * 4, own * 4)
    )
    assert (len(old) == len(new)) == checked

    def fragment(whole: bytes, place: int) -> bytes:
        end = 24 if place == 0 else len(whole)
        if version == 6:
            return _fragment(whole, place, end)
        return frame(whole[place:end], flags=place // 8 | (0x2000 if place == 0 else 0))

    packets = [(1.0, fragment(old, 24 - lost))]
    packets += [(2.0, fragment(new, place)) for place in ((24, 0) if turned else (0, 24))]
    blocks = read(tmp_path, pcap(packets))
    assert cut(blocks) == [own] * 4
    (gap,) = blocks.gaps
    assert gap[1:] == (24 if lost else len(old) - 24, _MISSING)


@pytest.mark.parametrize(("between", "joined"), [(999, True), (1000, False)])
def test_fragments_without_times_wait_for_1000_packets(
    between: int, joined: bool, tmp_path: Path
) -> None:
    packets = [_fragment(*_FIRST), *[datagram(TWO)] * between, _fragment(*_SECOND)]
    simple = [(3, struct.pack("<I", len(one)) + one) for one in packets]
    blocks = read(tmp_path, pcapng((1, struct.pack("<HHI", 1, 0, 0)), *simple))
    assert cut(blocks) == [TWO] * between + [ONE] * (4 * joined)
    assert len(blocks.gaps) == (0 if joined else 2)


def test_what_fragments_make_is_cut_however_large_it_is() -> None:
    """The search for blocks waited for room that was never there."""
    size = 200_000
    whole = Datagrams(
        np.zeros(size, np.uint8),
        np.zeros(1, np.int64),
        np.array([size]),
        np.zeros(1),
    )
    assert split_datagrams(whole).gaps.tolist() == [[0, size, 0]]
