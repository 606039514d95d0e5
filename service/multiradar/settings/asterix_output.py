"""A table `asterix.output` of the settings: one user of system tracks.

::

    [[asterix.output]]
    name = "display"
    address = "239.192.0.62"
    port = 8662
    sac = 20
    sic = 250
    service = 1
    period_s = 4.0
    area_deg = [-10.0, 35.0, 5.0, 45.0]
"""

from pathlib import Path
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from multiradar.settings.types import Count, Ipv4, Label, Port, Section, SocketOctets, plain_number

_HALF_SECONDS = Field(ge=0.5, le=3600.0, multiple_of=0.5)
Octet = Annotated[int, BeforeValidator(plain_number), Field(ge=0, le=255)]
Period = Annotated[float, BeforeValidator(plain_number), _HALF_SECONDS]
Longitude = Annotated[float, BeforeValidator(plain_number), Field(ge=-180.0, le=180.0)]
Latitude = Annotated[float, BeforeValidator(plain_number), Field(ge=-90.0, le=90.0)]
CentreLatitude = Annotated[float, BeforeValidator(plain_number), Field(ge=-89.0, le=89.0)]


class AsterixOutputSettings(Section):
    """System tracks, sensor status and service status for one user.

    Attributes
    ----------
    name : str
        Its name in counters; address and port, or the name of the file, by default.
    address : str
        Where datagrams go: a machine, or a multicast group.
    port : int
        UDP port there; a user with a port gets datagrams.
    interface : str
        Address of the interface by which a group is reached.
    ttl : int
        How many networks a datagram to a group may go on to: 0 none, 1 that of the interface.
    send_buffer_octets : int
        Room that the system is asked for, for datagrams that are not sent yet.
    file : Path
        A file that blocks are added to, one after another, in place of datagrams.
    sac, sic : int
        Area code and identification code of the service.
    service : int
        The service's number for this user.
    period_s, status_period_s : float
        Data time between two reports of the tracks, and of sensors and service, s; multiples of
        half a second.
    area_deg : tuple of float
        West, south, east and north of the area of the user; tracks everywhere without it. A west
        beyond the east goes over the antimeridian.
    tentative : bool
        Whether the user gets tentative tracks.
    plane_centre_deg : tuple of float
        Latitude and longitude of the centre of the user's stereographic plane, for Cartesian
        positions; none without it.
    block_octets_max : int
        Octets of a block, which is one datagram.
    """

    name: Label | None = None
    address: Ipv4 = "127.0.0.1"
    port: Annotated[Port, Field(ge=1)] | None = None
    interface: Ipv4 = "127.0.0.1"
    ttl: Octet = 1
    send_buffer_octets: SocketOctets = 4 * 1024 * 1024
    file: Path | None = None
    sac: Octet = 0
    sic: Octet = 0
    service: Octet = 1
    period_s: Period = 4.0
    status_period_s: Period = 8.0
    area_deg: tuple[Longitude, Latitude, Longitude, Latitude] | None = None
    tentative: bool = True
    plane_centre_deg: tuple[CentreLatitude, Longitude] | None = None
    block_octets_max: Annotated[Count, Field(ge=256, le=65_000)] = 1400

    @property
    def label(self) -> str:
        """The name that it goes by."""
        if self.name is not None:
            return self.name
        return f"{self.address}-{self.port}" if self.file is None else self.file.name

    @model_validator(mode="after")
    def _goes_one_way(self) -> Self:
        if (self.port is None) == (self.file is None):
            raise PydanticCustomError(
                "one_way", "Input should be a table with a port or a file, and not both", {}
            )
        if self.area_deg is not None and self.area_deg[1] > self.area_deg[3]:
            raise PydanticCustomError(
                "area", "Input should be an area whose south lies south of its north", {}
            )
        return self
