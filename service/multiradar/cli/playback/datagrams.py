"""`multiradar replay … --to udp:…`: an ASTERIX recording sent as datagrams."""

import json
import math
import re
import sys
import time
from enum import StrEnum
from ipaddress import IPv4Address
from pathlib import Path

import typer

from multiradar.errors import InputError, PeerError
from multiradar.toolbox.messages.progress import progress_bar

_PREFIX = "udp:"
#: Maximum number of categories in a recording; random data parsed as blocks have far more.
_CATEGORIES_MAX = 16
_DAY_S = 86_400.0
_ADDRESS = re.compile(r"([0-9.]+):(\d{1,5})")


class Times(StrEnum):
    """Times of day in the records that are sent."""

    RECORDED = "recorded"
    NOW = "now"


def is_udp(to: str) -> bool:
    """Return whether an address is a UDP address."""
    return to.startswith(_PREFIX)


def replay_datagrams(
    recording: Path, to: str, *, interface: str, speed: float, times: Times, json_wanted: bool
) -> None:
    """Send a recording.

    Parameters
    ----------
    recording : Path
        The file.
    to : str
        `udp:ADDRESS:PORT`.
    interface : str
        Address of the interface of a multicast group.
    speed : float
        Playback speed; 1 is real time.
    times : Times
        Whether the times of day in its records are shifted to now.
    json_wanted : bool
        Whether the counts are shown as JSON.
    """
    import numpy as np

    from multiradar.clock import SystemClock
    from multiradar.ingest.replay.datagrams import UdpSink, begin_s, send_all
    from multiradar_converters.asterix.writing.sending import read_sending
    from multiradar_converters.errors import LayoutError

    address, port = _target(to)
    clock = SystemClock()
    try:
        sending = read_sending(recording)
        if times is Times.NOW and not math.isnan(sending.begin_s):
            start_s = begin_s(sending.due_s, speed, clock.now_s())
            sending = sending.moved(int((start_s - sending.begin_s) % _DAY_S))
    except LayoutError as error:
        raise InputError(str(error)) from error
    if not len(sending.datagrams):
        msg = f"{recording}: no ASTERIX data blocks"
        raise InputError(msg)
    first = sending.datagrams.data[sending.datagrams.begins]
    if sending.left_out and len(np.unique(first)) > _CATEGORIES_MAX:
        msg = (
            f"{recording}: not an ASTERIX recording; its blocks have too many different categories"
        )
        raise InputError(msg)
    sink = UdpSink(address, port, _ipv4(interface, "--interface"))
    try:
        with progress_bar("sending", len(sending.datagrams)) as show:
            octets = send_all(
                sending,
                sink,
                speed,
                clock=clock,
                pause=time.sleep,
                on_sent=show,
                on_rejected=lambda: print(
                    f"multiradar: {to}: no receiver yet; still sending", file=sys.stderr
                ),
            )
    except PeerError as error:
        message = str(error)
        raise PeerError(message if message.startswith(to) else f"{to}: {message}") from error
    finally:
        sink.close()
    counts = {
        "datagrams": len(sending.datagrams),
        "octets": octets,
        "octets_left_out": sending.left_out,
    }
    if json_wanted:
        print(json.dumps(counts))
        return
    left = (
        f"; {sending.left_out} octets outside data blocks were not sent" if sending.left_out else ""
    )
    print(f"{counts['datagrams']} datagrams of {octets} octets sent to {to}{left}")


def _target(to: str) -> tuple[str, int]:
    match = _ADDRESS.fullmatch(to.removeprefix(_PREFIX))
    if match is None or not 0 < int(match[2]) <= 65_535:
        msg = f"--to: expected udp:ADDRESS:PORT, was {to!r}"
        raise typer.BadParameter(msg)
    return _ipv4(match[1], "--to"), int(match[2])


def _ipv4(text: str, option: str) -> str:
    try:
        return str(IPv4Address(text))
    except ValueError as error:
        msg = f"{option}: expected an IPv4 address, was {text!r}"
        raise typer.BadParameter(msg) from error
