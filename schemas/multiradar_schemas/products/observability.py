"""Whether what was measured of a track says where it is, as JSON and as rows of a table."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema


class Observability(Record):
    """What the measurements of a window determine of a track; a row of `observability.parquet`."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float, described("Data time of the last update of the track", unit="s", source="tracker")
    ]
    window_s: Annotated[
        float,
        Field(gt=0.0),
        described(
            "Measurements so long before `time_s` were looked at", unit="s", source="request"
        ),
    ]
    ranges: Annotated[
        int,
        Field(ge=0),
        described("Measurements with a range, or of a position", unit="1", source="measurement"),
    ]
    bearings: Annotated[
        int,
        Field(ge=0),
        described("Measurements of an azimuth alone", unit="1", source="measurement"),
    ]
    places: Annotated[
        int,
        Field(ge=0),
        described(
            "Places from which the bearings were taken; a source that moves counts once",
            unit="1",
            source="sensors",
        ),
    ]
    crossing: Annotated[
        float,
        Field(ge=0.0),
        described(
            "By how many of their errors the lines of sight of the bearings cross, condition (10) "
            "of Nenartovich and Isakov; 0 from one place. With sources that move or measure "
            "elevations: how many sigmas of the place, in straight flight, the nearest is off. "
            "Errors are random ones, and what is not known of the azimuth bias of each source, "
            "which all its bearings have in common; elevations are taken to have no bias",
            unit="1",
            source="restoration",
        ),
    ]
    lines_cross: Annotated[
        bool,
        described("Whether `crossing` is above 3", unit="true or false", source="restoration"),
    ]
    is_observable: Annotated[
        bool,
        described(
            "Whether a range was measured or lines cross; else the distance of the track is what "
            "it was taken to be before",
            unit="true or false",
            source="restoration",
        ),
    ]


#: `observability.parquet`: one row for each track and epoch in which it was updated.
OBSERVABILITY_SCHEMA = table_schema(Observability)
