"""Plots on the right track, where the aircraft of each plot is known."""

from collections.abc import Sequence

import numpy as np
import polars as pl

from multiradar.evaluation.measures.update_times import UPDATE_TIME, with_ids
from multiradar.evaluation.trajectories import Indices, Reference, Tracks
from multiradar_schemas.sensors.sensor import Sensor


def plots_on_the_right_track(
    tracks: Tracks, reference: Reference, aircraft: Indices, plots: pl.DataFrame,
    sensors: Sequence[Sensor] = (),
) -> tuple[int, int]:  # fmt: skip
    """Count the plots whose track is that of their aircraft.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        Its names are those used in the plots.
    aircraft : (n,) int64
        Aircraft of the track at each update; −1 for none.
    plots : DataFrame
        `update_time_s`, `sensor_id` and `name` of plots, by `with_update_times`. Where a sensor has
        several plots at one time, the plot of an update is ambiguous, and they are skipped.
    sensors : sequence of Sensor
        Sensors of the tracks, by whose names updates are joined with plots.

    Returns
    -------
    right, total : int
        Updates by plots of known aircraft on evaluated tracks: those whose track follows the
        plot's aircraft, and all.
    """
    names = {str(name): number for number, name in enumerate(reference.names)}
    key = [UPDATE_TIME, "sensor_id"]
    single = plots.filter(pl.len().over(key) == 1).drop_nulls(["name"])
    measured = np.flatnonzero(tracks.measured & (aircraft >= 0))
    updates = pl.DataFrame(
        {
            UPDATE_TIME: tracks.time_s[measured],
            "sensor_id": tracks.sensor_id[measured],
            "aircraft": aircraft[measured],
        }
    )
    both = with_ids(updates, sensors).join(single.select(*key, "name"), on=key, how="inner")
    of = np.array([names.get(name, -1) for name in both["name"]], np.int64)
    known = of >= 0
    return int(np.sum(both["aircraft"].to_numpy()[known] == of[known])), int(known.sum())


def first_plots(reference: Reference, plots: pl.DataFrame) -> dict[int, float]:
    """Return the time of the first plot of each aircraft.

    Parameters
    ----------
    reference : Reference
        Its names are those used in the plots.
    plots : DataFrame
        `update_time_s` and `name` of plots.

    Returns
    -------
    dict of int to float
        Time by index of the aircraft, for those that have plots.
    """
    names = {str(name): number for number, name in enumerate(reference.names)}
    first = plots.drop_nulls(["name"]).group_by("name").agg(pl.col(UPDATE_TIME).min())
    return {names[name]: time_s for name, time_s in first.iter_rows() if name in names}
