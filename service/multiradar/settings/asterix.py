"""The section `asterix`: ASTERIX input and output.

::

    [asterix]
    editions = ["20-130/048=1.15"]

    [[asterix.listen]]
    name = "north"
    address = "239.192.0.1"
    port = 8600
    interface = "127.0.0.1"

    [[asterix.connect]]
    url = "tcp://192.168.1.20:30006"
"""

from typing import Annotated, Self

from pydantic import Field, model_validator

from multiradar.settings.asterix_output import AsterixOutputSettings
from multiradar.settings.feeds import FeedAddress, StreamUrl, feed_address, require_listener
from multiradar.settings.types import (
    Count,
    IpNetwork,
    Ipv4,
    Ipv4Network,
    Label,
    NotNegative,
    Port,
    Seconds,
    Section,
    SocketOctets,
)
from multiradar_schemas.documents.tables import wrong

#: Each listener has a thread of its own.
LISTENERS_MAX = 64
#: They share a thread, which has to serve all of them in time.
OUTPUTS_MAX = 64


class AsterixListenSettings(Section):
    """A UDP port that receives ASTERIX.

    Attributes
    ----------
    name : str
        Name in counters and in the quarantine; default: address and port.
    address : str
        Address of this host, or multicast group to join.
    port : int
        UDP port; 0 picks a free one.
    interface : str
        Address of the interface on which a group is joined.
    receive_buffer_octets : int
        Requested receive buffer of the socket.
    senders : tuple of str
        Addresses or networks of senders, such as `10.20.0.0/16`; datagrams of others are dropped
        and counted. Required beyond loopback; default: all.
    """

    name: Label | None = None
    address: Ipv4 = "127.0.0.1"
    port: Port
    interface: Ipv4 = "127.0.0.1"
    receive_buffer_octets: SocketOctets = 4 * 1024 * 1024
    senders: tuple[Ipv4Network, ...] = ()

    @property
    def label(self) -> str:
        """Name in counters and messages."""
        return self.name or f"{self.address}-{self.port}"


class AsterixConnectSettings(Section):
    """A TCP connection that sends ASTERIX blocks one after another, such as that of readsb.

    Attributes
    ----------
    name : str
        Name in counters and in the quarantine; default: host and port.
    url : str
        `tcp://HOST:PORT` to connect to, or `listen://ADDRESS:PORT` to accept one connection.
    senders : tuple of str
        With `listen://`: addresses or networks whose connections are accepted, such as
        `10.20.0.0/16`. Required beyond loopback; default: all.
    """

    name: Label | None = None
    url: StreamUrl
    senders: tuple[IpNetwork, ...] = ()

    @property
    def address(self) -> FeedAddress:
        """Parts of the address."""
        return feed_address(self.url)

    @property
    def label(self) -> str:
        """Name in counters and messages."""
        return self.name or f"{self.address.host}-{self.address.port}"

    @model_validator(mode="after")
    def _senders_are_of_a_listener(self) -> Self:
        require_listener(self.senders, self.address)
        return self


class AsterixSettings(Section):
    """ASTERIX input and output.

    Attributes
    ----------
    listen : tuple of AsterixListenSettings
        Inputs; default: none.
    connect : tuple of AsterixConnectSettings
        Inputs over TCP; default: none.
    output : tuple of AsterixOutputSettings
        Users of system tracks; default: none.
    editions : tuple of str
        Editions of categories, such as `021=0.26` or `20-130/048=1.15`; default: the newest edition
        that fits.
    all_targets : bool
        Whether to include test targets, simulated targets, fixed transponders and reports without
        detection.
    queue_datagrams_max, queue_octets_max : int
        Capacity of the queue to the decoder; datagrams that do not fit are dropped and counted.
    batch_interval_s : float
        Interval over which datagrams are collected and decoded together, s.
    duplicate_window_s : float
        Equal records of a source within this time are duplicates, s; records without time only
        within 1 s.
    behind_max_s : float
        Maximum age of a time of day at reception, s; older records are rejected.
    quarantine_rows_max : int
        Rejects of a batch that are quarantined individually; the others share a row.
    """

    listen: Annotated[tuple[AsterixListenSettings, ...], Field(max_length=LISTENERS_MAX)] = ()
    connect: Annotated[tuple[AsterixConnectSettings, ...], Field(max_length=LISTENERS_MAX)] = ()
    output: Annotated[tuple[AsterixOutputSettings, ...], Field(max_length=OUTPUTS_MAX)] = ()
    editions: tuple[str, ...] = ()
    all_targets: bool = False
    queue_datagrams_max: Count = 65_536
    queue_octets_max: Count = 32 * 1024 * 1024
    batch_interval_s: Annotated[Seconds, Field(le=10.0)] = 0.25
    duplicate_window_s: Annotated[NotNegative, Field(le=300.0)] = 10.0
    behind_max_s: Annotated[Seconds, Field(le=82_800.0)] = 3600.0
    quarantine_rows_max: Count = 100

    @property
    def input_labels(self) -> list[str]:
        """Names of the inputs, in order."""
        return [one.label for one in self.listen] + [one.label for one in self.connect]

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        outputs = [one.label for one in self.output]
        for kind, labels in (("listener", self.input_labels), ("output", outputs)):
            for label in labels:
                if labels.count(label) > 1:
                    raise wrong(f"expected each {kind} name once, found {label} twice")
        return self
