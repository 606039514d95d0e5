"""Tracks that begin by bearings: what is not believed, and how sure it has to be."""

from collections.abc import Iterator

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.engine import Engine
from multiradar.tracking.bearing_starts import share_max
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, tracks_frame
from support import moving_scene
from support.moving_scene import FIXED, FLYING, PERIOD_S, RADAR, Path, seen, together

BIAS_SIGMA_DEG = 0.5
TABLE = moving_scene.sensors(bias_sigma_deg=BIAS_SIGMA_DEG)
# 150 m/s on a circle that takes six minutes: in the first minutes it hardly out-manoeuvres anybody.
SLOWLY_CIRCLING = Path(
    (-30e3, -8.6e3), height_m=4000.0, radius_m=8.6e3, turn_rad_per_s=np.radians(1.0)
)
TARGETS = (
    Path((-60e3, 40e3), (180.0, 0.0), height_m=6000.0),
    Path((-10e3, 60e3), (51.3, -141.0), height_m=6000.0),
)


def tracked(frame: pl.DataFrame, **settings: float) -> pl.DataFrame:
    engine = Engine(TABLE, TrackingSettings(**settings))  # type: ignore[arg-type]
    batch, refused = measurement_batch(frame, TABLE)
    assert not len(refused.index)
    outputs = [engine.push(batch), engine.flush()]
    return tracks_frame(TrackUpdates.concatenate([one.updates for one in outputs]), TABLE)


def times(until_s: float, from_s: float = 0.0) -> np.ndarray:
    return np.arange(from_s, until_s, PERIOD_S)


def scenes_of_one_moving_source(count: int) -> Iterator[pl.DataFrame]:
    for seed in range(count):
        rng = np.random.default_rng(1000 + seed)
        bias_deg = BIAS_SIGMA_DEG * rng.standard_normal()
        yield together(
            *(
                seen(
                    FLYING, target, number, times(200.0, rng.uniform(0.0, PERIOD_S)), rng,
                    source=SLOWLY_CIRCLING, bias_deg=bias_deg,
                )
                for number, target in enumerate(TARGETS)
            )
        )  # fmt: skip


def test_a_moving_source_that_looks_again_and_again_begins_no_track_at_a_wrong_place() -> None:
    """Beginnings were tens of kilometres off with a sigma of 0.3 to 8 km, at up to 2800 m/s."""
    begun = 0
    for frame in scenes_of_one_moving_source(20):
        tracks = tracked(frame)
        for number, target in enumerate(TARGETS):
            own = tracks.filter(pl.col("track_number") == number)
            begun += len(own) > 0
            distance, sigma = moving_scene.errors(own, target)
            # 4 sigma of both components together: one track of 3000.
            assert (distance[:1] < 4.0 * sigma[:1]).all()
            assert (own["speed_mps"] < 500.0).all()
    assert begun >= 30


def test_the_more_often_it_was_looked_in_vain_the_better_lines_have_to_cross() -> None:
    looks = np.arange(0.0, 60.0, 0.5)
    sigmas = np.array([1.0 / share_max(float(one)) for one in looks])
    assert sigmas[0] == pytest.approx(1.0 / 0.3)
    assert (np.diff(sigmas) > 0.0).all()
    # Of independent looks, one every other entry.
    chance = np.exp(-(sigmas[::2] ** 2) / 2.0)
    assert chance.sum() < 5.0 * chance[0]


def crossing(target: Path) -> pl.DataFrame:
    rng = np.random.default_rng(2)
    radar = seen(RADAR, target, 1, times(60.0, 1.0), rng).with_columns(
        kind=pl.lit("bearing"), range_m=pl.lit(None, pl.Float64)
    )
    return together(seen(FIXED, target, 1, times(60.0), rng), radar)


def test_bearings_of_something_faster_than_aircraft_begin_no_track() -> None:
    """Lines of two places that cross well: 0.2° and 0.06° at 40 km tell 30 m/s in 30 s."""
    target = Path((-20e3, 30e3), (600.0, 0.0))
    assert len(tracked(crossing(target)))
    assert not len(tracked(crossing(target), speed_max_mps=400.0))


def test_bearings_of_two_aircraft_under_one_identity_begin_no_track() -> None:
    """They are 20 km apart, each line in its turn."""
    here, there = Path((0.0, 30e3), (100.0, 0.0)), Path((20e3, 30e3), (100.0, 0.0))
    frame = together(*(crossing(one) for one in (here, there)))
    assert len(tracked(crossing(here)))
    assert not len(tracked(frame))
