"""The message in which the services of neighbouring regions hand over tracks and biases."""

from typing import Annotated

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.measurements.measurement import MODE_3A_PATTERN, TIME_MAX_S
from multiradar_schemas.products.bias import BiasValue
from multiradar_schemas.products.track import TrackState

#: Bounds of a message: tracks, biases, and octets.
TRACKS_MAX, BIASES_MAX, OCTETS_MAX = 5000, 2000, 4 * 1024 * 1024
#: A name of a region, and the number of a track there.
REGION_PATTERN = r"^[A-Za-z0-9_-]{1,16}$"
REFERENCE_PATTERN = r"^[A-Za-z0-9_-]{1,16}/[1-9][0-9]{0,17}$"

#: The same as types.
RegionName = Annotated[str, StringConstraints(pattern=REGION_PATTERN)]
Reference = Annotated[str, StringConstraints(pattern=REFERENCE_PATTERN)]

_Latitude = Annotated[
    float,
    Field(ge=-90.0, le=90.0),
    described("WGS 84 latitude", unit="degree", source="filter"),
]
_Longitude = Annotated[
    float,
    Field(ge=-180.0, le=180.0),
    described("WGS 84 longitude", unit="degree", source="filter"),
]
_Time = Field(gt=-TIME_MAX_S, lt=TIME_MAX_S)
_Velocity = Field(ge=-10_000.0, le=10_000.0)
_Probability = Annotated[
    float | None,
    Field(ge=0.0, le=1.0),
    described(
        "Probability of this manoeuvre, from the filter modes", unit="1", source="filter",
        absent="filter without modes",
    ),
]  # fmt: skip


class HandoverTrack(Record):
    """A track near the boundary of a region."""

    track_id: Annotated[
        int,
        Field(ge=1, lt=10**18),
        described("Track number in the region", unit="1", source="tracker"),
    ]
    time_s: Annotated[
        float, _Time, described("Data time of the state", unit="s", source="measurement")
    ]
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    velocity_east_mps: Annotated[
        float,
        _Velocity,
        described("Velocity towards true east at the aircraft", unit="m/s", source="filter"),
    ]
    velocity_north_mps: Annotated[
        float,
        _Velocity,
        described("Velocity towards true north", unit="m/s", source="filter"),
    ]
    covariance: Annotated[
        tuple[float, ...],
        Field(min_length=10, max_length=10),
        described(
            "Covariance of position and velocity, east and north (true): upper triangle of the "
            "4 × 4 matrix, row by row",
            unit="m², m²/s and m²/s²",
            source="filter",
        ),
    ]
    height_m: Annotated[
        float | None,
        Field(ge=-2000.0, le=100_000.0),
        described("Height as in `tracks`", unit="m", source="filter", absent="not known"),
    ]
    height_sigma_m: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of `height_m`", unit="m", source="filter", absent="not known"
        ),
    ]
    mode_s_address: Annotated[
        str | None,
        StringConstraints(pattern=r"^[0-9a-f]{6}$"),
        described("ICAO 24-bit address", unit="6 lower-case hexadecimal digits", source="aircraft",
                  absent="never received"),
    ]  # fmt: skip
    mode_3a: Annotated[
        str | None,
        StringConstraints(pattern=MODE_3A_PATTERN),
        described("Last Mode 3/A code", unit="4 octal digits", source="aircraft",
                  absent="never received"),
    ]  # fmt: skip
    callsign: Annotated[
        str | None,
        StringConstraints(max_length=8),
        described("Last callsign", unit="text", source="aircraft", absent="never received"),
    ]
    turn_right_probability: _Probability
    turn_left_probability: _Probability
    speed_change_probability: _Probability
    state: Annotated[TrackState, described("As in `tracks`", unit="name", source="tracker")]
    responsible: Annotated[
        bool,
        described("Whether the region is responsible for the aircraft", unit="true or false",
                  source="service"),
    ]  # fmt: skip
    since_s: Annotated[
        float,
        _Time,
        described(
            "Data time at which the region last became responsible",
            unit="s",
            source="service",
        ),
    ]
    aircraft: Annotated[
        Reference,
        described("Identifier of the aircraft in all regions: region and number of its first track",
                  unit="REGION/NUMBER", source="service"),
    ]  # fmt: skip


class Handover(Record):
    """All that a region hands over to its neighbours at one time; it replaces the message before.

    Parameters are the fields; see `docs/howto/regions.md`.
    """

    region: Annotated[RegionName, described("The region", unit="name", source="settings")]
    latitude_deg: Annotated[
        float,
        Field(ge=-90.0, le=90.0),
        described("WGS 84 latitude of the centre of the region", unit="degree", source="settings"),
    ]
    longitude_deg: Annotated[
        float,
        Field(ge=-180.0, le=180.0),
        described("WGS 84 longitude of the centre of the region", unit="degree", source="settings"),
    ]
    time_s: Annotated[
        float,
        Field(ge=0.0, le=1e11),
        described(
            "Time up to which the region has processed measurements", unit="s", source="service"
        ),
    ]
    heard: Annotated[
        tuple[RegionName, ...],
        Field(max_length=64),
        described(
            "Neighbours from which the region has recent messages", unit="name", source="service"
        ),
    ]
    tracks: Annotated[
        tuple[HandoverTrack, ...],
        Field(max_length=TRACKS_MAX),
        described("Tracks near or beyond the boundary", unit="record", source="service"),
    ]
    biases: Annotated[
        tuple[BiasValue, ...],
        Field(max_length=BIASES_MAX),
        described("Biases of the sensors of the region", unit="record", source="service"),
    ] = ()
