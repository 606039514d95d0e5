"""Encounters: pairs of tracks predicted to come close to each other."""

from typing import Annotated

from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.products.track import TrackState

_HEIGHTS = "a height is unknown, or only one of the two heights is a pressure altitude"


class Encounter(Record):
    """The predicted closest point of approach of two tracks; a row of `encounters.parquet`."""

    time_s: Annotated[float, described("Data time of the forecast", unit="s", source="service")]
    closest_time_s: Annotated[
        float,
        described(
            "Data time of the closest point of approach of the predicted positions within the "
            "horizon; `time_s` for tracks that fly together",
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
            absent="closest now or at the end of the horizon, or the uncertainty extends beyond "
            "the horizon",
        ),
    ]
    distance_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Horizontal distance between the predicted positions at `closest_time_s`",
            unit="m",
            source="filter",
        ),
    ]
    distance_sigma_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Standard deviation of the signed distance (the sign gives the passing side)",
            unit="m",
            source="filter",
        ),
    ]
    distance_low_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "2.5 % quantile of the minimum distance within the horizon; 0 if the 95 % interval "
            "that starts at 0 is shorter",
            unit="m",
            source="filter",
        ),
    ]
    distance_high_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "97.5 % quantile of the same distance, or 95 % quantile if `distance_low_m` is 0",
            unit="m",
            source="filter",
        ),
    ]
    distance_now_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Current horizontal distance between the predicted positions", unit="m", source="filter"
        ),
    ]
    together: Annotated[
        bool,
        described(
            "Whether the tracks are currently within the distance threshold and their relative "
            "velocity is not significant; if so, the time of closest approach is undefined and "
            "set to `time_s`",
            unit="true or false",
            source="filter",
        ),
    ]
    probability: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described(
            "Conflict probability: probability that the minimum distance within the horizon is "
            "below the threshold",
            unit="1",
            source="filter",
        ),
    ]
    vertical_separation_m: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Predicted vertical separation at `closest_time_s`",
            unit="m",
            source="filter",
            absent=_HEIGHTS,
        ),
    ]
    vertical_sigma_m: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of the signed separation",
            unit="m",
            source="filter",
            absent=_HEIGHTS,
        ),
    ]
    probability_both: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Probability that the tracks are within the distance threshold and, at the same "
            "time, within the height threshold",
            unit="1",
            source="filter",
            absent=f"no height threshold, {_HEIGHTS}",
        ),
    ]
    first_track_id: Annotated[
        int,
        Field(ge=1),
        described("The track with the smaller number", unit="1", source="tracker"),
    ]
    first_state: Annotated[
        TrackState,
        described(
            "Current state of the track; coasting: no recent measurement",
            unit="name",
            source="service",
        ),
    ]
    first_age_s: Annotated[
        float,
        Field(ge=0.0),
        described(
            "`time_s` minus the time of the last update of the track", unit="s", source="service"
        ),
    ]
    first_latitude_deg: Annotated[
        float,
        described(
            "WGS 84 latitude of the track at `closest_time_s`", unit="degree", source="filter"
        ),
    ]
    first_longitude_deg: Annotated[
        float,
        described(
            "WGS 84 longitude of the track at `closest_time_s`", unit="degree", source="filter"
        ),
    ]
    first_height_m: Annotated[
        float | None,
        described(
            "Height of the track at `closest_time_s`",
            unit="m",
            source="filter",
            absent="no height received",
        ),
    ]
    second_track_id: Annotated[
        int, Field(ge=1), described("The other track", unit="1", source="tracker")
    ]
    second_state: Annotated[
        TrackState, described("Current state of the track", unit="name", source="service")
    ]
    second_age_s: Annotated[
        float,
        Field(ge=0.0),
        described(
            "`time_s` minus the time of the last update of the track", unit="s", source="service"
        ),
    ]
    second_latitude_deg: Annotated[
        float,
        described(
            "WGS 84 latitude of the track at `closest_time_s`", unit="degree", source="filter"
        ),
    ]
    second_longitude_deg: Annotated[
        float,
        described(
            "WGS 84 longitude of the track at `closest_time_s`", unit="degree", source="filter"
        ),
    ]
    second_height_m: Annotated[
        float | None,
        described(
            "Height of the track at `closest_time_s`",
            unit="m",
            source="filter",
            absent="no height received",
        ),
    ]


class Encounters(Record):
    """Encounters of the live tracks, and their number."""

    time_s: Annotated[
        float | None,
        described(
            "Data time of the forecasts",
            unit="s",
            source="service",
            absent="before the first measurement",
        ),
    ]
    horizon_s: Annotated[float, described("Forecast horizon", unit="s", source="request")]
    distance_threshold_m: Annotated[
        float,
        described("Distance threshold for the predicted positions", unit="m", source="request"),
    ]
    height_threshold_m: Annotated[
        float | None,
        described(
            "Vertical threshold; pairs that are separated by more throughout the horizon are "
            "omitted",
            unit="m",
            source="request",
            absent="not requested",
        ),
    ]
    tracks: Annotated[
        int, Field(ge=0), described("Number of tracks considered", unit="1", source="service")
    ]
    tracks_tentative: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of tracks omitted because they are tentative and may be false",
            unit="1",
            source="service",
        ),
    ]
    tracks_off_plane: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of tracks omitted because they leave the system plane immediately",
            unit="1",
            source="service",
        ),
    ]
    pairs_left_out: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of pairs that were not compared, or were omitted for lack of capacity, "
            "because too many tracks are close together, counted separately for each 10 s of the "
            "horizon; 0: the list is complete",
            unit="1",
            source="service",
        ),
    ]
    total: Annotated[
        int,
        Field(ge=0),
        described("Number of encounters that match the query", unit="1", source="service"),
    ]
    count: Annotated[
        int,
        Field(ge=0),
        described("Number of encounters in this response", unit="1", source="service"),
    ]
    encounters: Annotated[
        list[Encounter],
        described("The encounters, in the requested order", unit="list", source="filter"),
    ]


#: `encounters.parquet`: one row for each encounter at the end of each epoch.
ENCOUNTER_SCHEMA = table_schema(Encounter)
