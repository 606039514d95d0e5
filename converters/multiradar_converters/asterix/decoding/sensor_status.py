"""Sensor status (063) of another SDPS: its bias estimates.

time stamps 070 · range 080 (SSR, Mode S), 090 (PSR) · azimuth 081, 091 · elevation 092 (PSR)
"""

import numpy as np
import polars as pl

from multiradar_converters.asterix.decoding.naming import named
from multiradar_converters.asterix.layout.columns import Columns

#: Names of the figures in the report, with the item and field of each: ms, 1, NM, degree.
FIELDS = {
    "time_stamping_bias_ms": ("070", "VALUE"),
    "ssr_range_gain": ("080", "SRG"),
    "ssr_range_bias_nm": ("080", "SRB"),
    "ssr_azimuth_bias_deg": ("081", "VALUE"),
    "psr_range_gain": ("090", "PRG"),
    "psr_range_bias_nm": ("090", "PRB"),
    "psr_azimuth_bias_deg": ("091", "VALUE"),
    "psr_elevation_bias_deg": ("092", "VALUE"),
}
TIME, SENSOR = "time_s", "sensor_id"


def read_status(columns: Columns) -> pl.DataFrame:
    """Read records of category 063.

    Parameters
    ----------
    columns : Columns
        The records.

    Returns
    -------
    DataFrame
        `time_s` (of day, NaN where absent), `sensor_id` (`SAC-SIC` of item 050, null without one),
        and the figures of `FIELDS`, null where absent.
    """
    area, system = columns.integers("050", "SAC"), columns.integers("050", "SIC")
    both = np.where((area < 0) | (system < 0), -1, area << 8 | system)
    sensor = named(both, lambda one: None if one < 0 else f"{one >> 8}-{one & 255}")
    numbers = {name: columns.numbers(*place) for name, place in FIELDS.items()}
    return pl.DataFrame(
        {
            TIME: columns.numbers("030"),
            SENSOR: sensor,
            **{name: pl.Series(column, nan_to_null=True) for name, column in numbers.items()},
        }
    )


def last_status(status: pl.DataFrame) -> dict[str, dict[str, float]]:
    """Return the last status of each sensor: figures by sensor; absent ones are omitted."""
    last = status.drop_nulls(SENSOR).unique(SENSOR, keep="last", maintain_order=True)
    return {
        str(row[SENSOR]): {
            name: int(row[name]) if name.endswith("_ms") else row[name]
            for name in FIELDS
            if row[name] is not None
        }
        for row in last.to_dicts()
    }
