"""Captures of network traffic: the payloads of UDP datagrams.

=========  ======================================================================================
pcap       header of 24 octets (magic number, link type in the last four), then packets: seconds,
           fraction (µs or ns), octets kept, octets sent; either byte order
pcapng     blocks: type, length, body, length; type 1 is an interface, 6 an enhanced packet
links      Ethernet (1) with VLAN tags (0x8100, 0x88A8), raw IP (101), Linux cooked (113)
IPv4       fragments of a datagram are put together by source, destination and identification
=========  ======================================================================================
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.datagrams import Datagrams
from multiradar_converters.errors import LayoutError

_PCAP = {
    b"\xd4\xc3\xb2\xa1": ("<", 1e-6),
    b"\xa1\xb2\xc3\xd4": (">", 1e-6),
    b"\x4d\x3c\xb2\xa1": ("<", 1e-9),
    b"\xa1\xb2\x3c\x4d": (">", 1e-9),
}
_PCAPNG = b"\x0a\x0d\x0d\x0a"
_INTERFACE, _PACKET = 1, 6
_ETHERNET, _RAW_IP, _COOKED = 1, 101, 113
_LINK_OCTETS = {_ETHERNET: 14, _RAW_IP: 0, _COOKED: 16}
_VLAN = (0x8100, 0x88A8)
_IPV4 = 0x0800
_UDP = 17
_UDP_OCTETS = 8
#: Fragments of so many datagrams wait for the rest at once.
_WAITING_MAX = 256

Gap = tuple[int, int, str]


@dataclass(frozen=True)
class Payload:
    """What a datagram carries: its place in the file, or what its fragments joined make."""

    offset: int
    octets: int
    received_s: float
    joined: bytes = b""


@dataclass(frozen=True)
class _Packet:
    offset: int
    octets: int
    received_s: float
    link: int


def is_capture(data: NDArray[np.uint8]) -> bool:
    """Tell whether a file begins like a capture."""
    magic = bytes(data[:4])
    return magic in _PCAP or magic == _PCAPNG


def payloads(data: NDArray[np.uint8], name: str) -> tuple[list[Payload], list[Gap], int]:
    """Find the payloads of all UDP datagrams.

    Parameters
    ----------
    data : uint8[b]
        The file.
    name : str
        Its name.

    Returns
    -------
    payloads : list of Payload
        In the order of the file; one put together from fragments where its last one stands.
    gaps : list of (offset, octets, reason)
        Octets that cannot be read as packets.
    framing : int
        All other octets.

    Raises
    ------
    LayoutError
        The packets are of a link that is not known.
    """
    raw = data.tobytes()
    packets, gaps = _pcapng(raw) if raw[:4] == _PCAPNG else _pcap(raw)
    found: list[Payload] = []
    fragments = _Fragments()
    for packet in packets:
        if packet.link not in _LINK_OCTETS:
            msg = f"{name}: expected packets of Ethernet, IP or Linux, was link type {packet.link}"
            raise LayoutError(msg)
        payload = _datagram(raw, packet, fragments)
        if payload is not None:
            found.append(payload)
    gaps += fragments.left()
    taken = sum(payload.octets for payload in found) + sum(octets for _, octets, _ in gaps)
    return found, gaps, len(raw) - taken


def datagrams(
    data: NDArray[np.uint8], name: str
) -> tuple[Datagrams, NDArray[np.int64], list[Gap], int]:
    """Find the UDP datagrams of a capture; gaps and framing as in `payloads`.

    Parameters
    ----------
    data : uint8[b]
        The file.
    name : str
        Its name.

    Returns
    -------
    datagrams : Datagrams
        Their payloads; those put together from fragments stand after the octets of the file.
    offsets : int64[n]
        Where each stands in the file.
    gaps, framing
        As `payloads` returns them.
    """
    found, gaps, framing = payloads(data, name)
    extra = b"".join(payload.joined for payload in found)
    whole = np.concatenate([data, np.frombuffer(extra, dtype=np.uint8)]) if extra else data
    octets = np.array([payload.octets for payload in found], dtype=np.int64)
    offsets = np.array([payload.offset for payload in found], dtype=np.int64)
    joined = np.array([len(payload.joined) for payload in found], dtype=np.int64)
    begins = np.where(joined > 0, len(data) + np.cumsum(joined) - joined, offsets)
    received = np.array([payload.received_s for payload in found], dtype=np.float64)
    return Datagrams(whole, begins, begins + octets, received), offsets, gaps, framing


def _pcap(raw: bytes) -> tuple[list[_Packet], list[Gap]]:
    order, fraction = _PCAP[raw[:4]]
    if len(raw) < 24:
        return [], [(0, len(raw), "the header of the capture is cut off")]
    (link,) = struct.unpack_from(f"{order}I", raw, 20)
    packets = []
    at = 24
    while at + 16 <= len(raw):
        seconds, parts, kept, _ = struct.unpack_from(f"{order}4I", raw, at)
        if at + 16 + kept > len(raw):
            break
        packets.append(_Packet(at + 16, kept, seconds + parts * fraction, link & 0xFFFF))
        at += 16 + kept
    return packets, [(at, len(raw) - at, "a packet is cut off")] if at < len(raw) else []


def _pcapng(raw: bytes) -> tuple[list[_Packet], list[Gap]]:
    packets: list[_Packet] = []
    links: list[tuple[int, float]] = []
    order = "<"
    at = 0
    while at + 12 <= len(raw):
        if raw[at : at + 4] == _PCAPNG:
            order = "<" if raw[at + 8 : at + 12] == b"\x4d\x3c\x2b\x1a" else ">"
            links = []
        kind, length = struct.unpack_from(f"{order}2I", raw, at)
        if length < 12 or at + length > len(raw):
            break
        body = raw[at + 8 : at + length - 4]
        if kind == _INTERFACE and len(body) >= 8:
            links.append((struct.unpack_from(f"{order}H", body)[0], _resolution(body[8:], order)))
        elif kind == _PACKET and len(body) >= 20:
            number, high, low, kept = struct.unpack_from(f"{order}4I", body)
            if number < len(links) and kept <= len(body) - 20:
                link, step = links[number]
                packets.append(_Packet(at + 28, kept, (high << 32 | low) * step, link))
        at += length
    return packets, [(at, len(raw) - at, "a packet is cut off")] if at < len(raw) else []


def _resolution(options: bytes, order: str) -> float:
    """Return the step of the times of an interface, s: option 9, else 1 µs."""
    at = 0
    while at + 4 <= len(options):
        code, length = struct.unpack_from(f"{order}2H", options, at)
        if code == 9 and length == 1 and at + 4 < len(options):
            power = options[at + 4]
            return float(2.0 ** -(power & 0x7F) if power & 0x80 else 10.0**-power)
        at += 4 + -(-length // 4) * 4
    return 1e-6


class _Fragments:
    """Fragments of datagrams that wait for the rest."""

    def __init__(self) -> None:
        self._waiting: dict[bytes, dict[int, tuple[int, int, bool]]] = {}
        self._lost: list[Gap] = []

    def add(
        self, key: bytes, place: int, piece: tuple[int, int, bool], raw: bytes
    ) -> tuple[int, bytes] | None:
        """Add a piece (offset, octets, whether more follow); return the whole once it is there."""
        pieces = self._waiting.setdefault(key, {})
        if place in pieces:
            self._lost.append((piece[0], piece[1], "a fragment that came before"))
            return None
        pieces[place] = piece
        if len(self._waiting) > _WAITING_MAX:
            self._drop(next(iter(self._waiting)))
        whole = b""
        for at in sorted(pieces):
            offset, octets, more = pieces[at]
            if at != len(whole):
                return None
            whole += raw[offset : offset + octets]
            if not more:
                del self._waiting[key]
                return pieces[0][0], whole
        return None

    def left(self) -> list[Gap]:
        """Return the fragments whose datagrams never became whole."""
        for key in list(self._waiting):
            self._drop(key)
        return self._lost

    def _drop(self, key: bytes) -> None:
        for offset, octets, _ in self._waiting.pop(key).values():
            self._lost.append((offset, octets, "fragments of this datagram are missing"))


def _datagram(raw: bytes, packet: _Packet, fragments: _Fragments) -> Payload | None:
    """Return the payload of a packet, None if it is no UDP, or not yet whole."""
    at, end = _network(raw, packet)
    if end - at < 20 or raw[at] >> 4 != 4:
        return None
    header = (raw[at] & 15) * 4
    total, identification, flags = struct.unpack_from(">3H", raw, at + 2)
    end = min(end, at + total)
    begin = at + header
    if header < 20 or end <= begin or raw[at + 9] != _UDP:
        return None
    place, more = (flags & 0x1FFF) * 8, bool(flags & 0x2000)
    if place == 0 and not more:
        octets = min(end - begin, _udp_length(raw, begin, end)) - _UDP_OCTETS
        if octets <= 0:
            return None
        return Payload(begin + _UDP_OCTETS, octets, packet.received_s)
    key = raw[at + 12 : at + 20] + identification.to_bytes(2, "big")
    whole = fragments.add(key, place, (begin, end - begin, more), raw)
    if whole is None or len(whole[1]) <= _UDP_OCTETS:
        return None
    offset, joined = whole
    return Payload(offset + _UDP_OCTETS, len(joined) - _UDP_OCTETS, packet.received_s, joined[8:])


def _udp_length(raw: bytes, begin: int, end: int) -> int:
    if end - begin < _UDP_OCTETS:
        return 0
    return int.from_bytes(raw[begin + 4 : begin + 6], "big")


def _network(raw: bytes, packet: _Packet) -> tuple[int, int]:
    """Return begin and end of what the link carries; nothing where it is not IPv4."""
    at, end = packet.offset + _LINK_OCTETS[packet.link], packet.offset + packet.octets
    if packet.link == _RAW_IP:
        return at, end
    while at <= end:
        kind = int.from_bytes(raw[at - 2 : at], "big")
        if kind not in _VLAN:
            return (at, end) if kind == _IPV4 else (end, end)
        at += 4
    return end, end
