"""Delays of transponders, as rows of `aircraft_delays.parquet`."""

from typing import Annotated

from pydantic import Field, StringConstraints

from multiradar_schemas.base import Record, described
from multiradar_schemas.columns import table_schema


class AircraftDelay(Record):
    """The delay of the transponder of a confirmed track; a row of `aircraft_delays.parquet`."""

    time_s: Annotated[
        float, described("Data time of the last update of the track", unit="s", source="tracker")
    ]
    track_id: Annotated[int, Field(ge=1), described("The track", unit="1", source="tracker")]
    track_number: Annotated[
        int | None,
        Field(ge=0),
        described(
            "Number of the aircraft in a dump",
            unit="1",
            source="measurements",
            absent="never reported",
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
    delay_m: Annotated[
        float,
        described(
            "One-way range error caused by the turn-around time of the transponder, measured minus "
            "true (150 m for 1 µs)",
            unit="m",
            source="filter",
        ),
    ]
    sigma_m: Annotated[
        float,
        Field(ge=0.0),
        described("Standard deviation of the delay", unit="m", source="filter"),
    ]
    prior_ratio: Annotated[
        float,
        Field(ge=0.0),
        described(
            "`sigma_m` / `transponder_delay_sigma_m`: about 1 if the measurements do not determine "
            "the delay",
            unit="1",
            source="filter",
        ),
    ]


#: `aircraft_delays.parquet`: one row for each confirmed track.
AIRCRAFT_DELAY_SCHEMA = table_schema(AircraftDelay)
