"""Observability of the position of a track, in JSON and as rows of a table."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema


class Observability(Record):
    """Observability of a track from a window of measurements; a row of `observability.parquet`."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float, described("Data time of the last update of the track", unit="s", source="tracker")
    ]
    window_s: Annotated[
        float,
        Field(gt=0.0),
        described(
            "Length of the window of measurements before `time_s`", unit="s", source="request"
        ),
    ]
    ranges: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of measurements with a range, and of position reports",
            unit="1",
            source="measurement",
        ),
    ]
    bearings: Annotated[
        int,
        Field(ge=0),
        described("Number of azimuth-only measurements", unit="1", source="measurement"),
    ]
    places: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of sites from which bearings were measured; a moving sensor counts once",
            unit="1",
            source="sensors",
        ),
    ]
    crossing: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Crossing angle of the lines of sight in units of its error, condition (10) of "
            "Nenartovich and Isakov; 0 with a single site. If sensors move or measure elevation: "
            "distance to the nearest sensor in units of the position sigma, assuming straight "
            "flight. The errors are random errors and, for each sensor, the azimuth bias "
            "uncertainty, which is common to all its bearings; elevation is assumed to be "
            "unbiased",
            unit="1",
            source="restoration",
        ),
    ]
    lines_cross: Annotated[
        bool,
        described("Whether `crossing` exceeds 3", unit="true or false", source="restoration"),
    ]
    is_observable: Annotated[
        bool,
        described(
            "Whether the position is observable: a range was measured, or lines of sight "
            "intersect; otherwise the distance of the track is extrapolated",
            unit="true or false",
            source="restoration",
        ),
    ]


#: `observability.parquet`: one row for each track and epoch in which it was updated.
OBSERVABILITY_SCHEMA = table_schema(Observability)
