"""Positions of some aircraft of a converted dump by its own tracks."""

import datetime as dt
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import polars as pl

#: Aircraft that are read: the first of the folder.
AIRCRAFT_MAX = 50
_TRACKS = "_mr.new4"


def track_points(folder: Path, report: Mapping[str, Any]) -> "pl.DataFrame | None":
    """Read track files that `convert vid` wrote.

    Parameters
    ----------
    folder : Path
        The folder that it made.
    report : mapping
        Contents of its `report.json`.

    Returns
    -------
    DataFrame or None
        Columns `time_s`, `track_number`, `latitude_deg`, `longitude_deg`, `height_m` of at most
        `AIRCRAFT_MAX` aircraft; None without any.
    """
    import polars as pl

    from multiradar.report.times import is_dated
    from multiradar_converters.track_text import new4
    from multiradar_converters.vid.text.times import unix_start

    aircraft = sorted(one for one in folder.iterdir() if one.is_dir() and one.name.isdecimal())
    parts = [
        pl.DataFrame(
            new4.read(file),
            schema=dict.fromkeys(
                ("time_s", "latitude_deg", "longitude_deg", "height_m"), pl.Float64
            ),
        ).with_columns(track_number=pl.lit(int(one.name), pl.Int64))
        for one in aircraft[:AIRCRAFT_MAX]
        for file in sorted(one.glob(f"*{_TRACKS}"))
    ]
    if not parts:
        return None
    points = pl.concat(parts).with_columns(pl.col("height_m").fill_nan(None))
    date = report["settings"].get("date")
    if date is not None and not is_dated(float(points["time_s"].max())):  # type: ignore[arg-type]  # numbers
        start_s = unix_start(dt.date.fromisoformat(date))
        points = points.with_columns(pl.col("time_s") + start_s)
    return points
