"""`system_tracks.parquet`: system tracks of another SDPS, by time."""

from pathlib import Path

import numpy as np
import polars as pl

from multiradar_converters.aircraft_data.quantities import QUANTITIES
from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.gathering import Rows
from multiradar_converters.asterix.decoding.naming import named
from multiradar_converters.asterix.decoding.system_tracks import SCHEMA


def frame(parts: list[tuple[Rows, pl.DataFrame]], start_s: float) -> pl.DataFrame:
    """Return the table of the system tracks of a file.

    Parameters
    ----------
    parts : list of (Rows, DataFrame)
        Location of the records, and the result of `read_system_tracks` with `FileDays.tracks_s`.
    start_s : float
        Added to times, s.

    Returns
    -------
    DataFrame
        Columns of `SCHEMA`, in file order; records without a time are omitted.
    """
    if not parts:
        return pl.DataFrame(schema=SCHEMA)
    order = np.argsort(np.concatenate([rows.order for rows, _ in parts]), kind="stable")
    source = np.concatenate([rows.source for rows, _ in parts])[order]
    table = pl.concat([part for _, part in parts])[order.tolist()]
    ids: pl.Series = named(source, source_name)
    made: pl.DataFrame = table.with_columns(pl.col("time_s") + start_s, ids.alias("sensor_id"))
    return made.drop_nulls("time_s").select(SCHEMA.names())


def write(path: Path, frames: list[pl.DataFrame]) -> pl.DataFrame:
    """Write and return the table by time without duplicates. No file without rows.

    Accuracy, ground status and columns of aircraft-derived data are omitted where they are empty.
    """
    whole = pl.concat([pl.DataFrame(schema=SCHEMA), *frames])
    whole = whole.unique(maintain_order=True).sort("time_s", maintain_order=True)
    optional = ("position_sigma_m", "on_ground", *QUANTITIES)
    empty = [name for name in optional if whole[name].null_count() == whole.height]
    if whole.height:
        whole.drop(empty).write_parquet(path, compression="snappy", statistics=True)
    return whole
