"""The health of a radar, as JSON: the same fields as the columns of `health.parquet`."""

from typing import Annotated

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN

_UNSETTLED = "biases not settled, or too few plots"
_NOT_ESTIMATED = "not estimated, or not for a minute yet"


class RadarHealth(Record):
    """What the tracker saw of a radar by the end of an epoch; a row of `health.parquet`."""

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
            "What is wrong: any of `silent` (no plot for 5 turns, of tracks that it saw before and "
            "others see on), `bias_jump` (an offset jumped within the last 8 turns), `noise` (more "
            "than twice that told) and `site` (its site seems to lie elsewhere), separated by "
            "commas; empty when nothing is",
            unit="names",
            source="tracker",
        ),
    ]
    detection_probability: Annotated[
        float | None,
        Field(ge=0.0, le=1.0),
        described(
            "Updates of confirmed tracks over looks at them, one a turn from one update by this "
            "radar to the next",
            unit="1",
            source="tracker",
            absent="no track was updated twice",
        ),
    ]
    looks: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Looks that it is from; those of 15 minutes ago count for a third",
            unit="1",
            source="tracker",
        ),
    ]
    range_sigma_ratio: Annotated[
        float | None,
        described(
            "Noise of range as measured over `range_sigma_m`; what the filter does not follow of "
            "manoeuvres is in it",
            unit="1",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    azimuth_sigma_ratio: Annotated[
        float | None,
        described(
            "The same of azimuth, over `azimuth_sigma_deg`",
            unit="1",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    range_trend_m_per_h: Annotated[
        float | None,
        described(
            "Change of `range_offset_m` over the last 10 minutes, or since it jumped",
            unit="m/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    range_trend_sigma_m_per_h: Annotated[
        float | None,
        described(
            "How far that differs from zero by chance, 1 sigma",
            unit="m/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    azimuth_trend_deg_per_h: Annotated[
        float | None,
        described(
            "Change of `azimuth_offset_deg`, likewise",
            unit="degree/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    azimuth_trend_sigma_deg_per_h: Annotated[
        float | None,
        described(
            "How far that differs from zero by chance, 1 sigma",
            unit="degree/h",
            source="filter",
            absent=_NOT_ESTIMATED,
        ),
    ]
    site_east_m: Annotated[
        float | None,
        described(
            "By how much its site seems to lie farther to the east than told: less than in truth, "
            "since tracks follow",
            unit="m",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    site_north_m: Annotated[
        float | None,
        described("Farther to the north", unit="m", source="filter", absent=_UNSETTLED),
    ]
    site_sigma_m: Annotated[
        float | None,
        described(
            "Standard deviation of both, on the worse axis",
            unit="m",
            source="filter",
            absent=_UNSETTLED,
        ),
    ]
    silence_s: Annotated[
        float | None,
        described(
            "Data time since its last plot, whatever became of it",
            unit="s",
            source="tracker",
            absent="never heard",
        ),
    ]
    tracks_in_cover: Annotated[
        int,
        described(
            "Confirmed tracks within its range, above its horizon, outside its cone of silence",
            unit="1",
            source="tracker",
        ),
    ]
    tracks_heard: Annotated[
        int,
        described("Those of them that it updated within 5 turns", unit="1", source="tracker"),
    ]
    bias_jumps: Annotated[
        int, described("How often a bias of it jumped so far", unit="1", source="tracker")
    ]
    last_jump_s: Annotated[
        float | None,
        described(
            "Data time at which the last jump was noticed",
            unit="s",
            source="tracker",
            absent="none",
        ),
    ]
    epoch: Annotated[int, described("Number of the epoch of data time", unit="1", source="tracker")]


#: `health.parquet`: one row for each radar and epoch.
HEALTH_SCHEMA = table_schema(RadarHealth)
