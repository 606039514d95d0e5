"""Biases by day, their steps from day to day, and their combination over a period."""

from typing import Annotated, Any

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN
from multiradar_schemas.products.bias import ParameterName

_UNIT = "m, degree, 1 or s"
_UNDETERMINED = "not determined by the measurements of the day"
_FEW = "determined by fewer than two days"

Region = Annotated[
    str,
    described(
        "Folder of the region; empty if there are no regions", unit="text", source="reprocess"
    ),
]
SensorId = Annotated[
    str,
    StringConstraints(pattern=SENSOR_ID_PATTERN),
    described("The sensor", unit="text", source="sensors.toml"),
]
Parameter = Annotated[
    ParameterName, described("The bias parameter", unit="name", source="sensors.toml")
]
Day = Annotated[str, described("The day", unit="YYYY-MM-DD", source="name of its folder")]


def _test(description: str, absent: str = "never") -> Any:
    return described(description, unit="1", source="reprocess", absent=absent)


class BiasOfDay(Record):
    """A bias at the end of a day; a row of `biases_by_day.parquet`."""

    region: Region
    day: Day
    sensor_id: SensorId
    parameter: Parameter
    time_s: Annotated[
        float, described("Midpoint of the measurements of the day", unit="s", source="reprocess")
    ]
    estimate: Annotated[
        float, described("Final estimate of the run for the day", unit=_UNIT, source="filter")
    ]
    sigma: Annotated[
        float,
        Field(ge=0.0),
        described("Standard deviation of `estimate`", unit="as `estimate`", source="filter"),
    ]
    own_estimate: Annotated[
        float | None,
        described(
            "Estimate from the measurements of this day alone, without prior or earlier days, "
            "and therefore independent of other days",
            unit="as `estimate`",
            source="reprocess",
            absent=_UNDETERMINED,
        ),
    ]
    own_sigma: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of `own_estimate`",
            unit="as `estimate`",
            source="reprocess",
            absent=_UNDETERMINED,
        ),
    ]


class BiasStep(Record):
    """The change of a bias between consecutive days that determine it; a row of `drift.parquet`."""

    region: Region
    sensor_id: SensorId
    parameter: Parameter
    day_before: Annotated[
        str, described("The earlier day", unit="YYYY-MM-DD", source="name of its folder")
    ]
    day: Annotated[str, described("The later day", unit="YYYY-MM-DD", source="name of its folder")]
    elapsed_days: Annotated[
        float,
        described(
            "Time between the midpoints of the measurements of the two days",
            unit="d",
            source="reprocess",
        ),
    ]
    difference: Annotated[
        float,
        described(
            "`own_estimate` of the later day minus `own_estimate` of the earlier day", unit=_UNIT,
                  source="reprocess"),
    ]  # fmt: skip
    sigma: Annotated[
        float,
        Field(ge=0.0),
        described("Standard deviation of `difference`", unit="as `difference`", source="reprocess"),
    ]
    chi2: Annotated[
        float,
        Field(ge=0.0),
        _test(
            "(`difference` / `sigma`)²; if the bias did not change, χ² distributed with one "
            "degree of freedom"
        ),
    ]
    p_value: Annotated[
        float,
        Field(ge=0.0, le=1.0),
        _test("Probability of a larger `chi2` if the bias did not change"),
    ]


class BiasOfPeriod(Record):
    """A bias over all days; a row of `biases_merged.parquet`."""

    region: Region
    sensor_id: SensorId
    parameter: Parameter
    days: Annotated[
        int,
        Field(ge=0),
        _test(
            "Number of days that determine the bias; the other days also contribute to `estimate`"
        ),
    ]
    estimate: Annotated[
        float,
        described(
            "Estimate of the bias, assumed to be the same on all days, from the prior and the "
            "information of all days with their joint covariance, each used once",
            unit=_UNIT,
            source="reprocess",
        ),
    ]
    sigma: Annotated[
        float,
        Field(ge=0.0),
        described("Standard deviation of `estimate`", unit="as `estimate`", source="reprocess"),
    ]
    chi2: Annotated[
        float | None,
        Field(ge=0.0),
        _test("Scatter of `own_estimate` about its weighted mean, χ²", _FEW),
    ]
    degrees_of_freedom: Annotated[
        int, Field(ge=0), _test("Degrees of freedom of `chi2`: `days` - 1")
    ]
    p_value: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        _test("Probability of a larger `chi2` if the bias is the same on all days", _FEW),
    ]
    drift_per_day: Annotated[
        float | None,
        described(
            "Slope of a line through `own_estimate`", unit=f"{_UNIT} / d", source="reprocess",
            absent=_FEW,
        ),
    ]  # fmt: skip
    drift_sigma_per_day: Annotated[
        float | None,
        Field(ge=0.0),
        described(
            "Standard deviation of the slope, from the standard deviations of the estimates",
            unit="as `drift_per_day`",
            source="reprocess", absent=_FEW,
        ),
    ]  # fmt: skip
    drift_p_value: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        _test("Probability of a steeper slope if the bias is the same on all days", _FEW),
    ]
    line_chi2: Annotated[
        float | None,
        Field(ge=0.0),
        _test("Scatter of `own_estimate` about the line, χ² with `days` - 2 degrees of freedom",
              "determined by fewer than three days"),
    ]  # fmt: skip
    line_p_value: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        _test("Probability of a larger `line_chi2` if the bias drifts linearly",
              "determined by fewer than three days"),
    ]  # fmt: skip


#: `biases_by_day.parquet`: one row for each region, day, sensor and parameter.
BIAS_OF_DAY_SCHEMA = table_schema(BiasOfDay)
#: `drift.parquet`: one row for each bias and pair of consecutive days that determine it.
BIAS_STEP_SCHEMA = table_schema(BiasStep)
#: `biases_merged.parquet`: one row for each region, sensor and parameter.
BIAS_OF_PERIOD_SCHEMA = table_schema(BiasOfPeriod)
