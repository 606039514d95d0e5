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

from multiradar.settings.types import Count, Ipv4, Label, Port, Section, SocketOctets, plain_number
from multiradar_schemas.documents.tables import wrong

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
        Name in counters; default: address and port, or the name of the file.
    address : str
        Destination of datagrams: a host or a multicast group.
    port : int
        UDP port; a user with a port receives datagrams.
    interface : str
        Address of the interface for multicast.
    ttl : int
        Time to live of multicast datagrams: 0 this host, 1 the network of the interface.
    send_buffer_octets : int
        Requested send buffer of the socket.
    file : Path
        File to which blocks are appended, instead of datagrams.
    sac, sic : int
        SAC and SIC of the service.
    service : int
        Service identification for this user.
    period_s, status_period_s : float
        Report period of tracks, and of sensor and service status, s of data time; multiples of 0.5
        s.
    area_deg : tuple of float
        West, south, east and north of the area of interest; default: everywhere. An area with west
        greater than east crosses the antimeridian.
    tentative : bool
        Whether to send tentative tracks.
    plane_centre_deg : tuple of float
        Latitude and longitude of the centre of the stereographic plane of Cartesian positions;
        default: no Cartesian positions.
    block_octets_max : int
        Maximum size of a block, which is one datagram.
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
        """Name in counters and messages."""
        if self.name is not None:
            return self.name
        return f"{self.address}-{self.port}" if self.file is None else self.file.name

    @model_validator(mode="after")
    def _has_one_destination(self) -> Self:
        if (self.port is None) == (self.file is None):
            raise wrong(
                "expected either port or file, found "
                + ("neither" if self.port is None else "both")
            )
        if self.area_deg is not None and self.area_deg[1] > self.area_deg[3]:
            south, north = self.area_deg[1], self.area_deg[3]
            raise wrong(f"area_deg: expected south below north, was {south:g} and {north:g}")
        return self
