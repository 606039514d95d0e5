"""Addresses beyond loopback, where the service listens only with credentials."""

from collections.abc import Iterator
from ipaddress import ip_address

from multiradar.access.security_log import SECURITY_LOG
from multiradar.errors import ConfigurationError
from multiradar.settings.feeds import LISTEN
from multiradar.settings.service import Settings

_REMEDY = "or start with --insecure to let every host on that network send and read"


def is_loopback(host: str) -> bool:
    """Return whether an address is reached from this machine only; of names only `localhost` is."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def require_credentials(settings: Settings, authenticated: bool) -> None:
    """Check that nothing listens beyond loopback without credentials.

    Parameters
    ----------
    settings : Settings
        All settings.
    authenticated : bool
        Whether callers of HTTP need credentials.

    Raises
    ------
    ConfigurationError
        With all addresses, unless the settings allow it; it is then logged.
    """
    if (
        authenticated
        and settings.access.certificate is None
        and not is_loopback(settings.server.host)
    ):
        # A proxy may add TLS.
        SECURITY_LOG.warning("not_encrypted", server_host=settings.server.host)
    check_exposed(settings, authenticated)
    for one in open_addresses_of(settings, authenticated):
        SECURITY_LOG.warning("insecure", reason=one)


def check_exposed(settings: Settings, authenticated: bool) -> None:
    """Check the addresses as `require_credentials`, without a log.

    Parameters
    ----------
    settings : Settings
        All settings.
    authenticated : bool
        Whether callers of HTTP need credentials.

    Raises
    ------
    ConfigurationError
        With all addresses, unless the settings allow it.
    """
    found = list(open_addresses_of(settings, authenticated))
    if found and not settings.access.insecure:
        raise ConfigurationError("; ".join(found) + f"; {_REMEDY}")


def open_addresses_of(settings: Settings, authenticated: bool) -> Iterator[str]:
    """Yield a sentence for each address that other hosts reach without credentials."""
    host = settings.server.host
    if not is_loopback(host) and not authenticated:
        yield (
            f"server.host: {host} is reachable from other hosts, but no client has a key; create "
            "one with `multiradar key`"
        )
    for one in settings.asterix.listen:
        # Datagrams of a group come from the network of its interface.
        address = one.interface if ip_address(one.address).is_multicast else one.address
        if not one.senders and not is_loopback(address):
            yield _without_senders("asterix.listen", one.label, address)
    for section, streams in (
        ("asterix.connect", settings.asterix.connect),
        ("feeds.source", settings.feeds.source),
    ):
        for stream in streams:
            host = stream.address.host
            if stream.address.scheme == LISTEN and not stream.senders and not is_loopback(host):
                yield _without_senders(section, stream.label, host)


def _without_senders(section: str, label: str, address: str) -> str:
    return (
        f"{section} {label}: {address} is not a loopback address; "
        'list the permitted senders, such as senders = ["10.20.0.0/16"]'
    )


def is_local(endpoint: str) -> bool:
    """Return whether a Zenoh endpoint such as `tcp/127.0.0.1:7447` is of this machine only."""
    protocol, _, address = locator(endpoint).partition("/")
    if protocol.startswith("unix"):
        return True
    return is_loopback(address.rpartition(":")[0])


def locator(endpoint: str) -> str:
    """Return protocol and address of a Zenoh endpoint such as `tls/router:7447?…#…`.

    The rest may name files or contain a private key: it is neither logged nor reported.
    """
    return endpoint.partition("#")[0].partition("?")[0]
