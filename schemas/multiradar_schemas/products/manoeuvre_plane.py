"""The manoeuvre plane of a track, in JSON and as rows of `manoeuvre_planes.parquet`."""

from typing import Annotated, Literal

import polars as pl
from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema

PlaneReason = Literal["TOO_FEW_POINTS", "POINTS_ON_A_LINE", "NO_CONVERGENCE"]

#: Reasons for the absence of a plane.
PLANE_REASON_MEANINGS: dict[PlaneReason, str] = {
    "TOO_FEW_POINTS": "fewer than four plots in the window have a height and a position.",
    "POINTS_ON_A_LINE": "the plots are on a straight line, which does not determine a plane.",
    "NO_CONVERGENCE": "the plane fit did not converge.",
}

_FRAME = "in the frame of the last plot (east, north, up)"


class PlanePosition(Record):
    """A plot projected onto the plane."""

    time_s: Annotated[float, described("Data time of the plot", unit="s", source="measurement")]
    latitude_deg: Annotated[
        float, described("WGS 84 latitude", unit="degree", source="restoration")
    ]
    longitude_deg: Annotated[
        float, described("WGS 84 longitude", unit="degree", source="restoration")
    ]
    height_m: Annotated[
        float,
        described(
            "Height, with the same reference as the measured heights",
            unit="m",
            source="restoration",
        ),
    ]


class PlaneFigures(Record):
    """A plane fitted to the plots of a window, and its goodness of fit."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float, described("Data time of the last update of the track", unit="s", source="tracker")
    ]
    window_s: Annotated[
        float,
        Field(gt=0.0),
        described("Length of the window of plots before `time_s`", unit="s", source="request"),
    ]
    points: Annotated[
        int, Field(ge=4), described("Number of plots used", unit="1", source="restoration")
    ]
    normal_east: Annotated[
        float,
        described(f"East component of the unit normal, {_FRAME}", unit="1", source="restoration"),
    ]
    normal_north: Annotated[
        float, described("North component of the unit normal", unit="1", source="restoration")
    ]
    normal_up: Annotated[
        float,
        Field(ge=0.0),
        described("Upward component of the unit normal", unit="1", source="restoration"),
    ]
    distance_m: Annotated[
        float,
        described(
            "Distance of the plane from the origin of the frame, along the normal",
            unit="m",
            source="restoration",
        ),
    ]
    origin_latitude_deg: Annotated[
        float,
        described(
            "WGS 84 latitude of the origin, on the ellipsoid", unit="degree", source="restoration"
        ),
    ]
    origin_longitude_deg: Annotated[
        float, described("WGS 84 longitude of the origin", unit="degree", source="restoration")
    ]
    tilt_deg: Annotated[
        float,
        Field(ge=0.0, le=90.0),
        described(
            "Angle between the plane and the horizontal: 0 for a level turn, 90 for a vertical "
            "manoeuvre",
            unit="degree",
            source="restoration",
        ),
    ]
    normal_sigma_deg: Annotated[
        float,
        Field(ge=0.0, le=90.0),
        described(
            "Standard deviation of the normal in its least certain direction",
            unit="degree",
            source="restoration",
        ),
    ]
    statistic: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Test statistic Λ, χ² distributed for planar motion", unit="1", source="restoration"
        ),
    ]
    degrees_of_freedom: Annotated[
        int, Field(ge=1), described("`points` minus 3", unit="1", source="restoration")
    ]
    p_value: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described(
            "Probability of a statistic at least as large for planar motion",
            unit="1",
            source="restoration",
        ),
    ]
    is_planar: Annotated[
        bool,
        described(
            "Whether `p_value` is at least 0.003", unit="true or false", source="restoration"
        ),
    ]
    printed_statistic: Annotated[
        float,
        Field(ge=0.0),
        described(
            "√(2 Λ), left-hand side of the published criterion", unit="1", source="restoration"
        ),
    ]
    printed_threshold: Annotated[
        float,
        Field(ge=0.0),
        described(
            "√(2 N) + 2, right-hand side of the published criterion", unit="1", source="restoration"
        ),
    ]
    refused_by_printed_criterion: Annotated[
        bool | None,
        described(
            "Whether the left-hand side exceeds the right-hand side",
            unit="true or false",
            source="restoration",
            absent="30 points or fewer",
        ),
    ]


class ManoeuvrePlane(PlaneFigures):
    """The plane of a track, with its plots projected onto the plane."""

    positions: Annotated[
        list[PlanePosition],
        described("The plots in time order", unit="list", source="restoration"),
    ]


#: `manoeuvre_planes.parquet`: one row for each track and epoch in which it was updated. Where the
#: plots do not determine a plane, all but the first three is null, and `reason` says why.
MANOEUVRE_PLANE_SCHEMA = pl.Schema({**table_schema(PlaneFigures), "reason": pl.String()})
