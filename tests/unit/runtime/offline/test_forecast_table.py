"""Forecasts in the table equal those of a service for the same measurements."""

from functools import cache

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ForecastError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.offline.forecast_table import ForecastTable
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.forecast import FORECAST_SCHEMA, ForecastRow
from support.scenarios.asked import forecast
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

pytestmark = pytest.mark.slow

DURATION_S = 300.0
#: All samples are at ends of epochs; the last complete epoch ends here.
END_S = 296.0


@cache
def _scene() -> Scene:
    rng = np.random.Generator(np.random.PCG64(11))
    flights = random_flights(rng, 12, DURATION_S, extent_m=80e3, acceleration_density=1.0)
    return make_scene(rng, three_radars(), flights)


# One batch, forecasts every 8 s.
@cache
def _whole(filter_name: str) -> pl.DataFrame:
    return _table(_scene(), TrackingSettings(filter_name=filter_name), 10**6, 8.0)


def _table(scene: Scene, settings: TrackingSettings, rows: int, every_s: float) -> pl.DataFrame:
    engine = Engine(scene.sensors, settings, sampling=Sampling.ALL)
    table = ForecastTable(scene.sensors, settings, engine.plane, every_s)
    cuts = range(0, len(scene.batch), rows)
    outputs = [engine.push(scene.batch.select(slice(cut, cut + rows))) for cut in cuts]
    frames = [table.update(output) for output in (*outputs, engine.flush())]
    return pl.concat([*frames, table.finish()])


# Other filters differ from the first in numbers, not in what the table reads.
@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_the_table_does_not_depend_on_batches(filter_name: str) -> None:
    scene, settings = _scene(), TrackingSettings(filter_name=filter_name)
    whole = _whole(filter_name)
    assert whole.equals(_table(scene, settings, 61, 8.0))
    assert whole.schema == FORECAST_SCHEMA
    assert set(whole["horizon_s"]) == set(HORIZONS_S.tolist())
    for row in whole.sample(20, seed=1).to_dicts():
        ForecastRow.model_validate(row)
    assert whole["calibrated"].any()
    assert not whole["calibrated"].all()
    apart_s = whole.filter(horizon_s=10.0).group_by("track_id").agg(pl.col("made_s").diff().min())
    # A track is forecast once in a sample, at its last update: a scan of 4 s earlier or later.
    assert apart_s["made_s"].min() > 4.0  # type: ignore[operator]


def test_forecasts_have_the_requested_interval() -> None:
    scene, settings = _scene(), TrackingSettings()
    often, rare = _whole(settings.filter_name), _table(scene, settings, 500, 60.0)
    assert len(often) > 5 * len(rare) > 0
    # The calibration is the same for any number of forecasts written.
    keys = ["track_id", "made_s", "horizon_s"]
    assert rare.join(often, on=keys).height == rare.height
    assert rare.equals(often.join(rare.select(keys), on=keys, how="semi"))


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_a_service_gives_the_numbers_of_the_table(filter_name: str) -> None:
    scene, settings = _scene(), TrackingSettings(filter_name=filter_name, reorder_horizon_s=0.0)
    last = int(np.searchsorted(scene.batch.time_s, END_S))
    batch = scene.batch.select(slice(0, last))
    table = ForecastTable(
        scene.sensors,
        settings,
        (engine := Engine(scene.sensors, settings, sampling=Sampling.ALL)).plane,
        8.0,
    )
    rows = pl.concat([table.update(engine.push(batch)), table.update(engine.flush())])
    live = Engine(scene.sensors, settings, sampling=Sampling.DRAWN)
    publication = Publication(scene.sensors, settings, RuntimeLimits())
    view = publication.view
    publication.attach(lambda: (live.tracks(), live.plane), dict)
    now_s = float(batch.time_s[-1])
    for first in range(0, last, 77):
        publication.publish(live.push(batch.select(slice(first, min(first + 77, last)))), now_s)
    publication.publish(live.flush(), now_s)
    newest = rows.filter(pl.col("made_s") == now_s)
    (track_id,) = newest["track_id"].unique()
    points = forecast(view, track_id, 300.0, 10.0)
    assert points is not None
    by_horizon = {point["time_s"] - now_s: point for point in points}
    assert len(newest) == len(HORIZONS_S)
    for row in newest.to_dicts():
        point = by_horizon[row["horizon_s"]]
        for name, value in point.items():
            known = isinstance(value, float)
            assert row[name] == (pytest.approx(value, rel=1e-12) if known else value), name


@pytest.mark.parametrize("name", ["straight", "walk-300", "modes"])
def test_motions_of_the_filter_are_no_methods(name: str) -> None:
    view = Publication(_scene().sensors, TrackingSettings(), RuntimeLimits()).view
    with pytest.raises(ForecastError, match=f"expected filter, bundle or polynomial, was {name}"):
        forecast(view, 1, 30.0, 10.0, 0.95, name)
