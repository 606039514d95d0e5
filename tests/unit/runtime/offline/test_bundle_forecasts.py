"""Forecasts from bundles say the same over the service's view and in the table of a run."""

from collections.abc import Iterator

import numpy as np
import polars as pl
import pytest

from multiradar.errors import ForecastError, TrajectoryError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.offline.bundle_forecast_table import BundleForecasts, BundleForecastTable
from multiradar.runtime.offline.trajectory_table import TrajectoryTable
from multiradar.runtime.queries.parameters import BUNDLE, FILTER
from multiradar.runtime.trajectories import ensemble_scores
from multiradar.runtime.trajectories.feed import TrajectoryFeed
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.forecast import region_sizes
from multiradar.tracking.forecast.region_sizes import HORIZONS_S
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_schemas.products.forecast import FORECAST_SCHEMA, ForecastPoint, ForecastRow
from support.fakes.engine_outputs import End, Sample, output_of
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.asked import forecast
from support.scenarios.live_scene import START_S
from support.scenarios.trajectory_scene import (
    MUTE,
    PLANE,
    REPORTING,
    TABLE,
    TURNING,
    flown,
    recording,
)

pytestmark = pytest.mark.slow

TRACKING = TrackingSettings(reorder_horizon_s=0.0)
OPTIONS = TrajectoryOptions(10, 1000)
SECONDS = 80.0


class Scene:
    """The output of the engine for the scenario, and the answers of a service."""

    def __init__(self, seconds: float = SECONDS, sampling: Sampling = Sampling.NONE) -> None:
        self.engine = Engine(TABLE, TRACKING, sampling=sampling)
        parts = recording(seconds).iter_slices(20)
        self.outputs = [self.engine.push(measurement_batch(part, TABLE)[0]) for part in parts]
        self.outputs.append(self.engine.flush())
        self.publication = Publication(TABLE, TRACKING, RuntimeLimits())
        self.view = self.publication.view
        self.publication.attach(lambda: (self.engine.tracks(), self.engine.plane), dict)
        self.feed = TrajectoryFeed(OPTIONS, TABLE, TRACKING)
        self.publication.keep(self.feed)

    def publish(self, data_time_s: float) -> None:
        self.feed.start()
        for output in self.outputs:
            self.publication.publish(output, data_time_s)
        assert self.feed.settle(WAIT_TIMEOUT_S)


@pytest.fixture(scope="module")
def scene() -> Iterator[Scene]:
    found = Scene()
    found.publish(START_S + SECONDS)
    yield found
    found.feed.stop()


def table_of(outputs: list[EngineOutput], every_s: float) -> pl.DataFrame:
    bundles = TrajectoryTable(OPTIONS, TABLE, TRACKING, BundleForecasts(every_s))
    table = BundleForecastTable(bundles)
    parts = []
    for output in outputs:
        bundles.update(output)
        parts.append(table.update(output))
    bundles.finish()
    return pl.concat([*parts, table.finish()])


@pytest.fixture(scope="module")
def table(scene: Scene) -> pl.DataFrame:
    return table_of(scene.outputs, 8.0)


def test_the_table_and_the_service_agree(scene: Scene, table: pl.DataFrame) -> None:
    last = table.filter(pl.col("track_id") == TURNING)[-len(HORIZONS_S) :]
    made_s = last["made_s"][0]
    track = scene.view.track(TURNING)
    assert track is not None
    assert made_s == track["time_s"]
    # The service starts at the present data time: the last horizons are on its steps.
    ahead_s = made_s + HORIZONS_S - (track["time_s"] + track["age_s"])
    for row, horizon_s in zip(last.to_dicts(), ahead_s.tolist(), strict=True):
        points = forecast(scene.view, TURNING, horizon_s, horizon_s, 0.95, BUNDLE)
        assert points is not None
        point = points[-1]
        assert point["time_s"] == pytest.approx(row["time_s"], abs=1e-6)
        for name in set(row) - {"time_s", "track_id", "made_s", "horizon_s", "by", "probability"}:
            expected = row[name]
            if isinstance(expected, float):
                expected = pytest.approx(expected, rel=1e-6, abs=1e-9)
            assert point[name] == expected, name


def test_points_match_the_schema_and_their_regions_contain_the_aircraft(scene: Scene) -> None:
    points = forecast(scene.view, TURNING, 30.0, 10.0, 0.95, BUNDLE)
    assert points is not None
    assert len(points) == 4
    for point in points:
        made = ForecastPoint.model_validate(point)
        assert made.motion == BUNDLE
        assert not made.calibrated
        assert made.members is not None
        assert sum(one.weight for one in made.members) == pytest.approx(1.0)
        east, north = PLANE.to_plane(np.radians(made.latitude_deg), np.radians(made.longitude_deg))
        truth = np.array(flown(TURNING, np.array(made.time_s - START_S)))
        # The true turn continues: the region of 95 % contains it.
        assert np.hypot(*(truth - [east, north])) < made.region_major_m


def test_the_filter_has_no_members(scene: Scene) -> None:
    points = forecast(scene.view, TURNING, 10.0, 10.0, 0.95, FILTER)
    assert points is not None
    assert all(ForecastPoint.model_validate(point).members is None for point in points)


def test_rows_match_the_schema(table: pl.DataFrame) -> None:
    assert table.schema == FORECAST_SCHEMA
    assert table["by"].unique().to_list() == [BUNDLE]
    for row in table.head(10).to_dicts():
        ForecastRow.model_validate(row)
    made = table.unique(["track_id", "made_s"]).sort("track_id", "made_s")
    steps = made.with_columns(pl.col("made_s").diff().over("track_id").alias("step"))["step"]
    assert steps.drop_nulls().min() >= 8.0  # type: ignore[operator] # There are such steps.


def test_the_table_does_not_depend_on_the_batches_of_output(
    scene: Scene, table: pl.DataFrame
) -> None:
    engine = Engine(TABLE, TRACKING)
    outputs = [engine.push(measurement_batch(recording(SECONDS), TABLE)[0]), engine.flush()]
    assert table_of(outputs, 8.0).equals(table)


def test_a_horizon_beyond_the_bound_is_rejected(scene: Scene) -> None:
    with pytest.raises(ForecastError, match="720 s after the last plot") as error:
        forecast(scene.view, TURNING, 1200.0, 600.0, 0.95, BUNDLE)
    assert error.value.parameter == "horizon_s"
    assert forecast(scene.view, TURNING, 1200.0, 600.0, 0.95, FILTER) is not None


def test_a_coasting_track_is_forecast_and_marked() -> None:
    coasting = Scene()
    try:
        coasting.publish(START_S + SECONDS + TRACKING.coast_after_s + 5.0)
        points = forecast(coasting.view, TURNING, 10.0, 10.0, 0.95, BUNDLE)
    finally:
        coasting.feed.stop()
    assert points is not None
    assert {point["state"] for point in points} == {"coasting"}
    assert points[0]["age_s"] > TRACKING.coast_after_s


def test_a_service_without_bundles_says_so(scene: Scene) -> None:
    publication = Publication(TABLE, TRACKING, RuntimeLimits())
    view = publication.view
    publication.attach(lambda: (scene.engine.tracks(), scene.engine.plane), dict)
    for output in scene.outputs:
        publication.publish(output, None)
    with pytest.raises(TrajectoryError) as error:
        forecast(view, TURNING, 10.0, 10.0, 0.95, BUNDLE)
    assert error.value.code == "TRAJECTORIES_OFF"
    assert forecast(view, 99, 10.0, 10.0, 0.95, BUNDLE) is None


LONG_S = 168.0


@pytest.fixture(scope="module")
def learning() -> Iterator[Scene]:
    """A scenario long enough, with forecasts frequent enough, for a calibration."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ensemble_scores, "PLOTS_EACH", 4.0)
        patch.setattr(region_sizes, "CALIBRATED", 20.0)
        found = Scene(LONG_S, Sampling.DRAWN)
        found.publish(START_S + LONG_S)
        yield found
        found.feed.stop()


@pytest.fixture(scope="module")
def learnt(learning: Scene) -> pl.DataFrame:
    return table_of(learning.outputs, 8.0)


def test_the_table_and_the_service_learn_the_same(learning: Scene, learnt: pl.DataFrame) -> None:
    row = learnt.filter(track_id=TURNING, horizon_s=10.0).row(-1, named=True)
    track = learning.view.track(TURNING)
    assert track is not None
    assert row["made_s"] == track["time_s"]
    ahead_s = row["time_s"] - track["time_s"] - track["age_s"]
    points = forecast(learning.view, TURNING, ahead_s, ahead_s, 0.95, BUNDLE)
    assert points is not None
    assert row["calibrated"]
    assert points[-1]["calibrated"]
    assert points[-1]["region_factor"] == pytest.approx(row["region_factor"], rel=1e-9)
    # The longest horizon is not calibrated yet.
    assert learnt.filter(horizon_s=300.0)["calibrated"].sum() == 0
    early = learnt.filter(pl.col("made_s") < START_S + 60.0)
    assert early["calibrated"].sum() == 0


def test_the_calibration_does_not_depend_on_the_batches_of_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One of the aircraft is seen every twelve seconds: its last plot is of an earlier epoch."""
    monkeypatch.setattr(ensemble_scores, "PLOTS_EACH", 2.0)
    monkeypatch.setattr(region_sizes, "CALIBRATED", 10.0)
    often = (pl.col("track_number") != MUTE) | (pl.col("time_s") % 12.0 < 4.0)
    rows = recording(150.0).filter(often)
    tables = []
    for count, sampling in ((20, Sampling.DRAWN), (len(rows), Sampling.ALL)):
        engine = Engine(TABLE, TRACKING, sampling=sampling)
        parts = [measurement_batch(part, TABLE)[0] for part in rows.iter_slices(count)]
        tables.append(table_of([*map(engine.push, parts), engine.flush()], 8.0))
    assert tables[0].equals(tables[1])
    assert tables[0].filter(pl.col("calibrated"))["track_id"].n_unique() > 2


def test_a_track_that_ends_while_plots_wait_teaches_as_much_as_one_that_ends_later(
    learning: Scene,
) -> None:
    """After a restart all plots of a terminated track may still be queued at its end."""
    last = learning.outputs[-1].updates
    end_s = float(last.time_s[-1]) + 1.0
    epoch = learning.outputs[-1].samples[-1].epoch + 1
    after = output_of([End(end_s, TURNING), Sample(end_s + 7.0, epoch)])
    found = []
    for patient in (True, False):
        feed = TrajectoryFeed(TrajectoryOptions(10, 10_000), TABLE, TRACKING)
        if not patient:
            feed.start()
        for output in (*learning.outputs, after):
            feed.put(output)
            assert patient or feed.settle(WAIT_TIMEOUT_S)
        if patient:
            feed.start()
        assert feed.settle(WAIT_TIMEOUT_S)
        found.append(feed.read(REPORTING).sizes)
        feed.stop()
    np.testing.assert_array_equal(found[0].shares, found[1].shares)
    assert found[0].calibrated_to_s == found[1].calibrated_to_s >= 10.0
    before = learning.feed.read(REPORTING).sizes
    assert not np.array_equal(before.shares, found[0].shares)
