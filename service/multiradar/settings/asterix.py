"""The section `asterix`: where ASTERIX datagrams come from and go to.

::

    [asterix]
    editions = ["20-130/048=1.15"]

    [[asterix.listen]]
    name = "north"
    address = "239.192.0.1"
    port = 8600
    interface = "127.0.0.1"
"""

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from multiradar.settings.asterix_output import AsterixOutputSettings
from multiradar.settings.types import (
    Count,
    Ipv4,
    Label,
    NotNegative,
    Port,
    Seconds,
    Section,
    SocketOctets,
)

#: Each listener has a thread of its own.
LISTENERS_MAX = 64
#: They share a thread, which has to tell all of them in time.
OUTPUTS_MAX = 64


class AsterixListenSettings(Section):
    """A UDP port on which ASTERIX comes in.

    Attributes
    ----------
    name : str
        Its name in counters and in the quarantine; address and port by default.
    address : str
        Where it listens: an address of this machine, or a multicast group to join.
    port : int
        UDP port; 0 picks a free one.
    interface : str
        Address of the interface on which a group is joined.
    receive_buffer_octets : int
        Room that the system is asked for, for datagrams that are not read yet.
    """

    name: Label | None = None
    address: Ipv4 = "127.0.0.1"
    port: Port
    interface: Ipv4 = "127.0.0.1"
    receive_buffer_octets: SocketOctets = 4 * 1024 * 1024

    @property
    def label(self) -> str:
        """The name that it goes by."""
        return self.name or f"{self.address}-{self.port}"


class AsterixSettings(Section):
    """ASTERIX from the network.

    Attributes
    ----------
    listen : tuple of AsterixListenSettings
        Where it comes in; none by default.
    output : tuple of AsterixOutputSettings
        Who gets system tracks; nobody by default.
    editions : tuple of str
        Editions of categories, such as `021=0.26` or `20-130/048=1.15`; of others the newest that
        fits.
    all_targets : bool
        Whether test targets, simulated ones, fixed transponders and reports without a detection
        are measurements too.
    queue_datagrams_max, queue_octets_max : int
        Datagrams, and octets of them, that may wait to be decoded; more are dropped and counted.
    batch_interval_s : float
        How long datagrams are gathered before they are decoded together, s.
    duplicate_window_s : float
        Equal records of one source at most so far apart are one record, s; where they tell no
        time, at most a second apart.
    behind_max_s : float
        A time of day may lie so far behind the reception, s; what is older is refused.
    quarantine_rows_max : int
        Rows of one batch that are quarantined one by one; the rest of it shares a row.
    """

    listen: Annotated[tuple[AsterixListenSettings, ...], Field(max_length=LISTENERS_MAX)] = ()
    output: Annotated[tuple[AsterixOutputSettings, ...], Field(max_length=OUTPUTS_MAX)] = ()
    editions: tuple[str, ...] = ()
    all_targets: bool = False
    queue_datagrams_max: Count = 65_536
    queue_octets_max: Count = 32 * 1024 * 1024
    batch_interval_s: Annotated[Seconds, Field(le=10.0)] = 0.25
    duplicate_window_s: Annotated[NotNegative, Field(le=300.0)] = 10.0
    behind_max_s: Annotated[Seconds, Field(le=82_800.0)] = 3600.0
    quarantine_rows_max: Count = 100

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        for kind, named in (("listener", self.listen), ("output", self.output)):
            labels = [one.label for one in named]
            for label in labels:
                if labels.count(label) > 1:
                    raise PydanticCustomError(
                        "unique", "Input should have each {kind}'s name once, was twice {name}",
                        {"kind": kind, "name": label},
                    )  # fmt: skip
        return self
