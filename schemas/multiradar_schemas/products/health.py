"""The health of a radar in JSON, with the same fields as `health.parquet`."""

from typing import Annotated

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

_UNSETTLED = "biases not converged, or too few plots"
_NOT_ESTIMATED = "not estimated, or estimated for less than a minute"


class RadarHealth(Record):
    """Health of a radar at the end of an epoch; a row of `health.parquet`."""

    time_s: Annotated[
        float, described("Data time of the end of the epoch", unit="s", source="tracker")
    ]
    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The radar", unit="text", source="sensors.toml"),
    ]
    alarms: Annotated[
        str,
        described(
            "Active alarms, separated by commas: `silent` (for 5 scans, no plot of the tracks "
            "that the radar detected before and that other radars still detect), `bias_jump` (an "
            "offset jumped within the last 8 scans), `noise` (more than twice, or less than a "
            "quarter of, the configured value), `site` (wrong site position) and `address` (a plot "
            "updated a track with another Mode S address: a bug); empty if no alarm is active",
            unit="names",
            source="tracker",
        ),
    ]
    detection_probability: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Probability of detection: ratio of updates of confirmed tracks to scans, counted "
            "from one update by this radar to the next",
            unit="1",
            source="tracker",
            absent="no track was updated twice",
        ),
    ]
    looks: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Number of scans (detection opportunities) on which `detection_probability` is "
            "based, with weights that decrease to one third in 15 minutes",
            unit="1",
            source="tracker",
        ),
    ]
    range_sigma_ratio: Annotated[
        float | None,
        described(
            "Measured range noise / `range_sigma_m`; includes filter lag in manoeuvres",
            unit="1",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    azimuth_sigma_ratio: Annotated[
        float | None,
        described(
            "Measured azimuth noise / `azimuth_sigma_deg`",
            unit="1",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    range_trend_m_per_h: Annotated[
        float | None,
        described(
            "Trend of `range_offset_m` over the last 10 minutes, or since the last bias jump",
            unit="m/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    range_trend_sigma_m_per_h: Annotated[
        float | None,
        described(
            "Standard deviation of the trend",
            unit="m/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    azimuth_trend_deg_per_h: Annotated[
        float | None,
        described(
            "Trend of `azimuth_offset_deg` over the same period",
            unit="degree/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    azimuth_trend_sigma_deg_per_h: Annotated[
        float | None,
        described(
            "Standard deviation of the trend",
            unit="degree/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    site_east_m: Annotated[
        float | None,
        described(
            "Estimated east error of the configured site position (biased low, because tracks "
            "absorb part of it)",
            unit="m",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    site_north_m: Annotated[
        float | None,
        described(
            "Estimated north error of the configured site position (also biased low)",
            unit="m",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    site_sigma_m: Annotated[
        float | None,
        described(
            "Standard deviation of the estimated site error along the major axis of its error "
            "ellipse",
            unit="m",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    silence_s: Annotated[
        float | None,
        described(
            "Data time since the last plot of the radar, accepted or not",
            unit="s",
            source="tracker",
            absent="no plot yet",
        ),
    ]
    tracks_in_cover: Annotated[
        int,
        described(
            "Number of confirmed tracks within the range of the radar, above its horizon and "
            "outside its cone of silence",
            unit="1",
            source="tracker",
        ),
    ]
    tracks_heard: Annotated[
        int,
        described(
            "Number of these tracks that the radar updated within 5 scans",
            unit="1",
            source="tracker",
        ),
    ]
    bias_jumps: Annotated[int, described("Number of bias jumps so far", unit="1", source="tracker")]
    last_jump_s: Annotated[
        float | None,
        described(
            "Data time of the detection of the last jump",
            unit="s",
            source="tracker",
            absent="no jump",
        ),
    ]
    epoch: Annotated[int, described("Number of the epoch of data time", unit="1", source="tracker")]


#: `health.parquet`: one row for each radar and epoch.
HEALTH_SCHEMA = table_schema(RadarHealth)
