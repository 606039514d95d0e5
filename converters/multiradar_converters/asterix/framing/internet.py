"""Link-layer packets, and UDP datagrams over IP.

=====  ==========================================================================================
links  Ethernet (1) with VLAN tags (0x8100, 0x88A8, 0x9100), raw IP (12, 14, 101, 228, 229), Linux
       cooked (113, 276), loopback of BSD (0, 108)
IP     versions 4 and 6; fragments of a datagram are reassembled by source, destination and
       identification, which recurs: after 30 s, or 1000 packets without times, and from a
       different fragment at the same offset on, they belong to another datagram, as they do if
       length or checksum of UDP would be wrong; copies of fragments are framing; other extensions
       of version 6 are not read
=====  ==========================================================================================
"""

import math
import struct
from dataclasses import dataclass, field

#: Octets before the packet, and the offset of its type; None if it has none.
LINKS = {
    1: (14, -2),
    113: (16, -2),
    276: (20, -20),
    **dict.fromkeys((0, 108), (4, None)),
    **dict.fromkeys((12, 14, 101, 228, 229), (0, None)),
}
_VLAN = (0x8100, 0x88A8, 0x9100)
_IP = (0x0800, 0x86DD)
_IPV6_OCTETS, _IPV6_FRAGMENT, _FRAGMENT_OCTETS = 40, 44, 8
_UDP = 17
_UDP_OCTETS = 8
#: Maximum number of incomplete datagrams, and of complete ones whose copies may follow.
_WAITING_MAX, _COMPLETE_MAX = 256, 4096
#: Reassembly timeout, s: that of Linux; RFC 1122, 3.3.2 recommends 60 to 120 s.
_WAITING_MAX_S = 30.0
#: The same for packets without times.
_WAITING_PACKETS_MAX = 1000

Gap = tuple[int, int, str]


@dataclass(frozen=True)
class Payload:
    """Payload of a datagram: its location in the file, or the reassembled octets."""

    offset: int
    octets: int
    received_s: float
    joined: bytes = b""


@dataclass(frozen=True)
class Packet:
    """Location of a packet in its file, its time, and its link type."""

    offset: int
    octets: int
    received_s: float
    link: int


@dataclass
class _Datagram:
    """Fragments of a datagram by offset, as they arrived, with time and number of its first packet.

    Each has its offset and octets in the file, and whether more follow.
    """

    since_s: float
    number: int
    pieces: dict[int, tuple[int, int, bool]] = field(default_factory=dict)


class Fragments:
    """Fragments of incomplete datagrams, and of complete ones whose copies may follow."""

    def __init__(self) -> None:
        self._waiting: dict[bytes, _Datagram] = {}
        self._complete: dict[bytes, _Datagram] = {}
        self._lost: list[Gap] = []
        self._number = 0

    def count_packet(self) -> None:
        """Count a packet of any kind."""
        self._number += 1

    def add(
        self, key: bytes, place: int, piece: tuple[int, int, bool], raw: bytes, received_s: float
    ) -> tuple[int, bytes] | None:
        """Add a fragment (offset, octets, more follow); return the datagram once complete."""
        for known in (self._complete, self._waiting):
            one = known.get(key)
            if one is not None and self._expired(one, received_s):
                self._drop(known, key)
            taken = known[key].pieces.get(place) if key in known else None
            if taken is not None and _content(taken, raw) == _content(piece, raw):
                return None
            if taken is not None and known is self._waiting:
                self._drop(known, key)
        waiting = self._waiting.setdefault(key, _Datagram(received_s, self._number))
        waiting.pieces[place] = piece
        self._limit(self._waiting, _WAITING_MAX)
        whole = _whole(waiting, raw)
        if whole is None:
            return None
        if not _is_datagram(key, whole):
            # The first fragment that arrived is of a previous datagram.
            self._lose(waiting.pieces.pop(next(iter(waiting.pieces))))
            return None
        self._complete.pop(key, None)
        self._complete[key] = self._waiting.pop(key)
        self._limit(self._complete, _COMPLETE_MAX)
        return waiting.pieces[0][0], whole

    def _expired(self, one: _Datagram, received_s: float) -> bool:
        passed_s = abs(received_s - one.since_s)
        if math.isnan(passed_s):
            return self._number - one.number > _WAITING_PACKETS_MAX
        return passed_s > _WAITING_MAX_S

    def incomplete(self) -> list[Gap]:
        """Return the fragments of incomplete datagrams."""
        self._limit(self._waiting, 0)
        return self._lost

    def _limit(self, known: dict[bytes, _Datagram], count: int) -> None:
        while len(known) > count:
            self._drop(known, next(iter(known)))

    def _drop(self, known: dict[bytes, _Datagram], key: bytes) -> None:
        pieces = known.pop(key).pieces.values()
        for piece in pieces if known is self._waiting else ():
            self._lose(piece)

    def _lose(self, piece: tuple[int, int, bool]) -> None:
        self._lost.append((*piece[:2], "fragments of this datagram are missing"))


def _whole(waiting: _Datagram, raw: bytes) -> bytes | None:
    """Return the octets of a datagram; None if fragments are missing."""
    whole = b""
    for at in sorted(waiting.pieces):
        offset, octets, more = waiting.pieces[at]
        if at != len(whole):
            return None
        whole += raw[offset : offset + octets]
        if not more:
            return whole
    return None


def _is_datagram(key: bytes, whole: bytes) -> bool:
    """Return whether length and checksum are those of a UDP datagram (RFC 768)."""
    if len(whole) < _UDP_OCTETS or int.from_bytes(whole[4:6], "big") != len(whole):
        return False
    if whole[6:8] == b"\0\0":
        return True
    # Addresses come first in a key, and are 4 or 16 octets each.
    summed = key[: 8 if len(key) < _IPV6_OCTETS - 8 else 32] + whole + b"\0" * (len(whole) % 2)
    total: int = sum(struct.unpack(f">{len(summed) // 2}H", summed)) + _UDP + len(whole)
    return total % 0xFFFF == 0


def _content(piece: tuple[int, int, bool], raw: bytes) -> tuple[bytes, bool]:
    offset, octets, more = piece
    return raw[offset : offset + octets], more


@dataclass(frozen=True)
class _Carried:
    """IP payload: its location, and which part of which datagram it is."""

    begin: int
    end: int
    key: bytes = b""
    place: int = 0
    more: bool = False


def datagram_of(raw: bytes, packet: Packet, fragments: Fragments) -> Payload | None:
    """Return the payload of a packet.

    Parameters
    ----------
    raw : bytes
        The file.
    packet : Packet
        The packet.
    fragments : Fragments
        Fragments of previous packets.

    Returns
    -------
    Payload or None
        None if it is not UDP, or not yet complete.
    """
    fragments.count_packet()
    at, end = _network(raw, packet)
    carried = None
    if end > at:
        carried = {4: _of_version_4, 6: _of_version_6}.get(raw[at] >> 4, _not_ip)(raw, at, end)
    if carried is None:
        return None
    begin, end = carried.begin, carried.end
    if carried.place == 0 and not carried.more:
        octets = min(end - begin, _udp_length(raw, begin, end)) - _UDP_OCTETS
        if octets <= 0:
            return None
        return Payload(begin + _UDP_OCTETS, octets, packet.received_s)
    piece = (begin, end - begin, carried.more)
    whole = fragments.add(carried.key, carried.place, piece, raw, packet.received_s)
    if whole is None or len(whole[1]) == _UDP_OCTETS:
        return None
    offset, joined = whole
    return Payload(offset + _UDP_OCTETS, len(joined) - _UDP_OCTETS, packet.received_s, joined[8:])


def _not_ip(_raw: bytes, _at: int, _end: int) -> None:
    return None


def _of_version_4(raw: bytes, at: int, end: int) -> _Carried | None:
    if end - at < 20:
        return None
    header = (raw[at] & 15) * 4
    total, identification, flags = struct.unpack_from(">3H", raw, at + 2)
    # Network cards with segmentation offload leave the length 0.
    end = min(end, at + total) if total else end
    begin = at + header
    if header < 20 or end <= begin or raw[at + 9] != _UDP:
        return None
    key = raw[at + 12 : at + 20] + identification.to_bytes(2, "big")
    return _Carried(begin, end, key, (flags & 0x1FFF) * 8, bool(flags & 0x2000))


def _of_version_6(raw: bytes, at: int, end: int) -> _Carried | None:
    begin = at + _IPV6_OCTETS
    if end <= begin:
        return None
    octets, following = struct.unpack_from(">HB", raw, at + 4)
    end = min(end, begin + octets)
    if following == _UDP:
        return _Carried(begin, end)
    if following != _IPV6_FRAGMENT or end - begin <= _FRAGMENT_OCTETS or raw[begin] != _UDP:
        return None
    (flags,) = struct.unpack_from(">H", raw, begin + 2)
    key = raw[at + 8 : at + _IPV6_OCTETS] + raw[begin + 4 : begin + _FRAGMENT_OCTETS]
    return _Carried(begin + _FRAGMENT_OCTETS, end, key, flags & 0xFFF8, bool(flags & 1))


def _udp_length(raw: bytes, begin: int, end: int) -> int:
    if end - begin < _UDP_OCTETS:
        return 0
    return int.from_bytes(raw[begin + 4 : begin + 6], "big")


def _network(raw: bytes, packet: Packet) -> tuple[int, int]:
    """Return begin and end of the IP packet of a link-layer packet; empty if it is not IP."""
    octets, place = LINKS[packet.link]
    at, end = packet.offset + octets, packet.offset + packet.octets
    if place is None:
        return min(at, end), end
    kind = int.from_bytes(raw[at + place : at + place + 2], "big") if at <= end else 0
    while kind in _VLAN and at + 4 <= end:
        at += 4
        kind = int.from_bytes(raw[at - 2 : at], "big")
    return (at, end) if kind in _IP else (end, end)
