"""Sockets that send UDP datagrams to a host or a multicast group."""

import socket


def is_group(address: str) -> bool:
    """Return whether an IPv4 address is a multicast group."""
    return socket.inet_aton(address)[0] >> 4 == 0xE


def open_sending(
    address: str, interface: str, *, ttl: int = 1, buffer_octets: int | None = None
) -> socket.socket:
    """Return a socket that sends to an address.

    Parameters
    ----------
    address : str
        IPv4 address of a host or a multicast group.
    interface : str
        Address of the interface for multicast; this host receives the group too.
    ttl : int
        Time to live of multicast datagrams.
    buffer_octets : int, optional
        Send buffer, octets.

    Raises
    ------
    OSError
        If this host has no such interface; nothing stays open.
    """
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        if buffer_octets is not None:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, buffer_octets)
        if is_group(address):
            chosen = socket.inet_aton(interface)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, chosen)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
    except OSError:
        opened.close()
        raise
    return opened
