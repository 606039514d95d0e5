"""The neighbouring regions of a service, as it knows them."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.products.bias import BiasValue


class NeighbouringRegion(Record):
    """A neighbouring region."""

    name: Annotated[str, described("Name of the region", unit="name", source="settings")]
    latitude_deg: Annotated[
        float,
        described("WGS 84 latitude of the centre of the region", unit="degree", source="settings"),
    ]
    longitude_deg: Annotated[
        float,
        described("WGS 84 longitude of the centre of the region", unit="degree", source="settings"),
    ]
    state: Annotated[
        str,
        described("expected (no message so far), alive or silent", unit="name", source="service"),
    ]
    age_s: Annotated[
        float | None,
        Field(ge=0.0),
        described("Data time since the last message", unit="s", source="service",
                  absent="no message so far"),
    ]  # fmt: skip
    tracks: Annotated[int, Field(ge=0), described(
        "Number of tracks handed over by the region", unit="1",
                                                  source="service")]  # fmt: skip
    matched: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of these tracks that match a track of this service", unit="1", source="service"
        ),
    ]
    messages: Annotated[
        int, Field(ge=0), described("Number of messages so far", unit="1", source="service")
    ]  # fmt: skip
    biases: Annotated[
        tuple[BiasValue, ...],
        described(
            "Biases, as estimated by the region, of sensors that this service also has",
            unit="record",
            source="service",
        ),
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
        described(
            "Tracks within this distance of the boundary are handed over",
            unit="m",
            source="settings",
            absent="no `[region]`",
        ),
    ]
    responsible: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of tracks for which the service is responsible", unit="1", source="service"
        ),
    ]
    duplicates: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of tracks for which a neighbour is responsible", unit="1", source="service"
        ),
    ]
    takeovers: Annotated[
        int,
        Field(ge=0),
        described("Number of takeovers from neighbours so far", unit="1", source="service"),
    ]
    neighbours: Annotated[
        tuple[NeighbouringRegion, ...],
        described("The neighbouring regions", unit="record", source="service"),
    ]
