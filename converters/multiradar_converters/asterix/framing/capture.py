"""Network captures: payloads of UDP datagrams (see `internet`).

=========  ======================================================================================
pcap       header of 24 octets (magic number, link type in the last four), then packets: seconds,
           fraction (µs or ns), octets kept, octets sent; either byte order
pcapng     blocks: type, length, body, length; type 1 is an interface, 6 an enhanced packet, 2 an
           older one, 3 a simple one, which has no time; times are in steps (option 9 of the
           interface: powers of 10 or 2, else 1 µs) after its offset in seconds (option 14)
=========  ======================================================================================
"""

import math
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.framing.internet import (
    LINKS,
    Fragments,
    Gap,
    Packet,
    Payload,
    datagram_of,
)
from multiradar_converters.errors import LayoutError

_PCAP = {
    b"\xd4\xc3\xb2\xa1": ("<", 1e-6),
    b"\xa1\xb2\xc3\xd4": (">", 1e-6),
    b"\x4d\x3c\xb2\xa1": ("<", 1e-9),
    b"\xa1\xb2\x3c\x4d": (">", 1e-9),
}
_PCAP_HEADER = 24
_PCAPNG = b"\x0a\x0d\x0d\x0a"
_LITTLE_ENDIAN = b"\x4d\x3c\x2b\x1a"
#: Reason of a gap at the end of a capture inside a packet.
CUT_PACKET = "a packet is truncated"
_NO_INTERFACE = "a packet without an interface description block"
_TOO_LONG = "a packet that does not fit into its block"
_INTERFACE, _OLD_PACKET, _SIMPLE_PACKET, _PACKET = 1, 2, 3, 6


@dataclass(frozen=True)
class _Interface:
    """Link type, time resolution, s, and time added to all times, s."""

    link: int
    step_s: float
    offset_s: int


def is_capture(data: NDArray[np.uint8]) -> bool:
    """Return whether a file begins like a capture."""
    magic = bytes(data[:4])
    return magic in _PCAP or magic == _PCAPNG


def head_of(data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the octets that describe the packets after the end of some data.

    Parameters
    ----------
    data : uint8[b]
        A capture up to the end of any packet.

    Returns
    -------
    uint8[h]
        The header of pcap; of pcapng, the last section header and the interfaces after it. Earlier
        sections describe their own packets only.
    """
    raw = data.tobytes()
    if raw[:4] != _PCAPNG:
        return data[:_PCAP_HEADER]
    parts: list[tuple[int, int]] = []
    order, at = "<", 0
    while at + 12 <= len(raw):
        section = raw[at : at + 4] == _PCAPNG
        if section:
            order, parts = _byte_order(raw, at), []
        kind, length = struct.unpack_from(f"{order}2I", raw, at)
        if length < 12 or at + length > len(raw):
            break
        if section or kind == _INTERFACE:
            parts.append((at, at + length))
        at += length
    return np.concatenate([data[:0], *(data[begin:end] for begin, end in parts)])


def _byte_order(raw: bytes, at: int) -> str:
    """Return the byte order of the section whose header starts at an octet."""
    return "<" if raw[at + 8 : at + 12] == _LITTLE_ENDIAN else ">"


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
        In file order; a reassembled payload is at the position of its final fragment.
    gaps : list of (offset, octets, reason)
        Octets that cannot be parsed as packets.
    framing : int
        All other octets.

    Raises
    ------
    LayoutError
        The link type is unknown.
    """
    raw = data.tobytes()
    packets, gaps = _pcapng(raw) if raw[:4] == _PCAPNG else _pcap(raw)
    found: list[Payload] = []
    fragments = Fragments()
    unknown = [packet for packet in packets if packet.link not in LINKS]
    if unknown and len(unknown) == len(packets):
        msg = (
            f"{name}: expected Ethernet, raw IP or Linux cooked packets, found link type "
            f"{unknown[0].link}"
        )
        raise LayoutError(msg)
    for packet in packets:
        if packet.link not in LINKS:
            gaps.append((packet.offset, packet.octets, f"link type {packet.link} is unknown"))
            continue
        payload = datagram_of(raw, packet, fragments)
        if payload is not None:
            found.append(payload)
    gaps += fragments.incomplete()
    taken = sum(payload.octets for payload in found) + sum(octets for _, octets, _ in gaps)
    return found, gaps, len(raw) - taken


def datagrams(
    data: NDArray[np.uint8], name: str
) -> tuple[Datagrams, NDArray[np.int64], list[Gap], int]:
    """Find the UDP datagrams of a capture; gaps and framing as in `payloads`.

    Returns
    -------
    datagrams : Datagrams
        Their payloads; reassembled payloads follow the octets of the file.
    offsets : int64[n]
        Offset of each in the file.
    gaps, framing
        As from `payloads`.
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


def _pcap(raw: bytes) -> tuple[list[Packet], list[Gap]]:
    order, fraction = _PCAP[raw[:4]]
    if len(raw) < _PCAP_HEADER:
        return [], [(0, len(raw), "the header of the capture is truncated")]
    (link,) = struct.unpack_from(f"{order}I", raw, 20)
    packets = []
    at = _PCAP_HEADER
    while at + 16 <= len(raw):
        seconds, parts, kept, _ = struct.unpack_from(f"{order}4I", raw, at)
        if at + 16 + kept > len(raw):
            break
        packets.append(Packet(at + 16, kept, seconds + parts * fraction, link & 0xFFFF))
        at += 16 + kept
    return packets, [(at, len(raw) - at, CUT_PACKET)] if at < len(raw) else []


def _pcapng(raw: bytes) -> tuple[list[Packet], list[Gap]]:
    packets: list[Packet] = []
    links: list[_Interface] = []
    gaps: list[Gap] = []
    order = "<"
    at = 0
    while at + 12 <= len(raw):
        if raw[at : at + 4] == _PCAPNG:
            order, links = _byte_order(raw, at), []
        kind, length = struct.unpack_from(f"{order}2I", raw, at)
        if length < 12 or at + length > len(raw):
            break
        body = raw[at + 8 : at + length - 4]
        if kind == _INTERFACE and len(body) >= 8:
            links.append(_interface(body, order))
        elif kind in (_PACKET, _OLD_PACKET, _SIMPLE_PACKET):
            packet = _packet(body, kind, at + 8, order, links)
            if isinstance(packet, str):
                gaps.append((at + 8, len(body), packet))
            else:
                packets.append(packet)
        at += length
    if at < len(raw):
        gaps.append((at, len(raw) - at, CUT_PACKET))
    return packets, gaps


def _packet(
    body: bytes, kind: int, begin: int, order: str, links: list[_Interface]
) -> Packet | str:
    """Read the block of a packet; return why it cannot be read."""
    if len(body) < (4 if kind == _SIMPLE_PACKET else 20):
        return _TOO_LONG
    if kind == _SIMPLE_PACKET:
        if not links:
            return _NO_INTERFACE
        (sent,) = struct.unpack_from(f"{order}I", body)
        return Packet(begin + 4, min(sent, len(body) - 4), math.nan, links[0].link)
    number, high, low, kept = struct.unpack_from(f"{order}4I", body)
    if kind == _OLD_PACKET:
        (number,) = struct.unpack_from(f"{order}H", body)
    if number >= len(links):
        return _NO_INTERFACE
    if kept > len(body) - 20:
        return _TOO_LONG
    one = links[number]
    received_s = one.offset_s + (high << 32 | low) * one.step_s
    return Packet(begin + 20, kept, received_s, one.link)


def _interface(body: bytes, order: str) -> _Interface:
    """Read the block of an interface: time resolution (option 9) and time offset (option 14)."""
    (link,) = struct.unpack_from(f"{order}H", body)
    step_s, offset_s, at = 1e-6, 0, 8
    while at + 4 <= len(body):
        code, length = struct.unpack_from(f"{order}2H", body, at)
        value = body[at + 4 : at + 4 + length]
        if code == 9 and length == len(value) == 1:
            step_s = 2.0 ** -(value[0] & 0x7F) if value[0] & 0x80 else 10.0 ** -value[0]
        elif code == 14 and length == len(value) == 8:
            (offset_s,) = struct.unpack(f"{order}q", value)
        at += 4 + -(-length // 4) * 4
    return _Interface(link, step_s, offset_s)
