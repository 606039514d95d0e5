"""How a track flew, as JSON and as rows of `trajectories.parquet`."""

from typing import Annotated, Literal

import polars as pl
from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import lists_of, table_schema
from multiradar_schemas.products.track import TrackState

SegmentKind = Literal["straight", "right", "left", "faster", "slower"]

#: Why nothing is told of a live track, one sentence each.
TRAJECTORY_REASON_MEANINGS: dict[str, str] = {
    "TRAJECTORIES_OFF": "the service makes none: `aircraft_max` of the settings is 0.",
    "NOT_CONFIRMED": "the track is tentative; it gets a bundle when it is confirmed.",
    "NO_ROOM": "as many tracks as may have a bundle have one; the track waits.",
    "TOO_FEW_PLOTS": "fewer than three plots of the track have a place.",
    "NO_TRIPLE": "no three plots of the last 90 s are 8 s and 800 m apart and lie on an arc flown "
    "at 20 to 700 m/s.",
    "NO_COVARIANCE": "what its plots leave uncertain of the trajectories cannot be computed.",
    "NO_PLACE": "a trajectory leads out of the system plane.",
    "FAILED": "the making of bundles has stopped by a mistake of the program.",
}

_Heading = Annotated[
    float,
    Field(ge=0.0, lt=360.0),
    described("Course over ground, clockwise from true north", unit="degree", source="restoration"),
]
_Latitude = Annotated[float, described("WGS 84 latitude", unit="degree", source="restoration")]
_Longitude = Annotated[float, described("WGS 84 longitude", unit="degree", source="restoration")]
_Sigma = Annotated[
    float,
    Field(ge=0.0),
    described(
        "Square root of the sum of the variances of the position, east and north",
        unit="m",
        source="restoration",
    ),
]
_Speed = Annotated[
    float, Field(ge=0.0), described("Ground speed", unit="m/s", source="restoration")
]
_Lateral = Annotated[
    float, described("Acceleration to the right", unit="m/s²", source="restoration")
]
_Longitudinal = Annotated[
    float, described("Acceleration forwards", unit="m/s²", source="restoration")
]


def _chance(kind: str) -> object:
    return described(f"Probability that it is now {kind}", unit="1", source="restoration")


class TrajectorySegment(Record):
    """A part of a trajectory with constant accelerations."""

    begin_s: Annotated[
        float, described("Data time of its beginning", unit="s", source="restoration")
    ]
    end_s: Annotated[
        float | None,
        described(
            "Data time of its end; after `time_s` it is expected to end soon",
            unit="s",
            source="restoration",
            absent="the last segment",
        ),
    ]
    kind: Annotated[
        SegmentKind,
        described("straight, right, left, faster or slower", unit="name", source="restoration"),
    ]
    lateral_mps2: _Lateral
    longitudinal_mps2: _Longitudinal


class Trajectory(Record):
    """One version of how the aircraft flew."""

    weight: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described("Its probability beside the others", unit="1", source="restoration"),
    ]
    segments: Annotated[
        list[TrajectorySegment],
        described("Its parts within the window, by ascending time", unit="list",
                  source="restoration"),
    ]  # fmt: skip


class TrajectoryPoint(Record):
    """Where the aircraft was at one time."""

    time_s: Annotated[float, described("Data time, whole seconds", unit="s", source="request")]
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    position_sigma_m: _Sigma
    speed_mps: _Speed
    heading_deg: _Heading


class TrajectoryEstimate(Record):
    """The motion at the last plot: the mean of all trajectories by their weights."""

    time_s: Annotated[
        float, described("Data time of the last plot", unit="s", source="measurement")
    ]
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    position_sigma_m: _Sigma
    speed_mps: _Speed
    heading_deg: _Heading
    velocity_east_mps: Annotated[
        float, described("Velocity, to true east", unit="m/s", source="restoration")
    ]
    velocity_north_mps: Annotated[
        float, described("Velocity, to true north", unit="m/s", source="restoration")
    ]
    covariance: Annotated[
        list[float],
        Field(min_length=16, max_length=16),
        described(
            "Covariance of east, north and the velocity, 4 × 4, row by row: what each trajectory "
            "is not sure of, and what they differ by",
            unit="m, m/s",
            source="restoration",
        ),
    ]
    lateral_mps2: _Lateral
    longitudinal_mps2: _Longitudinal
    straight_probability: Annotated[float, _chance("straight flight")]
    right_probability: Annotated[float, _chance("a turn to the right")]
    left_probability: Annotated[float, _chance("a turn to the left")]
    faster_probability: Annotated[float, _chance("getting faster")]
    slower_probability: Annotated[float, _chance("getting slower")]


class Trajectories(Record):
    """What the bundle of a live track says."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float,
        described(
            "Data time of the last plot that the bundle has taken", unit="s", source="measurement"
        ),
    ]
    window_begin_s: Annotated[
        float,
        described("Data time from which the trajectories tell", unit="s", source="restoration"),
    ]
    plots: Annotated[
        int,
        Field(ge=3),
        described("Plots that the bundle has taken since it began", unit="1", source="restoration"),
    ]
    restarts: Annotated[
        int,
        Field(ge=0),
        described(
            "How often no trajectory could follow the plots, and all began anew",
            unit="1",
            source="restoration",
        ),
    ]
    height_m: Annotated[
        float | None,
        described("Height of the track at the last plot", unit="m", source="tracker",
                  absent="nobody told it"),
    ]  # fmt: skip
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
        described("Data time since the last update of the track", unit="s", source="service"),
    ]
    estimate: Annotated[
        TrajectoryEstimate, described("The motion now", unit="object", source="restoration")
    ]
    trajectories: Annotated[
        list[Trajectory],
        described("The versions, the likeliest first", unit="list", source="restoration"),
    ]
    best: Annotated[
        list[TrajectoryPoint],
        described("Path of the likeliest version", unit="list", source="restoration"),
    ]
    weighted: Annotated[
        list[TrajectoryPoint],
        described("Mean path of all versions by their weights", unit="list", source="restoration"),
    ]


_NESTED = {"state", "age_s", "estimate", "trajectories", "best", "weighted"}
#: `trajectories.parquet`: one row for each epoch and track whose bundle took a plot in it. Where
#: there are no trajectories all but the first two is null, and `reason` says why.
TRAJECTORY_SCHEMA = pl.Schema(
    {
        **table_schema(Trajectories, without=_NESTED),
        **table_schema(TrajectoryEstimate, without={"time_s"}),
        "weights": pl.List(pl.Float64()),
        "segment_trajectory": pl.List(pl.Int64()),
        **lists_of(table_schema(TrajectorySegment, prefix="segment_")),
        "point_time_s": pl.List(pl.Float64()),
        **lists_of(table_schema(TrajectoryPoint, prefix="best_", without={"time_s"})),
        **lists_of(table_schema(TrajectoryPoint, prefix="weighted_", without={"time_s"})),
        "reason": pl.String(),
    }
)
