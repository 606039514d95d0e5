"""Lifecycle transitions are complete for all tracks and independent of the batches."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.lifecycle.transitions import (
    REASON_NAMES,
    TRANSITION_NAMES,
    TrackTransitions,
)
from multiradar.tracking.outputs import EndedTracks
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, Scene, make_scene, random_flights, three_radars

KNOWN = TrackingSettings()
NAMELESS = TrackingSettings(hidden_fields=("track_number", "mode_s_address", "mode_3a"))
STRAIGHT = Flight(0.0, 240.0, (2e4, 3e4, 150.0, 80.0))
# Advances the data time while the other aircraft has no plots.
OTHER = replace(STRAIGHT, state=(-4e4, -2e4, 150.0, 80.0))

Step = tuple[str, str]


def seen(*flights: Flight) -> Scene:
    return make_scene(np.random.default_rng(5), three_radars(), list(flights) or [STRAIGHT])


def tracked(
    batch: MeasurementBatch, scene: Scene, settings: TrackingSettings, size: int = 10**6
) -> tuple[TrackTransitions, EndedTracks, str]:
    engine, digest = Engine(scene.sensors, settings), OutputDigest()
    starts = range(0, len(batch), size)
    outputs = [engine.push(batch.select(slice(first, first + size))) for first in starts]
    outputs.append(engine.flush())
    for output in outputs:
        digest.add(output)
    return (
        TrackTransitions.concatenate([output.transitions for output in outputs]),
        EndedTracks.concatenate([output.ended for output in outputs]),
        digest.hexdigest(),
    )


def steps(found: TrackTransitions, track: int = 1) -> list[Step]:
    mine = found.track_id == track
    return [
        (TRANSITION_NAMES[step], REASON_NAMES[why])
        for step, why in zip(found.transition[mine], found.reason[mine], strict=True)
    ]


def without(scene: Scene, first_s: float, last_s: float) -> MeasurementBatch:
    since_s = scene.batch.time_s - scene.batch.time_s[0]
    return scene.batch.select((since_s < first_s) | (since_s > last_s) | (scene.aircraft == 1))


@pytest.mark.parametrize(
    ("settings", "started", "confirmed"),
    [(KNOWN, "new-identity", "updates"), (NAMELESS, "new-place", "likelihood")],
)
@pytest.mark.fault(14)
def test_a_gap_is_reported_as_coasting_and_resumed(
    settings: TrackingSettings, started: str, confirmed: str
) -> None:
    scene = seen(STRAIGHT, OTHER)
    rows = without(scene, 120.0, 150.0)
    found, ended, _ = tracked(rows, scene, settings)
    first_s = scene.batch.time_s[0]
    track = 1 + int(scene.aircraft[0] != 0)
    mine = found.track_id == track
    assert steps(found, track) == [
        ("started", started),
        ("confirmed", confirmed),
        ("coasting", "silent"),
        ("resumed", "heard"),
    ]
    assert len(ended) == 0
    start, _, coasting, resumed = found.time_s[mine] - first_s
    assert start < 4.0
    assert 150.0 < resumed < 155.0
    last_s = found.last_update_s[mine] - first_s
    assert np.isnan(last_s[0])
    assert 112.0 < last_s[2] == last_s[3] <= 120.0
    # Detected when the next epoch opened.
    assert 15.0 < coasting - last_s[2] < 15.0 + settings.epoch_s


@pytest.mark.parametrize("settings", [KNOWN, NAMELESS])
def test_a_track_without_plots_ends_as_silent(settings: TrackingSettings) -> None:
    scene = seen(replace(STRAIGHT, end_s=60.0), OTHER)
    found, ended, _ = tracked(scene.batch, scene, settings)
    (track,) = ended.track_id.tolist()
    assert [REASON_NAMES[why] for why in ended.reason] == ["silent"]
    assert steps(found, track)[-1] == ("ended", "silent")
    (last,) = np.flatnonzero(found.transition == TRANSITION_NAMES.index("ended"))
    assert found.time_s[last] == ended.time_s[0]
    assert found.last_update_s[last] - scene.batch.time_s[0] <= 60.0
    assert found.into_track_id.tolist() == [-1] * len(found)


def test_a_track_with_few_plots_of_one_radar_ends_as_unlikely() -> None:
    """It is never silent for so long that it ends as silent."""
    scene = seen(replace(STRAIGHT, end_s=500.0))
    since_s = scene.batch.time_s - scene.batch.time_s[0]
    first = scene.batch.sensor == 0
    few = first & (np.cumsum(first) % 10 == 0)
    rows = scene.batch.select((since_s < 60.0) | few)
    found, ended, _ = tracked(rows, scene, NAMELESS)
    last_s = found.last_update_s[found.transition == TRANSITION_NAMES.index("ended")][0]
    assert ended.time_s[0] - last_s < NAMELESS.drop_after_s
    assert steps(found)[-1] == ("ended", "unlikely")
    assert REASON_NAMES[ended.reason[0]] == "unlikely"


def test_a_track_without_support_ends_unconfirmed() -> None:
    scene = seen(replace(STRAIGHT, end_s=6.0), OTHER)
    rows = scene.batch.select((scene.aircraft != 0) | (scene.batch.sensor == 0))
    found, ended, _ = tracked(rows, scene, NAMELESS)
    (track,) = ended.track_id.tolist()
    assert steps(found, track) == [("started", "new-place"), ("ended", "unconfirmed")]


def test_outliers_restart_a_track_and_it_is_confirmed_again() -> None:
    scene = seen()
    batch = scene.batch
    late = batch.time_s > batch.time_s[0] + 120.0
    moved = replace(batch, range_m=np.where(late, batch.range_m + 30e3, batch.range_m))
    found, _, _ = tracked(moved, scene, KNOWN)
    assert steps(found) == [
        ("started", "new-identity"),
        ("confirmed", "updates"),
        ("restarted", "refused"),
        ("confirmed", "updates"),
    ]


def test_a_merged_track_names_the_remaining_one() -> None:
    scene = seen()
    engine = Engine(scene.sensors, NAMELESS)
    half = len(scene.batch) // 2
    engine.push(scene.batch.select(slice(0, half)))
    pool = engine._pool
    old, new = int(pool.used()[0]), int(pool.roster.free[pool.roster.counters[1] - 1])
    for array in (*pool.aircraft, *pool.life):
        if len(array):
            array[new] = array[old]
    pool.roster.counters[:] += (1, -1)
    pool.roster.track_id[new] = pool.roster.counters[0]
    pool.life.last_seen[new] = -np.inf
    output = engine.push(scene.batch.select(slice(half, None)))
    assert output.ended.track_id.tolist() == [2]
    assert REASON_NAMES[output.ended.reason[0]] == "merged"
    assert output.ended.into_track_id.tolist() == [1]
    assert steps(output.transitions, 2)[-1] == ("ended", "merged")
    assert output.transitions.into_track_id[output.transitions.track_id == 2][-1] == 1


@pytest.mark.slow
@pytest.mark.parametrize("settings", [KNOWN, NAMELESS])
def test_transitions_do_not_depend_on_batches_and_are_in_order(settings: TrackingSettings) -> None:
    rng = np.random.default_rng(8)
    radars = [replace(radar, detection=0.8) for radar in three_radars()]
    scene = make_scene(rng, radars, random_flights(rng, 20, 200.0, lives_differ=True))
    rows = without(scene, 90.0, 112.0)
    expected, ended, digest = tracked(rows, scene, settings)
    assert len(ended) >= 3
    assert (np.diff(expected.time_s) >= 0.0).all()
    ends = expected.transition == TRANSITION_NAMES.index("ended")
    assert expected.track_id[ends].tolist() == ended.track_id.tolist()
    for size in (1, 7, 300):
        assert tracked(rows, scene, settings, size)[2] == digest


def test_every_track_starts_once_and_first() -> None:
    rng = np.random.default_rng(8)
    scene = make_scene(rng, three_radars(), random_flights(rng, 12, 60.0, lives_differ=True))
    found, _, _ = tracked(scene.batch, scene, NAMELESS)
    for track in np.unique(found.track_id).tolist():
        names = [name for name, _ in steps(found, track)]
        assert names.index("started") == 0
        assert names.count("started") == 1
