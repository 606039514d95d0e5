"""Tracks in JSON, with the same fields as `tracks.parquet` and their age."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.measurement import MODE_3A_PATTERN, SENSOR_ID_PATTERN

TrackState = Literal["tentative", "confirmed", "coasting", "stale"]


class TrackUpdate(Record):
    """The state of a track after a measurement; a row of `tracks.parquet`."""

    time_s: Annotated[
        float, described("Data time of the measurement", unit="s", source="measurement")
    ]
    track_id: Annotated[
        int,
        Field(ge=1),
        described("The track, numbered in order of first appearance", unit="1", source="tracker"),
    ]
    track_number: Annotated[
        int | None,
        Field(ge=0),
        described(
            "Number of the aircraft in the recording",
            unit="1",
            source="recording",
            absent="not in any measurement of the track",
        ),
    ]
    mode_s_address: Annotated[
        str | None,
        StringConstraints(pattern=r"^[0-9a-f]{6}$"),
        described(
            "ICAO 24-bit address",
            unit="6 lower-case hexadecimal digits",
            source="aircraft",
            absent="never received",
        ),
    ]
    mode_3a: Annotated[
        str | None,
        StringConstraints(pattern=MODE_3A_PATTERN),
        described(
            "Last Mode 3/A code received",
            unit="4 octal digits",
            source="aircraft",
            absent="never received",
        ),
    ]
    latitude_deg: Annotated[
        float, described("Estimated WGS 84 latitude", unit="degree", source="filter")
    ]
    longitude_deg: Annotated[
        float, described("Estimated WGS 84 longitude", unit="degree", source="filter")
    ]
    height_m: Annotated[
        float | None,
        described(
            "Height estimated from the received heights, with the same reference (for Mode C, a "
            "pressure altitude); for an aircraft without height reports, estimated from the "
            "plots of several radars",
            unit="m",
            source="filter",
            absent="not received, and not estimated to within 1000 m",
        ),
    ]
    speed_mps: Annotated[
        float, Field(ge=0.0), described("Estimated ground speed", unit="m/s", source="filter")
    ]
    heading_deg: Annotated[
        float,
        Field(ge=0.0, lt=360.0),
        described(
            "Direction of motion over the ground, clockwise from true north",
            unit="degree",
            source="filter",
        ),
    ]
    position_sigma_m: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Square root of the trace of the horizontal position covariance, "
            "including the uncertainty of the biases",
            unit="m",
            source="filter",
        ),
    ]
    state: Annotated[
        TrackState,
        described(
            "tentative (too few measurements so far), confirmed, coasting (no recent "
            "measurement), stale (live only: no sensor delivers measurements)",
            unit="name",
            source="tracker",
        ),
    ]
    sequence: Annotated[
        int,
        Field(ge=1),
        described(
            "Sequence number of the update across all tracks, from 1", unit="1", source="tracker"
        ),
    ]
    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The sensor that made the measurement", unit="text", source="measurement"),
    ]
    velocity_sigma_mps: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Square root of the trace of the horizontal velocity covariance",
            unit="m/s",
            source="filter",
        ),
    ]
    turn_right_probability: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Probability of a right turn, from the modes of the filter `imm`",
            unit="1",
            source="filter",
            absent="filter without modes, or first measurement",
        ),
    ]
    turn_left_probability: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Probability of a left turn",
            unit="1",
            source="filter",
            absent="filter without modes, or first measurement",
        ),
    ]
    speed_change_probability: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Probability of acceleration or deceleration; the remainder is the probability of "
            "straight flight",
            unit="1",
            source="filter",
            absent="filter without modes, or first measurement",
        ),
    ]
    vertical_rate_mps: Annotated[
        float | None,
        described(
            "Rate of climb, negative in a descent",
            unit="m/s",
            source="filter",
            absent="no height received, or not known to within 5 m/s",
        ),
    ]
    height_sigma_m: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of `height_m` relative to its own reference: pressure altitude or "
            "geometric height",
            unit="m",
            source="filter",
            absent="`height_m` is absent",
        ),
    ]
    adsb_implausible: Annotated[
        bool,
        described(
            "Whether the ADS-B positions are implausible: contradicted by other sensors, or not "
            "confirmed by any radar although several radars should detect the aircraft",
            unit="true or false",
            source="tracker",
        ),
    ]
    callsign: Annotated[
        str | None,
        StringConstraints(pattern=r"^[0-9A-Z]([0-9A-Z ]{0,6}[0-9A-Z])?$"),
        described(
            "Last callsign received",
            unit="1 to 8 of A-Z, 0-9 and embedded spaces",
            source="aircraft",
            absent="never received",
        ),
    ]
    measured_mode_s_address: Annotated[
        str | None,
        StringConstraints(pattern=r"^[0-9a-f]{6}$"),
        described(
            "ICAO 24-bit address in this measurement; it never differs from `mode_s_address`, "
            "which a track without an address adopts after two consecutive measurements",
            unit="6 lower-case hexadecimal digits",
            source="measurement",
            absent="not in the measurement",
        ),
    ]
    on_ground: Annotated[
        bool | None,
        described(
            "Whether the aircraft is on the ground, according to reports consistent with speed "
            "and height; if so, `height_m` is the height of the radar site",
            unit="true or false",
            source="tracker",
            absent="never reported",
        ),
    ]


#: `tracks.parquet`: one row for each update of a track.
TRACK_SCHEMA = table_schema(TrackUpdate)


_NO_REGION = "no `[region]` in the settings"


class Track(TrackUpdate):
    """A live track of the service."""

    age_s: Annotated[
        float,
        Field(ge=0.0),
        described("Current data time minus `time_s`", unit="s", source="service"),
    ]
    reception_age_s: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Sum of `age_s` and the time since the last measurement of any sensor",
            unit="s",
            source="service",
            absent="no real-time data",
        ),
    ] = None
    region: Annotated[
        str | None,
        described("The region of this service", unit="name", source="settings", absent=_NO_REGION),
    ] = None
    responsible: Annotated[
        bool | None,
        described(
            "Whether this region is responsible for the aircraft: of all regions that track the "
            "aircraft, only one is", unit="true or false", source="service", absent=_NO_REGION,
        ),
    ] = None  # fmt: skip
    duplicate_of: Annotated[
        str | None,
        described(
            "The track in the neighbouring region that is responsible", unit="REGION/NUMBER",
            source="service", absent=f"this region is responsible, or {_NO_REGION}",
        ),
    ] = None  # fmt: skip
    continues: Annotated[
        str | None,
        described(
            "Region and number of the first track of the aircraft; the same in all regions",
            unit="REGION/NUMBER",
            source="service",
            absent=f"this is the first track of the aircraft, or {_NO_REGION}",
        ),
    ] = None  # fmt: skip
