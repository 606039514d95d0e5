"""Bearings of moving sensors, and elevations, in the tracker."""

import numpy as np
import polars as pl
import pytest

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.offline.offline_job import BATCH_ROWS
from multiradar.runtime.queries.observabilities import observability_of_track
from multiradar.runtime.queries.track_windows import WindowTable
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table, tracks_frame
from multiradar_schemas.products.observability import OBSERVABILITY_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors
from support.scenarios import moving_scene
from support.scenarios.moving_scene import FIXED, FLYING, PERIOD_S, RADAR, Path, seen, together

TABLE = moving_scene.sensors()
WELL_ALIGNED = moving_scene.sensors(bias_sigma_deg=0.05)
TARGET = Path((10e3, 20e3), (-100.0, 50.0))
FAR = Path((40e3, 30e3), (-150.0, -120.0))
CIRCLING = Path((0.0, 0.0), height_m=3000.0, radius_m=8e3, turn_rad_per_s=0.025)
STRAIGHT = Path((0.0, 0.0), (200.0, 0.0), height_m=3000.0)
FILTERS = ("two-stage", "imm")


def times(until_s: float, from_s: float = 0.0) -> np.ndarray:
    return np.arange(from_s, until_s, PERIOD_S)


def tracked(
    frame: pl.DataFrame,
    table: SensorTable = TABLE,
    *,
    batch_rows: int = BATCH_ROWS,
    **settings: str,
) -> tuple[Engine, pl.DataFrame]:  # fmt: skip
    engine = Engine(table, TrackingSettings(**settings))  # type: ignore[arg-type]
    outputs = []
    for part in frame.iter_slices(batch_rows):
        batch, rejected = measurement_batch(part, table)
        assert not len(rejected.index)
        outputs.append(engine.push(batch))
    outputs.append(engine.flush())
    updates = TrackUpdates.concatenate([output.updates for output in outputs])
    return engine, tracks_frame(updates, table)


def late(tracks: pl.DataFrame, since_s: float) -> pl.DataFrame:
    return tracks.filter(pl.col("time_s") > moving_scene.START_S + since_s)


@pytest.mark.parametrize("filter_name", FILTERS)
def test_a_single_moving_sensor_locates_a_straight_target_by_manoeuvring(filter_name: str) -> None:
    rng = np.random.default_rng(1)
    frame = seen(FLYING, FAR, 1, times(400.0), rng, source=CIRCLING)
    _, tracks = tracked(frame, WELL_ALIGNED, filter_name=filter_name)
    assert tracks["track_id"].n_unique() == 1
    distance, sigma = moving_scene.errors(late(tracks, 200.0), FAR)
    # 0.2° at 40 km is 140 m across the line of sight; the circle determines the distance.
    assert len(distance) > 90
    assert np.sqrt(np.mean(distance**2)) < 1500.0
    assert np.mean((distance / sigma) ** 2) < 2.0


def test_a_moving_sensor_in_straight_flight_initiates_no_track() -> None:
    """Targets at twice the distance and speed have the same azimuths."""
    rng = np.random.default_rng(1)
    frame = seen(FLYING, FAR, 1, times(200.0), rng, source=STRAIGHT)
    engine, tracks = tracked(frame, WELL_ALIGNED)
    assert not len(tracks)
    assert engine.counts["UNASSOCIATED"] == len(frame)


@pytest.mark.parametrize("filter_name", FILTERS)
@pytest.mark.parametrize("named", [True, False])
def test_a_moving_sensor_maintains_a_track_initiated_by_a_radar(
    filter_name: str, named: bool
) -> None:
    """Ranges and bearings of a moving sensor in one track; then the bearings alone."""
    rng = np.random.default_rng(2)
    number = 1 if named else None
    frame = together(
        seen(RADAR, TARGET, 1, np.arange(0.0, 120.0, 5.0), rng, heights=True),
        seen(FLYING, TARGET, number, times(240.0, 60.5), rng, source=CIRCLING),
        seen(FIXED, TARGET, number, times(240.0, 61.0), rng),
    )
    engine, tracks = tracked(frame, filter_name=filter_name)
    after = late(tracks, 140.0)
    assert after["track_id"].n_unique() == 1
    assert len(after) > 95
    distance, sigma = moving_scene.errors(after, TARGET)
    # Prior biases of 0.5° are 0.3 km at 35 km, and the crossing angles are small for a while.
    assert np.sqrt(np.mean(distance**2)) < 800.0
    assert 0.05 < np.mean((distance / sigma) ** 2) < 2.0
    assert engine.counts["UNASSOCIATED"] <= 5


def test_the_azimuth_bias_of_a_moving_sensor_is_estimated() -> None:
    """It is independent of the sensor's position, and observable from the radar's plots."""
    rng = np.random.default_rng(3)
    parts = []
    for number in range(6):
        target = Path((8e3 * number - 20e3, 25e3), (150.0, 20.0 * number - 50.0))
        parts += [
            seen(RADAR, target, number, np.arange(0.3 * number, 200.0, 5.0), rng, heights=True),
            seen(FLYING, target, number, times(200.0, 0.1 * number), rng, source=CIRCLING,
                 bias_deg=0.7),
        ]  # fmt: skip
    engine, _ = tracked(together(*parts))
    column = int(np.flatnonzero(TABLE.parameter_sensor == TABLE.ids.index(FLYING))[0])
    sigma = float(np.sqrt(engine.biases.covariance[column, column]))
    # Common to both is the azimuth bias of the radar, whose plots alone do not determine north.
    assert np.degrees(sigma) < 0.3
    assert abs(engine.biases.estimate[column] - np.radians(0.7)) < 3.5 * sigma


@pytest.mark.slow
@pytest.mark.parametrize("filter_name", FILTERS)
def test_an_elevation_and_a_height_determine_the_distance(filter_name: str) -> None:
    """One fixed direction finder, with Mode C: a track; without: none."""
    rng = np.random.default_rng(4)
    frame = seen(FIXED, TARGET, 1, times(200.0), rng, elevations=True, heights=True)
    _, tracks = tracked(frame, WELL_ALIGNED, filter_name=filter_name)
    assert tracks["track_id"].n_unique() == 1
    distance, sigma = moving_scene.errors(late(tracks, 20.0), TARGET)
    # At 20 to 40 km an elevation error of 0.2° is 0.2 to 0.6 km of range.
    assert np.sqrt(np.mean(distance**2)) < 700.0
    assert 0.2 < np.mean((distance / sigma) ** 2) < 2.0
    _, none = tracked(frame.with_columns(height_m=pl.lit(None, pl.Float64)), WELL_ALIGNED)
    assert not len(none)
    _, without = tracked(frame.with_columns(elevation_deg=pl.lit(None, pl.Float64)), WELL_ALIGNED)
    assert not len(without)


@pytest.mark.parametrize("filter_name", FILTERS)
def test_elevations_determine_the_height_of_an_aircraft_without_mode_c(filter_name: str) -> None:
    rng = np.random.default_rng(5)
    frame = together(
        seen(FIXED, TARGET, 1, times(300.0), rng, elevations=True),
        seen(FLYING, TARGET, 1, times(300.0, 0.7), rng, elevations=True, source=CIRCLING),
    )
    _, tracks = tracked(frame, filter_name=filter_name)
    after = late(tracks, 60.0)
    off = after["height_m"].to_numpy() - TARGET.height_m
    sigma = after["height_sigma_m"].to_numpy()
    assert np.sqrt(np.mean(off**2)) < 250.0
    assert 0.1 < np.mean((off / sigma) ** 2) < 3.0
    _, plain = tracked(frame.with_columns(elevation_deg=pl.lit(None, pl.Float64)))
    assert plain["height_m"].null_count() == len(plain)


@pytest.mark.parametrize("named", [True, False])
def test_output_with_moving_sensors_depends_neither_on_batches_nor_on_workers(named: bool) -> None:
    rng = np.random.default_rng(6)
    other = Path((-20e3, 30e3), (120.0, 60.0), height_m=7000.0)
    parts = []
    for number, target in enumerate((TARGET, other)):
        mine = number if named else None
        parts += [
            seen(RADAR, target, number, np.arange(0.4 * number, 40.0, 5.0), rng, heights=True),
            seen(FIXED, target, mine, times(60.0, 0.3), rng, elevations=True, heights=True),
            seen(FLYING, target, mine, times(60.0, 0.6), rng, source=CIRCLING, elevations=True),
        ]
    frame = together(*parts)
    _, whole = tracked(frame)
    _, pieces = tracked(frame, batch_rows=7)
    assert len(whole) > 100
    assert whole.equals(pieces)


def test_filters_without_bearings_count_elevations_and_moving_sensors_as_unsupported() -> None:
    rng = np.random.default_rng(7)
    frame = together(
        seen(RADAR, TARGET, 1, np.arange(0.0, 40.0, 5.0), rng, heights=True),
        seen(FLYING, TARGET, 1, times(40.0, 10.5), rng, source=CIRCLING, elevations=True),
    )
    engine, tracks = tracked(frame, filter_name="ci")
    assert engine.counts["UNSUPPORTED"] == 15
    assert len(tracks) == 8


def test_a_scenario_without_ranges_is_tracked() -> None:
    """Fifteen aircraft, half without heights, biases of 0.3° to 0.4°: one track for each."""
    scene = builtin_scenario("bearings-only")
    observation = observe(scene, np.random.default_rng(scene.seed))
    table = sensor_table(parse_sensors(sensors_text(scene)))
    frame = measurements_frame(scene, observation).filter(pl.col("time_s") < 300.0)
    _, tracks = tracked(frame, table, filter_name="imm")
    assert tracks["track_number"].n_unique() == 15
    assert tracks["track_id"].n_unique() == 15
    truth = truth_frame(scene, observation).select(
        "time_s", "sensor_id", "track_number", north="latitude_deg", east="longitude_deg",
        up="height_m",
    )  # fmt: skip
    both = tracks.filter(pl.col("time_s") > 120.0).join(
        truth, on=["time_s", "sensor_id", "track_number"]
    )
    assert len(both) > 800
    north = 111.2e3 * (both["latitude_deg"] - both["north"]).to_numpy()
    east = 111.3e3 * np.cos(np.radians(56.8)) * (both["longitude_deg"] - both["east"]).to_numpy()
    assert np.sqrt(np.mean(north**2 + east**2)) < 400.0
    assert both["height_m"].null_count() < 0.1 * len(both)
    up = (both["height_m"] - both["up"]).drop_nulls().to_numpy()
    assert np.sqrt(np.mean(up**2)) < 150.0


@pytest.mark.slow
def test_observability_from_a_single_moving_sensor_is_written_offline() -> None:
    rng = np.random.default_rng(8)
    frame = seen(FLYING, FAR, 1, times(400.0), rng, source=CIRCLING)
    settings = TrackingSettings()
    for window_s, expected in ((200.0, True), (10.0, False)):
        table = WindowTable(
            observability_of_track, OBSERVABILITY_SCHEMA, WELL_ALIGNED, window_s, settings.epoch_s
        )
        engine = Engine(WELL_ALIGNED, settings)
        batch, _ = measurement_batch(frame, WELL_ALIGNED)
        rows = [table.update(engine.push(batch)), table.update(engine.flush()), table.finish()]
        table_rows = pl.concat(rows)
        assert len(table_rows) > 20
        last = table_rows.row(-1, named=True)
        assert last["is_observable"] is expected
        assert (last["ranges"], last["places"]) == (0, 1)
