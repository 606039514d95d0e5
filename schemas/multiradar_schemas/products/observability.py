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
            "Measurements with a range, and position reports", unit="1", source="measurement"
        ),
    ]
    bearings: Annotated[
        int,
        Field(ge=0),
        described("Measurements of azimuth only", unit="1", source="measurement"),
    ]
    places: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of sites of the bearings; a moving source counts once",
            unit="1",
            source="sensors",
        ),
    ]
    crossing: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Crossing angle of the lines of sight of the bearings in units of its error, "
            "condition (10) of Nenartovich and Isakov; 0 from a single site. With sources that "
            "move or measure elevation: distance to the nearest source in sigmas of the "
            "position, for straight flight. Errors are random errors and the uncertainty of the "
            "azimuth bias of each source, common to all its bearings; elevation is assumed "
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
            "Whether the position is observable: a range was measured or lines of sight cross; "
            "otherwise the distance of the track is extrapolated",
            unit="true or false",
            source="restoration",
        ),
    ]


#: `observability.parquet`: one row for each track and epoch in which it was updated.
OBSERVABILITY_SCHEMA = table_schema(Observability)
