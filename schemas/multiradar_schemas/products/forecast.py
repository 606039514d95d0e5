"""Forecasts: the state of a track, propagated with its covariance."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.products.track import TrackState


class ForecastMember(Record):
    """One of the trajectories that an aircraft may fly, at one time."""

    weight: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described("Its probability at that time", unit="1", source="bundle"),
    ]
    trajectory: Annotated[
        int | None,
        described(
            "Number of the trajectory of the bundle that it continues, from 0, the best",
            unit="1",
            source="bundle",
            absent="in the last member, which is all others as one",
        ),
    ]
    lasts_s: Annotated[
        float | None,
        described(
            "So long the turn or change of speed of that trajectory goes on",
            unit="s",
            source="bundle",
            absent="in straight flight, and in the last member",
        ),
    ]
    later: Annotated[
        str | None,
        described(
            "What begins after it, at a time that is open: straight, right, left or speed",
            unit="name",
            source="bundle",
            absent="in the last member",
        ),
    ]
    latitude_deg: Annotated[
        float, described("Expected WGS 84 latitude", unit="degree", source="bundle")
    ]
    longitude_deg: Annotated[
        float, described("Expected WGS 84 longitude", unit="degree", source="bundle")
    ]
    velocity_east_mps: Annotated[
        float, described("Expected velocity, east", unit="m/s", source="bundle")
    ]
    velocity_north_mps: Annotated[
        float, described("Expected velocity, north", unit="m/s", source="bundle")
    ]
    covariance_east_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Variance of the position, east", unit="m²", source="bundle"),
    ]
    covariance_east_north_m2: Annotated[
        float, described("Covariance of east and north", unit="m²", source="bundle")
    ]
    covariance_north_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Variance of the position, north", unit="m²", source="bundle"),
    ]


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
    region_major_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Longer semi-axis of the ellipse that holds the aircraft with the probability asked "
            "for",
            unit="m",
            source="filter",
        ),
    ]
    region_minor_m: Annotated[
        float, Field(ge=0.0), described("Shorter semi-axis", unit="m", source="filter")
    ]
    region_azimuth_deg: Annotated[
        float,
        Field(ge=0.0, le=180.0),
        described("Direction of the longer one, from true north", unit="degree", source="filter"),
    ]
    region_factor: Annotated[
        float,
        Field(ge=0.0),
        described(
            "The ellipse is the covariance times this: 5.99 for 95 % of a Gaussian, else as the "
            "errors of earlier forecasts ask",
            unit="1",
            source="tracker",
        ),
    ]
    calibrated: Annotated[
        bool,
        described(
            "Whether enough earlier forecasts as far ahead have been judged; else the ellipse "
            "covers what aircraft may do at worst, or is that of the mixture of a bundle",
            unit="true or false",
            source="tracker",
        ),
    ]
    motion: Annotated[
        str,
        described(
            "How the aircraft is taken to move: as earlier forecasts fitted best",
            unit="name",
            source="tracker",
        ),
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
    members: Annotated[
        list[ForecastMember] | None,
        described(
            "Trajectories that it is the mean of, by falling weight; those outside the system "
            "plane are left out",
            unit="list",
            source="bundle",
            absent="with other methods than bundle, and in the file",
        ),
    ] = None


class Forecast(Record):
    """The forecast of one track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    probability: Annotated[
        float,
        Field(gt=0.0, lt=1.0),
        described("That of the ellipses", unit="1", source="request"),
    ]
    by: Annotated[str, described("Method of the forecast", unit="name", source="request")]
    points: Annotated[
        list[ForecastPoint],
        described("The forecast, by ascending time", unit="list", source="filter"),
    ]


class ForecastRow(ForecastPoint):
    """A row of `forecasts.parquet`: one point of a forecast made at an update of a track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    made_s: Annotated[
        float,
        described(
            "Data time of the last update of the track, from which it is made",
            unit="s",
            source="tracker",
        ),
    ]
    horizon_s: Annotated[
        float, Field(gt=0.0), described("`time_s` minus `made_s`", unit="s", source="tracker")
    ]
    probability: Annotated[
        float,
        Field(gt=0.0, lt=1.0),
        described("That of the ellipse", unit="1", source="tracker"),
    ]
    by: Annotated[str, described("Method of the forecast", unit="name", source="tracker")]


#: `forecasts.parquet`: one row for each track, moment at which it was forecast, and horizon.
FORECAST_SCHEMA = table_schema(
    ForecastRow,
    first=("track_id", "made_s", "horizon_s", "time_s", "by", "motion", "probability"),
    without={"members"},
)
