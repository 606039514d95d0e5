"""ASTERIX blocks written by hand from the standards, independent of the decoder."""

import random
import struct
from collections.abc import Iterable


def octets(text: str) -> bytes:
    """Read hexadecimal digits and blanks."""
    return bytes.fromhex(text)


def record(*items: tuple[int, str]) -> bytes:
    """Write a record: positions in the user application profile, ascending, and their octets."""
    length = (max(place for place, _ in items) + 6) // 7
    bits = [0] * (8 * length)
    for place, _ in items:
        bits[(place - 1) // 7 * 8 + (place - 1) % 7] = 1
    for more in range(length - 1):
        bits[more * 8 + 7] = 1
    specification = bytes(
        int("".join(map(str, bits[k : k + 8])), 2) for k in range(0, 8 * length, 8)
    )
    return specification + b"".join(octets(text) for _, text in items)


def block(category: int, *records: bytes) -> bytes:
    """Write a block."""
    body = b"".join(records)
    return bytes([category]) + struct.pack(">H", len(body) + 3) + body


def time_of_day(seconds: float, ticks: int = 24) -> str:
    """Write a time of day in 1/128 s, as many bits as `ticks`."""
    return f"{round(seconds * 128) % (1 << ticks):0{ticks // 4}x}"


def plot_048(
    seconds: float,
    *,
    source: str = "14 82",
    range_nm: float = 50.0,
    azimuth_deg: float = 90.0,
    code: str = "0fff",
    level: str | None = "0578",
    descriptor: str = "40",
    address: str = "3c660c",
    flight_status: int | None = None,
    registers: str | None = None,
) -> bytes:
    """Write a plot of category 048 with code, level, address; flight status, item 250 if given."""
    position = f"{round(range_nm * 256):04x} {round(azimuth_deg * 65536 / 360) % 65536:04x}"
    items = [(1, source), (2, time_of_day(seconds)), (3, descriptor), (4, position), (5, code)]
    if level is not None:
        items.append((6, level))
    items.append((8, address))
    if registers is not None:
        items.append((10, registers))
    if flight_status is not None:
        items.append((21, f"{1 << 5 | flight_status << 2:02x} a0"))
    return record(*items)


def plot_001(
    truncated_s: float | None, *, source: str = "14 82", azimuth_deg: float = 90.0
) -> bytes:
    """Write a secondary plot of category 001 at 50 NM."""
    position = f"1900 {round(azimuth_deg * 65536 / 360):04x}"
    items = [(1, source), (2, "20"), (3, position), (4, "0fff")]
    if truncated_s is not None:
        items.append((7, time_of_day(truncated_s % 512, 16)))
    return record(*items)


def north_mark(seconds: float, *, source: str = "14 82") -> bytes:
    """Write a block of category 002: a north crossing."""
    return block(2, record((1, source), (2, "01"), (4, time_of_day(seconds))))


def gps(blocks: Iterable[tuple[float, bytes]]) -> bytes:
    """Write a `.gps` recording: blocks with the times of day of their reception."""
    parts = [b"\xcd" * 2200]
    for seconds, one in blocks:
        parts += [one, bytes(6), octets(time_of_day(seconds)), bytes(1)]
    return b"".join(parts)


def final_format(datagrams: Iterable[tuple[float, bytes]], *, line: int = 3) -> bytes:
    """Write a recording in Final format: datagrams with the times of day of their reception."""
    return b"".join(
        struct.pack(">H2BI", len(one) + 12, 1, line, round(seconds * 100)) + one + b"\xa5" * 4
        for seconds, one in datagrams
    )


def rply(datagrams: Iterable[tuple[int, bytes]]) -> bytes:
    """Write a `.rply` recording: datagrams with the milliseconds since the one before."""
    return b"".join(struct.pack("<2i", len(one), pause) + one for pause, one in datagrams)


def datagram(payload: bytes, *, vlan: bool = False) -> bytes:
    """Write an Ethernet frame with a UDP datagram."""
    udp = struct.pack(">4H", 8600, 8600, len(payload) + 8, 0) + payload
    return frame(udp, vlan=vlan)


def frame(udp: bytes, *, flags: int = 0, identification: int = 7, vlan: bool = False) -> bytes:
    """Write an Ethernet frame with (a part of) a UDP datagram."""
    header = struct.pack(">2B3H2BH", 0x45, 0, 20 + len(udp), identification, flags, 1, 17, 0)
    ethernet = bytes(12) + (octets("8100 0005") if vlan else b"") + octets("0800")
    return ethernet + header + bytes([10, 0, 0, 1, 239, 0, 0, 1]) + udp


def pcap(packets: Iterable[tuple[float, bytes]]) -> bytes:
    """Write a capture of Ethernet frames, low octet first, microseconds."""
    parts = [struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)]
    for seconds, one in packets:
        whole = int(seconds)
        parts.append(struct.pack("<4I", whole, round((seconds - whole) * 1e6), len(one), len(one)))
        parts.append(one)
    return b"".join(parts)


def pcapng(*parts: tuple[int, bytes]) -> bytes:
    """Write a capture of the next generation, low octet first, of blocks (type, body)."""
    whole = b""
    section = bytes.fromhex("4d3c2b1a01000000") + b"\xff" * 8
    for kind, body in ((0x0A0D0D0A, section), *parts):
        body += bytes(-len(body) % 4)
        length = struct.pack("<I", len(body) + 12)
        whole += struct.pack("<I", kind) + length + body + length
    return whole


def mutated(whole: bytes, generator: random.Random) -> bytes:
    """Change, drop, add or cut octets, as a bad link or disk would."""
    changed = bytearray(whole)
    for _ in range(generator.randint(1, 4)):
        place = generator.randrange(len(changed)) if changed else 0
        choice = generator.randrange(5)
        if choice <= 1 and changed:
            changed[place] = generator.randrange(256)
        elif choice == 2 and changed:
            del changed[place : place + generator.randint(1, 8)]
        elif choice == 3:
            changed[place:place] = generator.randbytes(generator.randint(1, 8))
        else:
            del changed[place:]
    return bytes(changed)
