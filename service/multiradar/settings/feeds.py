"""The section `feeds`: receivers that send readsb JSON, BaseStation or results of mlat-server.

::

    [[feeds.source]]
    name = "roof"
    url = "tcp://192.168.1.20:30047"
    sensor = "adsb"

    [[feeds.source]]
    url = "http://192.168.1.20/tar1090/data/aircraft.json"

The service connects to no other addresses, and follows no redirection.
"""

from typing import Annotated, Literal, NamedTuple, Self
from urllib.parse import SplitResult, quote, urlsplit

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from multiradar.settings.types import Count, IpNetwork, Label, Seconds, Section
from multiradar_schemas.documents.tables import wrong
from multiradar_schemas.measurements.measurement import SensorName

#: Each source has a thread of its own.
SOURCES_MAX = 64
#: Schemes of addresses: connect, accept a connection; request or read again and again.
TCP, LISTEN, HTTP, HTTPS, FILE = "tcp", "listen", "http", "https", "file"

# What stays as it is in a path and a query; escapes, too.
_SAFE = "/%:@!$&'()*+,;=?~"
_EXAMPLES = (
    "tcp://192.168.1.20:30047, listen://127.0.0.1:30104, "
    "http://192.168.1.20/tar1090/data/aircraft.json or file:///run/readsb/aircraft.json"
)


class FeedAddress(NamedTuple):
    """Parts of the address of a feed."""

    scheme: str
    host: str
    port: int
    path: str


def feed_address(url: str) -> FeedAddress:
    """Return the parts of an address.

    Raises
    ------
    ValueError
        It is none.
    """
    parts = urlsplit(url)
    if parts.scheme == FILE:
        if parts.netloc or not parts.path.startswith("/"):
            raise ValueError(url)
        return FeedAddress(FILE, "", 0, parts.path)
    if parts.username is not None or parts.fragment or not parts.hostname:
        raise ValueError(url)
    if parts.scheme in (HTTP, HTTPS):
        port = parts.port or (80 if parts.scheme == HTTP else 443)
        query = f"?{parts.query}" if parts.query else ""
        path = quote((parts.path or "/") + query, safe=_SAFE)
        return FeedAddress(parts.scheme, parts.hostname, port, path)
    return FeedAddress(parts.scheme, parts.hostname, _port_of_stream(parts), "")


def _port_of_stream(parts: SplitResult) -> int:
    if parts.scheme not in (TCP, LISTEN) or parts.path.strip("/") or parts.query:
        raise ValueError(parts.scheme)
    if parts.port is None or (parts.port == 0 and parts.scheme == TCP):
        raise ValueError(parts.netloc)
    return parts.port


def _checked(url: str) -> str:
    try:
        feed_address(url)
    except ValueError as error:
        raise PydanticCustomError(
            "feed_url", "Input should be an address such as {examples}", {"examples": _EXAMPLES}
        ) from error
    return url


def _checked_stream(url: str) -> str:
    try:
        scheme = feed_address(url).scheme
    except ValueError:
        scheme = ""
    if scheme not in (TCP, LISTEN):
        raise PydanticCustomError(
            "stream_url",
            "Input should be an address such as tcp://192.168.1.20:30006 or "
            "listen://127.0.0.1:30006",
        )
    return url


#: Address of a feed, and of a stream.
FeedUrl = Annotated[str, AfterValidator(_checked)]
StreamUrl = Annotated[str, AfterValidator(_checked_stream)]


def require_listener(senders: tuple[str, ...], address: FeedAddress) -> None:
    """Check that senders are listed only for an address to which they connect.

    Raises
    ------
    PydanticCustomError
        If they are listed for another one.
    """
    if senders and address.scheme != LISTEN:
        raise wrong("senders apply to listen:// only; remove them")


class FeedSourceSettings(Section):
    """A feed.

    Attributes
    ----------
    name : str
        Name in counters and in the quarantine; default: host and port, or the file.
    url : str
        Where it comes from: `tcp://HOST:PORT` to connect to, `listen://ADDRESS:PORT` to accept one
        connection, `http://…` and `https://…` to request, and `file:///…` to read again and again.
    sensor, mlat_sensor : str
        The sensors of its ADS-B positions, and of those by multilateration.
    times : str
        `message`: positions count at the time that the receiver gives; `reception`: at that of
        their reception here, for receivers with a wrong clock.
    interval_s : float
        Interval of requests and of reading a file, s.
    senders : tuple of str
        With `listen://`: addresses or networks whose connections are accepted, such as
        `10.20.0.0/16`. Required beyond loopback; default: all.
    """

    name: Label | None = None
    url: FeedUrl
    sensor: SensorName = "adsb"
    mlat_sensor: SensorName = "mlat"
    times: Literal["message", "reception"] = "message"
    interval_s: Annotated[Seconds, Field(ge=0.1, le=3600.0)] = 1.0
    senders: tuple[IpNetwork, ...] = ()

    @property
    def address(self) -> FeedAddress:
        """Parts of the address."""
        return feed_address(self.url)

    @property
    def shown_url(self) -> str:
        """Address without its query, which may contain a key: for the log and the status."""
        return urlsplit(self.url)._replace(query="", fragment="").geturl()

    @property
    def label(self) -> str:
        """Name in counters and messages."""
        address = self.address
        return self.name or (f"{address.host}:{address.port}" if address.host else address.path)

    @model_validator(mode="after")
    def _senders_are_of_a_listener(self) -> Self:
        require_listener(self.senders, self.address)
        return self


class FeedsSettings(Section):
    """Feeds of receivers.

    Attributes
    ----------
    source : tuple of FeedSourceSettings
        The feeds; default: none.
    connect_timeout_s : float
        Maximum time to connect and to wait for an answer, s.
    reconnect_min_s, reconnect_max_s : float
        Pause before the first new attempt, and maximum pause, s; it doubles with each attempt that
        brings no data.
    batch_interval_s : float
        Interval over which positions are collected and submitted together, s.
    quarantine_rows_max : int
        Rejects of a batch that are quarantined individually; the others share a row.
    """

    source: Annotated[tuple[FeedSourceSettings, ...], Field(max_length=SOURCES_MAX)] = ()
    connect_timeout_s: Annotated[Seconds, Field(le=60.0)] = 5.0
    reconnect_min_s: Annotated[Seconds, Field(le=60.0)] = 1.0
    reconnect_max_s: Annotated[Seconds, Field(le=3600.0)] = 30.0
    batch_interval_s: Annotated[Seconds, Field(le=10.0)] = 0.25
    quarantine_rows_max: Count = 100

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        labels = [one.label for one in self.source]
        for label in labels:
            if labels.count(label) > 1:
                raise wrong(f"expected each source name once, found {label} twice")
        return self
