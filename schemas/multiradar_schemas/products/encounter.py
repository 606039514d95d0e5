"""Encounters: pairs of tracks that are expected to come near each other."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.products.track import TrackState

_HEIGHTS = "a height is not known, or one is a pressure altitude and the other is not"


class Encounter(Record):
    """The expected closest approach of two tracks; a row of `encounters.parquet`."""

    time_s: Annotated[float, described("Data time of the forecast", unit="s", source="service")]
    closest_time_s: Annotated[
        float,
        described(
            "Data time at which the expected positions are nearest to each other, within the "
            "horizon; `time_s` of tracks that fly together",
            unit="s",
            source="filter",
        ),
    ]
    time_to_closest_s: Annotated[
        float,
        Field(ge=0.0),
        described("`closest_time_s` minus `time_s`", unit="s", source="filter"),
    ]
    time_sigma_s: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of `closest_time_s`",
            unit="s",
            source="filter",
            absent="nearest now or at the end of the horizon, or less certain than that is long",
        ),
    ]
    distance_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Horizontal distance of the expected positions at `closest_time_s`",
            unit="m",
            source="filter",
        ),
    ]
    distance_sigma_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Standard deviation of that distance with a sign: passing on one side or the other",
            unit="m",
            source="filter",
        ),
    ]
    distance_low_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "The least distance until the horizon is below this with 2.5 %; 0 where an interval of "
            "95 % from 0 on is shorter",
            unit="m",
            source="filter",
        ),
    ]
    distance_high_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "It is above this with 2.5 %; with 5 % where `distance_low_m` is 0",
            unit="m",
            source="filter",
        ),
    ]
    distance_now_m: Annotated[
        float,
        Field(ge=0.0),
        described("Horizontal distance of the expected positions now", unit="m", source="filter"),
    ]
    together: Annotated[
        bool,
        described(
            "Whether the two are within the distance now and their relative velocity cannot be "
            "told from zero: the time of the closest approach is then open, and now is told",
            unit="true or false",
            source="filter",
        ),
    ]
    probability: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described(
            "That the least distance until the horizon is below the one asked for",
            unit="1",
            source="filter",
        ),
    ]
    vertical_separation_m: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Expected difference of the heights at `closest_time_s`",
            unit="m",
            source="filter",
            absent=_HEIGHTS,
        ),
    ]
    vertical_sigma_m: Annotated[
        float | None,
        Field(ge=0.0),
        described("Its standard deviation with a sign", unit="m", source="filter", absent=_HEIGHTS),
    ]
    probability_both: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "That the two are within the distance, and at that time within the height asked for",
            unit="1",
            source="filter",
            absent=f"no height asked for, {_HEIGHTS}",
        ),
    ]
    first_track_id: Annotated[
        int,
        Field(ge=1),
        described("The track of the smaller number", unit="1", source="tracker"),
    ]
    first_state: Annotated[
        TrackState,
        described(
            "Its state now; a coasting track was not heard lately", unit="name", source="service"
        ),
    ]
    first_age_s: Annotated[
        float,
        Field(ge=0.0),
        described("`time_s` minus the time of its last update", unit="s", source="service"),
    ]
    first_latitude_deg: Annotated[
        float,
        described("Its WGS 84 latitude at `closest_time_s`", unit="degree", source="filter"),
    ]
    first_longitude_deg: Annotated[
        float,
        described("Its WGS 84 longitude at `closest_time_s`", unit="degree", source="filter"),
    ]
    first_height_m: Annotated[
        float | None,
        described(
            "Its height at `closest_time_s`", unit="m", source="filter", absent="no height heard"
        ),
    ]
    second_track_id: Annotated[
        int, Field(ge=1), described("The other track", unit="1", source="tracker")
    ]
    second_state: Annotated[TrackState, described("Its state now", unit="name", source="service")]
    second_age_s: Annotated[
        float,
        Field(ge=0.0),
        described("`time_s` minus the time of its last update", unit="s", source="service"),
    ]
    second_latitude_deg: Annotated[
        float,
        described("Its WGS 84 latitude at `closest_time_s`", unit="degree", source="filter"),
    ]
    second_longitude_deg: Annotated[
        float,
        described("Its WGS 84 longitude at `closest_time_s`", unit="degree", source="filter"),
    ]
    second_height_m: Annotated[
        float | None,
        described(
            "Its height at `closest_time_s`", unit="m", source="filter", absent="no height heard"
        ),
    ]


class Encounters(Record):
    """Encounters among the live tracks, and how many there are."""

    time_s: Annotated[
        float | None,
        described(
            "Data time of the forecasts",
            unit="s",
            source="service",
            absent="before the first measurement",
        ),
    ]
    horizon_s: Annotated[float, described("How far ahead", unit="s", source="request")]
    distance_threshold_m: Annotated[
        float,
        described(
            "Pairs whose expected positions come so near are told", unit="m", source="request"
        ),
    ]
    height_threshold_m: Annotated[
        float | None,
        described(
            "Those whose heights stay farther apart all the while are not",
            unit="m",
            source="request",
            absent="not asked for",
        ),
    ]
    tracks: Annotated[
        int, Field(ge=0), described("Tracks that were looked at", unit="1", source="service")
    ]
    tracks_tentative: Annotated[
        int,
        Field(ge=0),
        described(
            "Tracks left out because they are tentative and may be no aircraft",
            unit="1",
            source="service",
        ),
    ]
    tracks_off_plane: Annotated[
        int,
        Field(ge=0),
        described(
            "Tracks left out because they leave the system plane at once",
            unit="1",
            source="service",
        ),
    ]
    pairs_left_out: Annotated[
        int,
        Field(ge=0),
        described(
            "Comparisons not made, or without room for what they found, because too many tracks "
            "are in one place; those of each 10 s of the horizon counted anew. 0: nothing is "
            "missing",
            unit="1",
            source="service",
        ),
    ]
    total: Annotated[
        int,
        Field(ge=0),
        described("Encounters that meet what was asked for", unit="1", source="service"),
    ]
    count: Annotated[
        int, Field(ge=0), described("Encounters in this answer", unit="1", source="service")
    ]
    encounters: Annotated[
        list[Encounter],
        described("The encounters, in the order asked for", unit="list", source="filter"),
    ]


#: `encounters.parquet`: one row for each encounter at the end of each epoch.
ENCOUNTER_SCHEMA = table_schema(Encounter)
