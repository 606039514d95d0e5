"""Track initiation by bearings: rejected fits, and required accuracy."""

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.bearings import bearing_starts
from multiradar.tracking.bearings.bearing_starts import BEARINGS_MAX, BEARINGS_MIN, share_max
from multiradar.tracking.bearings.waiting_bearings import WaitingBearing
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, tracks_frame
from support.scenarios import moving_scene
from support.scenarios.moving_scene import FIXED, FLYING, PERIOD_S, RADAR, Path, seen, together

BIAS_SIGMA_DEG = 0.5
TABLE = moving_scene.sensors(bias_sigma_deg=BIAS_SIGMA_DEG)
# 150 m/s on a circle of six minutes: in the first minutes it hardly outmanoeuvres any target.
SLOWLY_CIRCLING = Path(
    (-30e3, -8.6e3), height_m=4000.0, radius_m=8.6e3, turn_rad_per_s=np.radians(1.0)
)
TARGETS = (
    Path((-60e3, 40e3), (180.0, 0.0), height_m=6000.0),
    Path((-10e3, 60e3), (51.3, -141.0), height_m=6000.0),
)


def tracked(frame: pl.DataFrame, **settings: float) -> pl.DataFrame:
    engine = Engine(TABLE, TrackingSettings(**settings))  # type: ignore[arg-type]
    batch, rejects = measurement_batch(frame, TABLE)
    assert not len(rejects.index)
    outputs = [engine.push(batch), engine.flush()]
    return tracks_frame(TrackUpdates.concatenate([one.updates for one in outputs]), TABLE)


def times(until_s: float, from_s: float = 0.0) -> np.ndarray:
    return np.arange(from_s, until_s, PERIOD_S)


def of_one_moving_source(seed: int, until_s: float, bias_sigma_deg: float = 0.0) -> pl.DataFrame:
    rng = np.random.default_rng(seed)
    bias_deg = bias_sigma_deg * rng.standard_normal() if bias_sigma_deg else 0.0
    return together(
        *(
            seen(
                FLYING, target, number, times(until_s), rng, source=SLOWLY_CIRCLING,
                bias_deg=bias_deg,
            )
            for number, target in enumerate(TARGETS)
        )
    )  # fmt: skip


@pytest.mark.parametrize("seed", [220, 262, 295, 386, 402, 433, 452])
def test_a_fit_that_does_not_converge_initiates_no_track(seed: int) -> None:
    """These were initiated after 14 to 38 s, 12 to 400 km off by 8 to 99 sigma, at up to 8 km/s."""
    tracks = tracked(of_one_moving_source(seed, 60.0))
    for number, target in enumerate(TARGETS):
        own = tracks.filter(pl.col("track_number") == number)
        distance, sigma = moving_scene.errors(own, target)
        assert (distance < 4.0 * sigma).all()
        assert (own["speed_mps"] < 700.0).all()


@pytest.mark.slow
def test_a_slowly_circling_source_initiates_tracks_after_minutes() -> None:
    """At a distance accuracy of a quarter, once per aircraft, with consistent covariance."""
    ratios = []
    for seed in range(6):
        tracks = tracked(of_one_moving_source(seed, 200.0, BIAS_SIGMA_DEG))
        for number, target in enumerate(TARGETS):
            own = tracks.filter(pl.col("track_number") == number)
            assert own["track_id"].n_unique() == 1
            # Straight flight is distinguished from other distances once the source has turned by
            # 90°.
            assert 60.0 < own["time_s"][0] - moving_scene.START_S < 180.0
            distance, sigma = moving_scene.errors(own, target)
            ratios.append(distance[0] / sigma[0])
    assert np.max(ratios) < 3.0
    assert np.mean(np.square(ratios)) < 1.5


def test_the_required_accuracy_increases_with_every_failed_attempt() -> None:
    attempts = np.arange(0.0, 60.0, 0.5)
    sigmas = np.array([1.0 / share_max(float(one)) for one in attempts])
    assert sigmas[0] == pytest.approx(1.0 / 0.3)
    assert (np.diff(sigmas) > 0.0).all()
    # Independent attempts are every other entry.
    probability = np.exp(-(sigmas[::2] ** 2) / 2.0)
    assert probability.sum() < 5.0 * probability[0]


def test_a_failed_attempt_is_repeated_after_an_eighth_more_of_its_time_span(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spans_s: list[float] = []

    def fail(seen: list[WaitingBearing], *_: object) -> None:
        spans_s.append(seen[-1].time_s + PERIOD_S - seen[0].time_s)
        raise np.linalg.LinAlgError

    monkeypatch.setattr(bearing_starts, "locate", fail)
    of_one = of_one_moving_source(1, 150.0).filter(pl.col("track_number") == 0)
    assert not len(tracked(of_one))
    due_s = 1.12 * np.array(spans_s[:-1])
    assert len(due_s) > 8
    assert (spans_s[1:] >= due_s - 1e-6).all()
    assert (spans_s[1:] < due_s + PERIOD_S).all()


def test_the_first_attempt_has_the_minimum_number_of_bearings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    attempts: list[int] = []

    def fail(seen: list[WaitingBearing], *_: object) -> None:
        attempts.append(len(seen))
        raise np.linalg.LinAlgError

    monkeypatch.setattr(bearing_starts, "locate", fail)
    assert not len(tracked(crossing(Path((-20e3, 30e3), (200.0, 0.0)))))
    # Each further bearing is an attempt, with at most the bearings that are kept.
    kept = [min(number, BEARINGS_MAX) for number in range(BEARINGS_MIN, 2 * BEARINGS_MAX)]
    assert attempts[: len(kept)] == kept


def crossing(target: Path) -> pl.DataFrame:
    rng = np.random.default_rng(2)
    radar = seen(RADAR, target, 1, times(60.0, 1.0), rng).with_columns(
        kind=pl.lit("bearing"), range_m=pl.lit(None, pl.Float64)
    )
    return together(seen(FIXED, target, 1, times(60.0), rng), radar)


@pytest.mark.parametrize("address", ["3c660c", "000000"])
def test_bearings_with_an_address_alone_initiate_a_track(address: str) -> None:
    frame = crossing(Path((-20e3, 30e3), (200.0, 0.0)))
    named = frame.with_columns(mode_s_address=pl.lit(address), track_number=pl.lit(None, pl.Int64))
    assert tracked(named)["mode_s_address"].unique().to_list() == [address]


@pytest.mark.slow
def test_bearings_of_a_target_faster_than_aircraft_initiate_no_track() -> None:
    """Bearings of two sites: 0.2° and 0.06° at 40 km give 30 m/s in 30 s."""
    target = Path((-20e3, 30e3), (600.0, 0.0))
    assert len(tracked(crossing(target)))
    assert not len(tracked(crossing(target), speed_max_mps=400.0))


@pytest.mark.slow
def test_bearings_of_two_aircraft_with_one_identity_initiate_no_track() -> None:
    """They are 20 km apart, with bearings in turn."""
    here, there = Path((0.0, 30e3), (100.0, 0.0)), Path((20e3, 30e3), (100.0, 0.0))
    frame = together(*(crossing(one) for one in (here, there)))
    assert len(tracked(crossing(here)))
    assert not len(tracked(frame))
