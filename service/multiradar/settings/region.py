"""The section `region`: the area of a service among neighbouring ones.

::

    [region]
    name = "west"
    latitude_deg = 49.0
    longitude_deg = 8.0
    listen = ["tcp/127.0.0.1:7461"]

    [[region.neighbours]]
    name = "east"
    latitude_deg = 49.0
    longitude_deg = 14.0
    endpoint = "tcp/127.0.0.1:7462"
"""

import math
from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator

from multiradar.settings.types import Endpoint, NotNegative, Seconds, Section, plain_number
from multiradar_schemas.documents.tables import wrong
from multiradar_schemas.products.handover import RegionName

#: Neighbours of a region.
NEIGHBOURS_MAX = 32
#: Nearer centres leave no area between each other, degrees.
CENTRES_APART_DEG = 0.01

_Latitude = Annotated[float, BeforeValidator(plain_number), Field(ge=-90.0, le=90.0)]
_Longitude = Annotated[float, BeforeValidator(plain_number), Field(ge=-180.0, le=180.0)]


class NeighbourSettings(Section):
    """A neighbouring region: its name, its centre, and where its service listens."""

    name: RegionName
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    endpoint: Annotated[
        Endpoint | None,
        Field(
            description="Address on which its service listens; absent: it connects to this service"
        ),
    ] = None


class RegionSettings(Section):
    """The area of this service: where its centre is nearer than those of its neighbours."""

    name: Annotated[
        RegionName | None, Field(description="Name of the region; absent: no neighbouring regions")
    ] = None
    latitude_deg: Annotated[_Latitude | None, Field(description="Latitude of the centre")] = None
    longitude_deg: Annotated[_Longitude | None, Field(description="Longitude of the centre")] = None
    margin_m: Annotated[
        NotNegative,
        Field(
            description="Tracks within this distance of the boundary or beyond are handed over, m"
        ),
    ] = 50_000.0
    hysteresis_m: Annotated[
        NotNegative,
        Field(description="Distance beyond the boundary at which the neighbour takes over, m"),
    ] = 2_000.0
    period_s: Annotated[Seconds, Field(description="Interval between handover messages, s")] = 1.0
    silence_s: Annotated[
        Seconds,
        Field(description="Data time without messages after which a neighbour is silent, s"),
    ] = 3.0
    discard_after_s: Annotated[
        Seconds,
        Field(description="Data time without a message after which its tracks are discarded, s"),
    ] = 60.0
    listen: tuple[Endpoint, ...] = ()
    neighbours: Annotated[tuple[NeighbourSettings, ...], Field(max_length=NEIGHBOURS_MAX)] = ()

    @model_validator(mode="after")
    def _is_a_partition(self) -> Self:
        if self.name is None:
            if self.model_fields_set:
                raise wrong("name: missing; specify the name of the region")
            return self
        if self.latitude_deg is None or self.longitude_deg is None:
            raise wrong("latitude_deg, longitude_deg: missing; specify the centre of the region")
        if not self.neighbours:
            raise wrong("neighbours: missing; add at least one table [[region.neighbours]]")
        if self.silence_s < 2.0 * self.period_s:
            raise wrong(f"silence_s: expected at least twice period_s, was {self.silence_s:g}")
        if self.discard_after_s < self.silence_s:
            raise wrong(
                f"discard_after_s: expected at least silence_s ({self.silence_s:g}), was "
                f"{self.discard_after_s:g}"
            )
        self._check_names(self.name)
        own = (self.name, self.latitude_deg, self.longitude_deg)
        every = [own, *((one.name, one.latitude_deg, one.longitude_deg) for one in self.neighbours)]
        _check_centres(every)
        return self

    def _check_names(self, name: str) -> None:
        known = {name.lower()}
        for one in self.neighbours:
            if one.name.lower() in known:
                raise wrong(f"expected each region name once, found {one.name} twice")
            known.add(one.name.lower())


def _check_centres(every: Sequence[tuple[str, float, float]]) -> None:
    for place, (name, latitude_deg, longitude_deg) in enumerate(every):
        for other, other_latitude_deg, other_longitude_deg in every[:place]:
            here = _direction(latitude_deg, longitude_deg)
            there = _direction(other_latitude_deg, other_longitude_deg)
            if math.dist(here, there) < math.radians(CENTRES_APART_DEG):
                raise wrong(
                    f"expected centres at least {CENTRES_APART_DEG} degrees apart, but {other} and "
                    f"{name} are closer together"
                )


def _direction(latitude_deg: float, longitude_deg: float) -> tuple[float, float, float]:
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    level = math.cos(latitude)
    return level * math.cos(longitude), level * math.sin(longitude), math.sin(latitude)
