"""Innovations of the plots of radars by range and azimuth, in JSON."""

from typing import Annotated

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.measurements.measurement import SENSOR_ID_PATTERN


class ResidualBin(Record):
    """Innovations of the plots of a radar in one interval of range, or of azimuth."""

    begin: Annotated[
        float, described("Start of the interval", unit="m or degree", source="service")
    ]
    end: Annotated[float, described("End of the interval", unit="m or degree", source="service")]
    plots: Annotated[int, Field(ge=1), described("Number of plots", unit="1", source="service")]
    range_mean_m: Annotated[float, described("Mean range innovation", unit="m", source="filter")]
    range_rms_m: Annotated[
        float,
        Field(ge=0.0),
        described("Root mean square of the range innovation", unit="m", source="filter"),
    ]
    azimuth_mean_deg: Annotated[
        float, described("Mean azimuth innovation", unit="degree", source="filter")
    ]
    azimuth_rms_deg: Annotated[
        float,
        Field(ge=0.0),
        described("Root mean square of the azimuth innovation", unit="degree", source="filter"),
    ]
    nis_mean: Annotated[
        float,
        Field(ge=0.0),
        described(
            "Mean normalised innovation squared: 2 if the noise agrees with the configuration and "
            "the biases with their estimates",
            unit="1",
            source="filter",
        ),
    ]


class RadarResiduals(Record):
    """Innovations of one radar."""

    sensor_id: Annotated[
        str,
        StringConstraints(pattern=SENSOR_ID_PATTERN),
        described("The radar", unit="text", source="sensors.toml"),
    ]
    plots: Annotated[int, Field(ge=1), described("Number of plots", unit="1", source="service")]
    by_range: Annotated[
        list[ResidualBin],
        described(
            "Intervals of 25 km of slant range that contain plots", unit="list", source="service"
        ),
    ]
    by_azimuth: Annotated[
        list[ResidualBin],
        described(
            "Intervals of 30 degrees of azimuth that contain plots", unit="list", source="service"
        ),
    ]


class Residuals(Record):
    """Innovations of all radars in a window of time."""

    time_s: Annotated[
        float | None,
        described("Data time", unit="s", source="service", absent="no measurement yet"),
    ]
    window_s: Annotated[
        float,
        Field(gt=0.0),
        described("Length of the window before `time_s`", unit="s", source="request"),
    ]
    sensors: Annotated[
        list[RadarResiduals],
        described(
            "The radars with plots in the window, among the last 50 000 plots of all sensors",
            unit="list",
            source="service",
        ),
    ]
