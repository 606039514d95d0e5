"""The plots of a track with innovations and weights, and the innovations of radars."""

from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.queries.registry import PLOTS, RESIDUALS
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_schemas.products.residuals import Residuals
from multiradar_schemas.products.track_plots import TrackPlots
from support.scenarios import bearing_scene

TABLE = bearing_scene.sensors()


def view_of(frame: pl.DataFrame, filter_name: str = "imm") -> LiveView:
    """Return the read side after all measurements."""
    settings = TrackingSettings(filter_name=filter_name)
    engine, publication = Engine(TABLE, settings), Publication(TABLE, settings, RuntimeLimits())
    batch, _ = measurement_batch(frame, TABLE)
    for output in (engine.push(batch), engine.flush()):
        publication.publish(output, float(batch.time_s.max()))
    return publication.view


def plots_of(view: LiveView, track: int = 1) -> list[dict[str, Any]]:
    answer = view.ask(PLOTS, track, window_s=600.0)
    assert answer is not None
    TrackPlots.model_validate(answer)
    return list(answer["plots"])


def column(plots: list[dict[str, Any]], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([np.nan if one[name] is None else one[name] for one in plots])


@pytest.mark.parametrize("filter_name", ["two-stage", "imm", "joint", "blom"])
def test_innovations_are_normalised_and_plots_have_weights(filter_name: str) -> None:
    frame = bearing_scene.make(seconds=150.0, jammed_s=100.0).frame
    if filter_name in ("joint", "blom"):
        frame = frame.filter(pl.col("kind") == "radar")
    plots = plots_of(view_of(frame, filter_name))
    assert plots[0]["nis"] is None
    assert plots[0]["weight"] is None
    late = plots[len(plots) // 3 :]
    assert 0.4 < column(late, "nis").mean() / column(late, "degrees_of_freedom").mean() < 1.6
    weights = column(late, "weight")
    # That of `joint` is a lower bound.
    assert (weights >= 0.0).all()
    assert (weights > 0.0).any()
    assert filter_name == "joint" or (weights > 0.0).all()
    assert (weights < 1.0).all()
    for one in late:
        radar = one["kind"] == "radar"
        assert (one["innovation_range_m"] is not None) == radar
        assert (one["latitude_deg"] is not None) == radar
        assert one["innovation_azimuth_deg"] is not None
        assert one["degrees_of_freedom"] == (2 if radar else 1)


def test_the_removed_bias_is_that_of_the_sensor() -> None:
    view = view_of(bearing_scene.make(seconds=150.0).frame)
    plots = [one for one in plots_of(view) if one["kind"] == "radar"]
    biases = {
        (bias["sensor_id"], bias["parameter"]): bias["estimate"]
        for sensor in view.sensors()
        for bias in sensor["biases"]
    }
    for one in plots:
        expected = biases[one["sensor_id"], "azimuth_offset_deg"]
        assert one["azimuth_bias_deg"] == pytest.approx(expected, abs=1e-3)
    # Without biases the plots lie around the track.
    east = column(plots, "residual_east_m")
    assert abs(np.nanmean(east)) < 3.0 * np.nanstd(east) / np.sqrt(len(east)) + 50.0


def test_an_outlier_has_a_large_innovation_and_little_weight() -> None:
    frame = bearing_scene.make(seconds=150.0).frame.sort("time_s")
    of_one = (pl.col("track_number") == frame["track_number"][0]) & (pl.col("kind") == "radar")
    last_s = frame.filter(of_one)["time_s"].max()
    wrong = of_one & (pl.col("time_s") == last_s)
    moved = frame.with_columns(
        range_m=pl.when(wrong).then(pl.col("range_m") + 400.0).otherwise(pl.col("range_m"))
    )
    usual, outlier = (
        next(one for one in reversed(plots_of(view_of(one))) if one["kind"] == "radar")
        for one in (frame, moved)
    )
    assert usual["time_s"] == outlier["time_s"]
    assert outlier["innovation_range_m"] == pytest.approx(
        usual["innovation_range_m"] + 400.0, abs=1.0
    )
    assert outlier["nis"] > usual["nis"] + 10.0
    assert outlier["weight"] < usual["weight"]


def test_innovations_by_range_and_azimuth_count_every_plot_once() -> None:
    view = view_of(bearing_scene.make(seconds=150.0).frame)
    answer = view.ask(RESIDUALS)
    assert answer is not None
    Residuals.model_validate(answer)
    assert {one["sensor_id"] for one in answer["sensors"]} == {
        name for name in TABLE.ids if not name.startswith("df-")
    }
    for one in answer["sensors"]:
        for intervals in (one["by_range"], one["by_azimuth"]):
            assert sum(interval["plots"] for interval in intervals) == one["plots"]
            for interval in intervals:
                assert interval["begin"] < interval["end"]
                assert abs(interval["range_mean_m"]) <= interval["range_rms_m"]
    assert view.ask(RESIDUALS, window_s=5.0) != answer


def test_an_empty_sky_has_no_innovations() -> None:
    view = Publication(TABLE, TrackingSettings(), RuntimeLimits()).view
    assert view.ask(RESIDUALS) == {"time_s": None, "window_s": 600.0, "sensors": []}
    assert view.ask(PLOTS, 1) is None
