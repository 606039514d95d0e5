"""Times of the updates by plots: the tracker subtracts known time offsets first."""

from collections.abc import Sequence

import polars as pl

from multiradar_schemas.sensors.sensor import Sensor

#: Column of the time of the update of a plot.
UPDATE_TIME = "update_time_s"


def with_update_times(plots: pl.DataFrame, sensors: Sequence[Sensor]) -> pl.DataFrame:
    """Add the time that the update of each plot has in the tracks.

    Parameters
    ----------
    plots : DataFrame
        With ``time_s``, as stamped, s, and ``sensor_id``.
    sensors : sequence of Sensor
        Sensors of the tracks; those of an unknown sensor have no known offset.

    Returns
    -------
    DataFrame
        With the column `UPDATE_TIME`, s: the stamped time minus the known time offset, the same
        number as in the tracks.
    """
    late_s = {
        name: offset_s
        for one in sensors
        if (offset_s := one.known_biases().get("time_offset_s"))
        for name in one.all_names()
    }
    time_s = pl.col("time_s")
    if late_s:
        offset = pl.col("sensor_id").replace_strict(late_s, default=0.0, return_dtype=pl.Float64)
        time_s = time_s - offset
    return plots.with_columns(time_s.alias(UPDATE_TIME))
