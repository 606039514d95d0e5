"""Addresses of this host, and whether the user has named them."""

import fcntl
import socket
import struct
from collections import defaultdict
from collections.abc import Collection, Mapping
from ipaddress import IPv6Address, ip_address
from pathlib import Path

from multiradar.errors import ConfigurationError

# Of <linux/sockios.h>, and the size of its `ifreq` on 64-bit Linux: name, family, port, address.
_SIOCGIFCONF = 0x8912
_ENTRY = struct.Struct("16s4x4s16x")
_ENTRIES_MAX = 1024
_IPV6 = Path("/proc/net/if_inet6")


def addresses_of_host() -> dict[str, set[str]]:
    """Return the addresses of each network interface of this host that has any."""
    found: dict[str, set[str]] = defaultdict(set)
    buffer = bytearray(_ENTRIES_MAX * _ENTRY.size)
    view = memoryview(buffer)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        request = bytearray(struct.pack("iP", len(buffer), _address_of(buffer)))
        fcntl.ioctl(any_socket, _SIOCGIFCONF, request)
    octets = struct.unpack_from("i", request)[0]
    for name, address in _ENTRY.iter_unpack(view[:octets]):
        found[_name(name)].add(socket.inet_ntoa(address))
    for line in _IPV6.read_text(encoding="ascii").splitlines() if _IPV6.exists() else ():
        digits, *_, name = line.split()
        found[name].add(str(IPv6Address(int(digits, 16))))
    return dict(found)


def require_named(named: Collection[str], interfaces: Mapping[str, Collection[str]]) -> None:
    """Require that the user has named every interface on which Ray may listen.

    Parameters
    ----------
    named : collection of str
        Addresses that the user has named; the first is that of the node.
    interfaces : mapping of str to collection of str
        The addresses of this host, as `addresses_of_host` returns.

    Raises
    ------
    ConfigurationError
        If none is named, one is not an address of this host, or an interface has none of them.
    """
    own = {address for found in interfaces.values() for address in found}
    if not named:
        raise ConfigurationError(
            "cluster.listen: missing; Ray may listen on every interface of this host, so list "
            "the addresses of all interfaces (--cluster-listen), or start the service in its own "
            "network namespace: see docs/howto/cluster.md"
        )
    for address in named:
        if address not in own:
            raise ConfigurationError(
                f"cluster.listen: expected an address of this host, was {address}; addresses of "
                f"this host: {', '.join(sorted(own))}"
            )
    for name, found in sorted(interfaces.items()):
        loopback = all(ip_address(one).is_loopback for one in found)
        if not loopback and not set(found) & set(named):
            raise ConfigurationError(
                "cluster.listen: Ray may listen on every interface of this host, but no address "
                f"of interface {name} ({', '.join(sorted(found))}) is listed; list one only if "
                "that network is private, or start the service in a network namespace: see "
                "docs/howto/cluster.md"
            )


def _name(octets: bytes) -> str:
    # Further addresses of an interface have labels such as eth0:1.
    return octets.split(b"\0", 1)[0].decode().split(":")[0]


def _address_of(buffer: bytearray) -> int:
    import ctypes

    return ctypes.addressof((ctypes.c_char * len(buffer)).from_buffer(buffer))
