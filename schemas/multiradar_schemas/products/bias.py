"""Bias estimates, with the same fields as `biases.parquet`, and their correlations."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

ParameterName = Literal[
    "range_offset_m",
    "azimuth_offset_deg",
    "range_gain",
    "time_offset_s",
    "azimuth_sine_deg",
    "azimuth_cosine_deg",
    "frame_east_m",
    "frame_north_m",
    "frame_rotation_deg",
]


class BiasValue(Record):
    """A bias parameter of a sensor at the end of an epoch.

    A bias is measured minus true. The unit is the suffix of the parameter (`range_gain` has none).
    """

    time_s: Annotated[
        float, described("Data time of the end of the epoch", unit="s", source="tracker")
    ]
    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The sensor", unit="text", source="sensors.toml"),
    ]
    parameter: Annotated[
        ParameterName, described("The bias parameter", unit="name", source="sensors.toml")
    ]
    estimate: Annotated[
        float,
        described("Estimate, measured minus true", unit="m, degree, 1 or s", source="filter"),
    ]
    sigma: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Standard deviation of the estimate at `time_s`", unit="as `estimate`", source="filter"
        ),
    ]


class BiasEstimate(BiasValue):
    """A bias estimate of the tracker; a row of `biases.parquet`."""

    epoch: Annotated[int, described("Number of the epoch of data time", unit="1", source="tracker")]
    prior_ratio: Annotated[
        float,
        Field(ge=0.0),
        described(
            "`sigma` / prior sigma: about 1 if the measurements alone do not determine the "
            "parameter; above 1 if the parameter drifts",
            unit="1",
            source="filter",
        ),
    ]


#: `biases.parquet`: one row for each sensor, parameter and epoch.
BIAS_SCHEMA = table_schema(BiasEstimate)


class BiasCorrelation(Record):
    """The correlation of the errors of two biases at the end; a row of `bias_correlations.parquet`.

    Together with the last `sigma` of each in `biases.parquet` it is their covariance.
    """

    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The sensor of the first bias", unit="text", source="sensors.toml"),
    ]
    parameter: Annotated[
        ParameterName, described("The first bias parameter", unit="name", source="sensors.toml")
    ]
    other_sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The sensor of the second bias", unit="text", source="sensors.toml"),
    ]
    other_parameter: Annotated[
        ParameterName, described("The second bias parameter", unit="name", source="sensors.toml")
    ]
    correlation: Annotated[
        float,
        Field(ge=-1.0, le=1.0),
        described(
            "Correlation of the errors of the two final estimates",
            unit="1",
            source="filter",
        ),
    ]


#: `bias_correlations.parquet`: one row for each pair of bias parameters.
BIAS_CORRELATION_SCHEMA = table_schema(BiasCorrelation)
