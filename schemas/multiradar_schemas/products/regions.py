"""The neighbouring regions of a service, as it knows them."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.products.bias import BiasValue


class NeighbouringRegion(Record):
    """A neighbouring region."""

    name: Annotated[str, described("Its name", unit="name", source="settings")]
    latitude_deg: Annotated[
        float, described("Its centre: WGS 84 latitude", unit="degree", source="settings")
    ]
    longitude_deg: Annotated[float, described("Longitude", unit="degree", source="settings")]
    state: Annotated[
        str,
        described("expected (no message so far), alive or silent", unit="name", source="service"),
    ]
    age_s: Annotated[
        float | None,
        Field(ge=0.0),
        described("Data time since its last message", unit="s", source="service",
                  absent="no message so far"),
    ]  # fmt: skip
    tracks: Annotated[int, Field(ge=0), described("Tracks it handed over", unit="1",
                                                  source="service")]  # fmt: skip
    matched: Annotated[
        int,
        Field(ge=0),
        described("Those that have a track here", unit="1", source="service"),
    ]
    messages: Annotated[
        int, Field(ge=0), described("Messages so far", unit="1", source="service")
    ]  # fmt: skip
    biases: Annotated[
        tuple[BiasValue, ...],
        described("Its biases of sensors that are known here", unit="record", source="service"),
    ]


class Regions(Record):
    """The region of this service and its neighbours."""

    name: Annotated[
        str | None,
        described("The region of this service", unit="name", source="settings",
                  absent="no `[region]` in the settings"),
    ]  # fmt: skip
    margin_m: Annotated[
        float | None,
        described("Tracks nearer to the boundary are handed over", unit="m", source="settings",
                  absent="no `[region]`"),
    ]  # fmt: skip
    responsible: Annotated[
        int,
        Field(ge=0),
        described("Tracks for which the service is responsible", unit="1", source="service"),
    ]
    duplicates: Annotated[
        int,
        Field(ge=0),
        described("Tracks for which a neighbour is responsible", unit="1", source="service"),
    ]
    takeovers: Annotated[
        int,
        Field(ge=0),
        described("Takeovers from neighbours so far", unit="1", source="service"),
    ]
    neighbours: Annotated[
        tuple[NeighbouringRegion, ...],
        described("The neighbouring regions", unit="record", source="service"),
    ]
