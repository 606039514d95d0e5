"""Reconstructed trajectories, in JSON and as rows of `trajectories.parquet`."""

from typing import Annotated, Literal

import polars as pl
from pydantic import Field

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import lists_of, table_schema
from multiradar_schemas.products.track import TrackState

SegmentKind = Literal["straight", "right", "left", "faster", "slower"]

#: Reasons for the absence of trajectories of a live track.
TRAJECTORY_REASON_MEANINGS: dict[str, str] = {
    "TRAJECTORIES_OFF": "trajectory reconstruction is disabled: the setting `aircraft_max` is 0.",
    "NOT_CONFIRMED": "the track is tentative; reconstruction starts when it is confirmed.",
    "NO_ROOM": "the maximum number of concurrent reconstructions is reached; the track is queued.",
    "TOO_FEW_PLOTS": "fewer than three plots of the track have a position.",
    "NO_TRIPLE": "no three plots of the last 90 s are 8 s and 800 m apart and lie on an arc flown "
    "at 20 to 700 m/s.",
    "NO_COVARIANCE": "the covariance of the trajectories cannot be computed from the plots.",
    "NO_PLACE": "a trajectory leaves the system plane.",
    "FAILED": "trajectory reconstruction has stopped because of an internal error; see the log.",
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
        "Square root of the sum of the position variances, east and north",
        unit="m",
        source="restoration",
    ),
]
_Speed = Annotated[
    float, Field(ge=0.0), described("Ground speed", unit="m/s", source="restoration")
]
_Lateral = Annotated[
    float,
    described("Lateral acceleration, positive to the right", unit="m/s²", source="restoration"),
]
_Longitudinal = Annotated[
    float,
    described(
        "Longitudinal acceleration, positive when speed increases",
        unit="m/s²",
        source="restoration",
    ),
]


def _chance(kind: str) -> object:
    return described(f"Current probability of {kind}", unit="1", source="restoration")


class TrajectorySegment(Record):
    """A part of a trajectory with constant accelerations."""

    begin_s: Annotated[
        float, described("Data time at which the segment starts", unit="s", source="restoration")
    ]
    end_s: Annotated[
        float | None,
        described(
            "Data time at which the segment ends; a value later than `time_s` is predicted",
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
    """A trajectory hypothesis."""

    weight: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        described("Probability relative to the other hypotheses", unit="1", source="restoration"),
    ]
    segments: Annotated[
        list[TrajectorySegment],
        described("Segments within the window, in time order", unit="list",
                  source="restoration"),
    ]  # fmt: skip


class TrajectoryPoint(Record):
    """The position of the aircraft at one time."""

    time_s: Annotated[float, described("Data time in whole seconds", unit="s", source="request")]
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    position_sigma_m: _Sigma
    speed_mps: _Speed
    heading_deg: _Heading


class TrajectoryEstimate(Record):
    """The motion at the last plot: the weighted mean of all trajectories."""

    time_s: Annotated[
        float, described("Data time of the last plot", unit="s", source="measurement")
    ]
    latitude_deg: _Latitude
    longitude_deg: _Longitude
    position_sigma_m: _Sigma
    speed_mps: _Speed
    heading_deg: _Heading
    velocity_east_mps: Annotated[
        float, described("Velocity component towards true east", unit="m/s", source="restoration")
    ]
    velocity_north_mps: Annotated[
        float, described("Velocity component towards true north", unit="m/s", source="restoration")
    ]
    covariance: Annotated[
        list[float],
        Field(min_length=16, max_length=16),
        described(
            "Covariance matrix of east and north position and velocity, 4 × 4, row by row: "
            "covariance within the trajectories and spread between them",
            unit="m, m/s",
            source="restoration",
        ),
    ]
    lateral_mps2: _Lateral
    longitudinal_mps2: _Longitudinal
    straight_probability: Annotated[float, _chance("straight flight")]
    right_probability: Annotated[float, _chance("a right turn")]
    left_probability: Annotated[float, _chance("a left turn")]
    faster_probability: Annotated[float, _chance("acceleration")]
    slower_probability: Annotated[float, _chance("deceleration")]


class Trajectories(Record):
    """The bundle (multiple-hypothesis trajectory set) of a live track."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float,
        described(
            "Data time of the last plot processed by the bundle", unit="s", source="measurement"
        ),
    ]
    window_begin_s: Annotated[
        float,
        described("Data time at which the trajectories start", unit="s", source="restoration"),
    ]
    plots: Annotated[
        int,
        Field(ge=3),
        described(
            "Number of plots processed by the bundle since its initiation",
            unit="1",
            source="restoration",
        ),
    ]
    restarts: Annotated[
        int,
        Field(ge=0),
        described(
            "Number of reinitialisations because no trajectory could follow the plots",
            unit="1",
            source="restoration",
        ),
    ]
    height_m: Annotated[
        float | None,
        described("Height of the track at the last plot", unit="m", source="tracker",
                  absent="not known"),
    ]  # fmt: skip
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
        described("Data time since the last update of the track", unit="s", source="service"),
    ]
    estimate: Annotated[
        TrajectoryEstimate, described("The current motion", unit="object", source="restoration")
    ]
    trajectories: Annotated[
        list[Trajectory],
        described(
            "The trajectory hypotheses, most likely first", unit="list", source="restoration"
        ),
    ]
    best: Annotated[
        list[TrajectoryPoint],
        described("Path of the most likely hypothesis", unit="list", source="restoration"),
    ]
    weighted: Annotated[
        list[TrajectoryPoint],
        described("Weighted mean path of all hypotheses", unit="list", source="restoration"),
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
