"""Forecasts: the state of a track, extrapolated with its covariance."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.products.track import TrackState


class ForecastMember(Record):
    """A member of the forecast ensemble: a possible trajectory, at one time."""

    weight: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described("Probability of the member at the forecast time", unit="1", source="bundle"),
    ]
    trajectory: Annotated[
        int | None,
        described(
            "Index of the trajectory of the bundle that the member continues, from 0 (the most "
            "likely)",
            unit="1",
            source="bundle",
            absent="last member, which combines all others",
        ),
    ]
    lasts_s: Annotated[
        float | None,
        described(
            "Remaining duration of the turn or acceleration of that trajectory",
            unit="s",
            source="bundle",
            absent="straight flight, last member",
        ),
    ]
    later: Annotated[
        str | None,
        described(
            "Next manoeuvre, at an uncertain time: straight, right, left or speed",
            unit="name",
            source="bundle",
            absent="last member",
        ),
    ]
    latitude_deg: Annotated[
        float, described("Predicted WGS 84 latitude", unit="degree", source="bundle")
    ]
    longitude_deg: Annotated[
        float, described("Predicted WGS 84 longitude", unit="degree", source="bundle")
    ]
    velocity_east_mps: Annotated[
        float, described("Predicted velocity, east", unit="m/s", source="bundle")
    ]
    velocity_north_mps: Annotated[
        float, described("Predicted velocity, north", unit="m/s", source="bundle")
    ]
    covariance_east_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Position variance, east", unit="m²", source="bundle"),
    ]
    covariance_east_north_m2: Annotated[
        float, described("Position covariance of east and north", unit="m²", source="bundle")
    ]
    covariance_north_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Position variance, north", unit="m²", source="bundle"),
    ]


class ForecastPoint(Record):
    """The predicted position of a track at one time."""

    time_s: Annotated[float, described("Data time of the forecast", unit="s", source="request")]
    latitude_deg: Annotated[
        float, described("Predicted WGS 84 latitude", unit="degree", source="filter")
    ]
    longitude_deg: Annotated[
        float, described("Predicted WGS 84 longitude", unit="degree", source="filter")
    ]
    height_m: Annotated[
        float | None,
        described(
            "Current height of the track",
            unit="m",
            source="filter",
            absent="as in `tracks.parquet`",
        ),
    ]
    covariance_east_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Position variance, east", unit="m²", source="filter"),
    ]
    covariance_east_north_m2: Annotated[
        float, described("Position covariance of east and north", unit="m²", source="filter")
    ]
    covariance_north_m2: Annotated[
        float,
        Field(ge=0.0),
        described("Position variance, north", unit="m²", source="filter"),
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
            "Major semi-axis of the containment ellipse of the requested probability",
            unit="m",
            source="filter",
        ),
    ]
    region_minor_m: Annotated[
        float, Field(ge=0.0), described("Minor semi-axis", unit="m", source="filter")
    ]
    region_azimuth_deg: Annotated[
        float,
        Field(ge=0.0, le=180.0),
        described("Azimuth of the major axis, from true north", unit="degree", source="filter"),
    ]
    region_factor: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Factor by which the covariance is scaled to the ellipse: 5.99 for 95 % of a "
            "Gaussian, otherwise calibrated with the errors of earlier forecasts",
            unit="1",
            source="tracker",
        ),
    ]
    calibrated: Annotated[
        bool,
        described(
            "Whether the ellipse is calibrated with enough earlier forecasts of this horizon; "
            "otherwise the ellipse covers worst-case manoeuvres or, with method `bundle`, is "
            "computed from the mixture",
            unit="true or false",
            source="tracker",
        ),
    ]
    motion: Annotated[
        str,
        described(
            "Motion model that fitted earlier forecasts best",
            unit="name",
            source="tracker",
        ),
    ]
    state: Annotated[
        TrackState,
        described(
            "Current state of the track; coasting: no recent measurement",
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
            "Members of the forecast ensemble in order of decreasing weight; those outside the "
            "system plane are omitted",
            unit="list",
            source="bundle",
            absent="methods other than `bundle`, and rows of `forecasts.parquet`",
        ),
    ] = None


class Forecast(Record):
    """The forecast of a track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    probability: Annotated[
        float,
        Field(gt=0.0, lt=1.0),
        described("Containment probability of the ellipses", unit="1", source="request"),
    ]
    by: Annotated[str, described("Method of the forecast", unit="name", source="request")]
    points: Annotated[
        list[ForecastPoint],
        described("Predicted positions in time order", unit="list", source="filter"),
    ]


class ForecastRow(ForecastPoint):
    """A row of `forecasts.parquet`: a point of a forecast made at an update of a track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    made_s: Annotated[
        float,
        described(
            "Data time of the last update of the track, on which the forecast is based",
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
        described("Containment probability of the ellipse", unit="1", source="tracker"),
    ]
    by: Annotated[str, described("Method of the forecast", unit="name", source="tracker")]


#: `forecasts.parquet`: one row for each track, time of forecast, and horizon.
FORECAST_SCHEMA = table_schema(
    ForecastRow,
    first=("track_id", "made_s", "horizon_s", "time_s", "by", "motion", "probability"),
    without={"members"},
)
