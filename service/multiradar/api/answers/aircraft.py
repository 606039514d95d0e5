"""Models of `aircraft.json` and `receiver.json`, for the documentation."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Aircraft(_Strict):
    """A track in the units of readsb; unknown values are absent."""

    hex: Annotated[
        str,
        Field(
            pattern=r"^~?[0-9a-f]{6}$",
            description="ICAO address; without an address, `~` and the track number",
        ),
    ]
    type: Annotated[
        Literal["adsb_icao", "adsb_other", "mlat", "tisb_icao", "tisb_trackfile"],
        Field(description="Best source of the track updates; `tisb_…` denotes radar"),
    ]
    flight: Annotated[str | None, Field(pattern=r"^[0-9A-Z ]{8}$", description="Callsign")] = None
    alt_baro: Annotated[
        int | Literal["ground"] | None, Field(description="Altitude, ft, or `ground`")
    ] = None
    gs: Annotated[float, Field(ge=0.0, description="Ground speed, kt")]
    track: Annotated[float, Field(ge=0.0, lt=360.0, description="True track, degrees")]
    baro_rate: Annotated[int | None, Field(description="Rate of climb, ft/min")] = None
    squawk: Annotated[str | None, Field(pattern=r"^[0-7]{4}$", description="Mode 3/A code")] = None
    lat: Annotated[float, Field(ge=-90.0, le=90.0, description="Latitude, degrees")]
    lon: Annotated[float, Field(ge=-180.0, le=180.0, description="Longitude, degrees")]
    nac_p: Annotated[
        int,
        Field(
            ge=0,
            le=11,
            description="Navigation accuracy category for position, derived from the position "
            "sigma",
        ),
    ]
    seen_pos: Annotated[float, Field(ge=0.0, description="Age of the position, s")]
    mlat: Annotated[
        list[str], Field(description="Names of the fields derived from multilateration")
    ]
    tisb: Annotated[list[str], Field(description="Names of the fields derived from radar plots")]
    messages: Annotated[int, Field(ge=1, description="Number of updates of the track")]
    seen: Annotated[float, Field(ge=0.0, description="Time since the last update of the track, s")]


class AircraftJson(_Strict):
    """All confirmed tracks."""

    now: Annotated[float, Field(description="Data time, Unix time, s")]
    messages: Annotated[int, Field(ge=0, description="Number of track updates so far")]
    aircraft: list[Aircraft]


class ReceiverJson(_Strict):
    """Settings that tar1090 reads once at startup."""

    version: str
    refresh: Annotated[int, Field(description="Refresh interval, ms")]
    history: Annotated[Literal[0], Field(description="Number of history files")]
    lat: Annotated[
        float | None, Field(description="Latitude of the centre of the sensors, degrees")
    ] = None
    lon: Annotated[
        float | None, Field(description="Longitude of the centre of the sensors, degrees")
    ] = None
