"""Forecasts: the state of a track, propagated with its covariance."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.track import TrackState


class ForecastPoint(Record):
    """Where a track is expected to be at one time."""

    time_s: Annotated[float, described("Data time of the forecast", unit="s", source="request")]
    latitude_deg: Annotated[
        float, described("Expected WGS 84 latitude", unit="degree", source="filter")
    ]
    longitude_deg: Annotated[
        float, described("Expected WGS 84 longitude", unit="degree", source="filter")
    ]
    height_m: Annotated[
        float | None,
        described("Height of the track now", unit="m", source="filter", absent="as in tracks"),
    ]
    covariance_east_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Variance of the position, east", unit="m²", source="filter"),
    ]
    covariance_east_north_m2: Annotated[
        float, described("Covariance of east and north", unit="m²", source="filter")
    ]
    covariance_north_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Variance of the position, north", unit="m²", source="filter"),
    ]
    position_sigma_m: Annotated[
        float,
        Field(ge=0.0),
        described("Square root of the sum of the two variances", unit="m", source="filter"),
    ]
    state: Annotated[
        TrackState,
        described(
            "State of the track now; a coasting track was not heard lately",
            unit="name",
            source="service",
        ),
    ]
    age_s: Annotated[
        float,
        Field(ge=0.0),
        described("`time_s` minus the time of the last update", unit="s", source="service"),
    ]


class Forecast(Record):
    """The forecast of one track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    points: Annotated[
        list[ForecastPoint],
        described("The forecast, by ascending time", unit="list", source="filter"),
    ]
