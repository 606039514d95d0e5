"""Times and sensors of the updates by plots.

The tracker subtracts known time offsets first, and gives all names of a sensor its identifier.
"""

from collections.abc import Sequence

import polars as pl

from multiradar_schemas.sensors.sensor import Sensor

#: Column of the time of the update of a plot.
UPDATE_TIME = "update_time_s"


def with_ids(rows: pl.DataFrame, sensors: Sequence[Sensor]) -> pl.DataFrame:
    """Replace other names of sensors by their identifiers, as in the tracks.

    Parameters
    ----------
    rows : DataFrame
        With ``sensor_id``.
    sensors : sequence of Sensor
        Sensors of the tracks; other names remain.
    """
    ids = {name: one.id for one in sensors for name in one.all_names() if name != one.id}
    return rows.with_columns(pl.col("sensor_id").replace(ids)) if ids else rows


def with_update_times(plots: pl.DataFrame, sensors: Sequence[Sensor]) -> pl.DataFrame:
    """Add the time that the update of each plot has in the tracks, and name its sensor as there.

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
        number as in the tracks; ``sensor_id`` by `with_ids`.
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
    return with_ids(plots.with_columns(time_s.alias(UPDATE_TIME)), sensors)
