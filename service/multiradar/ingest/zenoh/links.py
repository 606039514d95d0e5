"""Which configured endpoints have no link."""

from collections import defaultdict
from collections.abc import Iterable
from ipaddress import ip_address

from multiradar.access.exposure import locator


def missing_links(connect: Iterable[str], linked: Iterable[str], *, one: bool) -> tuple[str, ...]:
    """Return the endpoints without a link, each as protocol and address.

    A link has an address, an endpoint may have a name instead: the names of one protocol and port
    have as many links as there are other addresses with it. If some of them have none, it is not
    known which: each missing link is then "one of" them.

    Parameters
    ----------
    connect : iterable of str
        Configured endpoints.
    linked : iterable of str
        Addresses of the other ends of all links, as endpoints.
    one : bool
        Whether one link is all that there is, as in a client.
    """
    left = {_parts(locator(link)) for link in linked}
    missing: list[str] = []
    named: dict[tuple[str, str], list[str]] = defaultdict(list)
    endpoints = dict.fromkeys(map(locator, connect))
    for endpoint in endpoints:
        protocol, host, port = _parts(endpoint)
        if not _is_address(host):
            named[protocol, port].append(endpoint)
        elif (protocol, host, port) in left:
            left.remove((protocol, host, port))
        else:
            missing.append(endpoint)
    for (protocol, port), names in named.items():
        links = sum((protocol, port) == (link[0], link[2]) for link in left)
        if links == 0:
            missing += names
        elif links < len(names):
            missing += ["one of " + ", ".join(names)] * (len(names) - links)
    return () if one and len(missing) < len(endpoints) else tuple(missing)


# Protocol, host and port; a scope of a host may be a name or a number.
def _parts(endpoint: str) -> tuple[str, str, str]:
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    host = host.strip("[]").partition("%")[0]
    return protocol, str(ip_address(host)) if _is_address(host) else host, port


# An unspecified address is that of another interface in a link.
def _is_address(host: str) -> bool:
    try:
        return not ip_address(host).is_unspecified
    except ValueError:
        return False
