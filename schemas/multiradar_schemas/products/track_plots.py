"""The plots that updated a track, in JSON: what each contributed."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

_INITIATED = "the measurement initiated the track, or has no such component"


class TrackPlot(Record):
    """A measurement that updated a track, its correction, its innovation and its weight."""

    time_s: Annotated[
        float, described("Data time of the measurement", unit="s", source="measurement")
    ]
    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The sensor that made the measurement", unit="text", source="measurement"),
    ]
    kind: Annotated[
        Literal["radar", "position", "bearing"],
        described("Kind of the measurement", unit="name", source="measurement"),
    ]
    range_m: Annotated[
        float | None,
        described(
            "Slant range as measured", unit="m", source="measurement", absent="no range measured"
        ),
    ]
    azimuth_deg: Annotated[
        float | None,
        described(
            "Azimuth as measured", unit="degree", source="measurement", absent="no azimuth measured"
        ),
    ]
    height_m: Annotated[
        float | None,
        described(
            "Measured or reported height",
            unit="m",
            source="measurement",
            absent="no height in the measurement",
        ),
    ]
    range_bias_m: Annotated[
        float | None,
        described(
            "Bias subtracted from the range: sum of the effects of all estimated parameters",
            unit="m",
            source="filter",
            absent="no range measured",
        ),
    ]
    azimuth_bias_deg: Annotated[
        float | None,
        described(
            "Bias subtracted from the azimuth",
            unit="degree",
            source="filter",
            absent="no azimuth measured",
        ),
    ]
    latitude_deg: Annotated[
        float | None,
        described(
            "Bias-corrected WGS 84 latitude",
            unit="degree",
            source="filter",
            absent="a bearing, or a range shorter than the height",
        ),
    ]
    longitude_deg: Annotated[
        float | None,
        described(
            "Bias-corrected WGS 84 longitude",
            unit="degree",
            source="filter",
            absent="a bearing, or a range shorter than the height",
        ),
    ]
    innovation_range_m: Annotated[
        float | None,
        described(
            "Range innovation: bias-corrected measured range minus predicted range",
            unit="m",
            source="filter",
            absent=_INITIATED,
        ),
    ]
    innovation_azimuth_deg: Annotated[
        float | None,
        described("Azimuth innovation", unit="degree", source="filter", absent=_INITIATED),
    ]
    innovation_east_m: Annotated[
        float | None,
        described(
            "East component of the innovation of a reported position",
            unit="m",
            source="filter",
            absent=_INITIATED,
        ),
    ]
    innovation_north_m: Annotated[
        float | None,
        described(
            "North component of the innovation of a reported position",
            unit="m",
            source="filter",
            absent=_INITIATED,
        ),
    ]
    nis: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Normalised innovation squared, computed with the biases published at that time: χ² "
            "distributed with `degrees_of_freedom` if noise and motion agree with the "
            "configuration",
            unit="1",
            source="filter",
            absent="the measurement initiated the track",
        ),
    ]
    degrees_of_freedom: Annotated[
        int, Field(ge=1, le=2), described("1 for a bearing, else 2", unit="1", source="filter")
    ]
    weight: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Influence of the measurement on the estimate: trace of the gain in measurement "
            "space divided by `degrees_of_freedom`; 0: no influence, 1: the track follows the "
            "measurement; a lower bound with the filter `joint`",
            unit="1",
            source="filter",
            absent="the measurement initiated the track",
        ),
    ]
    residual_east_m: Annotated[
        float | None,
        described(
            "East component of the residual: bias-corrected position minus track position after "
            "the update",
            unit="m",
            source="filter",
            absent="`latitude_deg` is absent",
        ),
    ]
    residual_north_m: Annotated[
        float | None,
        described(
            "North component of the residual",
            unit="m",
            source="filter",
            absent="`latitude_deg` is absent",
        ),
    ]


class TrackPlots(Record):
    """The last plots of a track, which explain its position."""

    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    time_s: Annotated[
        float, described("Data time of the last update of the track", unit="s", source="tracker")
    ]
    window_s: Annotated[
        float,
        Field(gt=0.0),
        described("Length of the window of plots before `time_s`", unit="s", source="request"),
    ]
    plots: Annotated[
        list[TrackPlot],
        described("The plots in time order, at most the last 1000", unit="list", source="tracker"),
    ]
