"""Plots of a run: a map of its tracks, and its biases over time."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import polars as pl

from multiradar import wire
from multiradar.evaluation.card.plots import bias_plot
from multiradar.evaluation.measures.bias_errors import bias_histories
from multiradar.report.times import axis_label
from multiradar.toolbox.pages.track_page import confirmed_tracks, tracks_map

if TYPE_CHECKING:
    from multiradar.report.content import Plot
    from multiradar_schemas.sensors.sensor import SensorsFile


def run_plots(tracks: pl.DataFrame, biases: pl.DataFrame, sensors: "SensorsFile") -> "list[Plot]":
    """Return the plots of a run.

    Parameters
    ----------
    tracks : DataFrame
        Rows of `tracks.parquet`.
    biases : DataFrame
        Rows of `biases.parquet`.
    sensors : SensorsFile
        The sensors of the run.

    Returns
    -------
    list of Plot
        The map of confirmed tracks, and each bias that the measurements determine.
    """
    confirmed = confirmed_tracks(tracks)
    if not confirmed.height:
        return []
    return [tracks_map(wire.sensor_table(sensors), confirmed), *_biases(biases)]


def _biases(biases: pl.DataFrame) -> "Iterator[Plot]":
    for one in bias_histories(biases, "biases", None, ""):
        if len(one.time_s) > 1:
            yield bias_plot(one, axis_label(one.time_s[[0, -1]].tolist()))
