"""Encounters of live tracks: selection and content; they agree with forecasts and all pairs."""

from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar.errors import ForecastError
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.view import LiveView
from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.offline.encounter_table import EncounterTable
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import (
    TrackSnapshot,
    _paths,
    encounters,
    no_encounters,
)
from multiradar.runtime.queries.forecast_methods import Known, PredictedPath, by_plan, known_of
from multiradar.runtime.queries.forecasts import forecast_from
from multiradar.runtime.queries.registry import ENCOUNTERS
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.columns import rows_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.outputs import (
    STATE_CONFIRMED,
    STATE_TENTATIVE,
    Picture,
    TrackStates,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from multiradar_schemas.products.encounter import Encounters
from support.fakes.engine_outputs import Update, output_of
from support.scenarios.encounter_paths import covariance
from support.scenarios.live_scene import recording, sensors
from support.scenarios.scenes import Flight, Radar, make_scene

PLANE = SystemPlane(np.radians(50.0), np.radians(15.0))
SETTINGS = TrackingSettings(filter_name="two-stage", acceleration_density=1.0)
NOW_S = 1000.0
#: Mode C, good to 10 m, level to 1 m/s.
LEVEL = [9000.0, 0.0, 100.0, 0.0, 1.0, 2.0]


def snapshot(means: list[list[float]], ages_s: list[float] | None = None) -> TrackSnapshot:
    """Confirmed tracks whose states are of their last updates, at 9 km."""
    count = len(means)
    time_s = NOW_S - np.array(ages_s or [0.0] * count)
    states = TrackStates(
        track_id=np.arange(1, count + 1),
        time_s=time_s,
        mean=np.array(means).reshape(count, 4),
        covariance=np.array([covariance(50.0, 4.0)] * count).reshape(count, 4, 4),
        height_m=np.full(count, LEVEL[0]),
        climbs=np.tile(LEVEL, (count, 1)),
    )
    rows = np.zeros(count, UPDATE_DTYPE)
    rows["track_id"], rows["time_s"], rows["state"] = states.track_id, time_s, STATE_CONFIRMED
    return TrackSnapshot(NOW_S, rows, states)


def straight(known: Known, ahead_s: NDArray[np.float64]) -> PredictedPath:
    """Forecast with straight flight, without calibration."""
    calibration = known.calibration
    motion = calibration.family.names.index("straight")
    return by_plan(known, ahead_s, calibration.scores.plan(ahead_s, 0.95, motion))


def asked(scene: TrackSnapshot, **query: Any) -> Encounters:
    """Ask for encounters; the answer keeps to its schema."""
    answer = encounters(scene, EncounterQuery(**query), PLANE, SETTINGS, calibration_for(SETTINGS))
    return Encounters.model_validate(answer)


def test_two_that_cross_meet_where_their_forecasts_say() -> None:
    """Forecasts of both at the reported time have the reported positions."""
    crossing = snapshot([[0.0, 0.0, 200.0, 0.0], [12e3, -13e3, 0.0, 210.0]], [3.0, 7.0])
    (found,) = asked(crossing).encounters
    assert 55.0 < found.time_to_closest_s < 62.0
    assert found.closest_time_s == NOW_S + found.time_to_closest_s
    ends = []
    for side, track_id, age_s in (("first", 1, 3.0), ("second", 2, 7.0)):
        track = {
            "track_id": track_id, "time_s": NOW_S - age_s, "age_s": age_s, "height_m": 9000.0,
            "state": "confirmed",
        }  # fmt: skip
        known = known_of(crossing.states, track_id, calibration_for(SETTINGS))
        assert known is not None
        ahead_s = np.array([found.time_to_closest_s])
        points = forecast_from(known, track, PLANE, ahead_s, straight)
        assert getattr(found, f"{side}_latitude_deg") == pytest.approx(points[0]["latitude_deg"])
        assert getattr(found, f"{side}_longitude_deg") == pytest.approx(points[0]["longitude_deg"])
        assert getattr(found, f"{side}_age_s") == age_s
        ends.append(np.radians([points[0]["latitude_deg"], points[0]["longitude_deg"]]))
    first = (float(ends[0][0]), float(ends[0][1]), 9000.0)
    range_m, _, _ = slant_range_azimuth(first, ends[1][0], ends[1][1], 9000.0)
    # 1 km along the Earth against its chord: parts in 1e6.
    assert found.distance_m == pytest.approx(float(range_m), abs=0.1)
    assert found.distance_low_m < found.distance_m < found.distance_high_m
    assert found.vertical_separation_m == 0.0
    assert not found.together


def test_distances_are_true_ones_far_from_the_centre() -> None:
    """At 3 000 km two aircraft 9.9 km apart on the plane are 11.2 km apart on the Earth."""
    far = snapshot([[3.0e6, 0.0, 0.0, 200.0], [3.0e6 + 9.9e3, 0.0, 0.0, 200.0]])
    assert asked(far, distance_m=11e3).total == 0
    (found,) = asked(far, distance_m=12e3).encounters
    assert found.distance_m == pytest.approx(9.9e3 / np.cos(np.arcsin(3.0 / 6.378)), rel=0.01)


@pytest.mark.parametrize("apart_m", [0.0, 400.0, 5000.0])
def test_two_aircraft_in_formation_are_reported_with_the_present_time(apart_m: float) -> None:
    """Also two tracks of one aircraft; their velocities differ by less than these err by."""
    formation = snapshot([[0.0, 0.0, 200.0, 0.0], [-apart_m, 0.0, 203.0, 1.0]])
    (found,) = asked(formation, horizon_s=300.0).encounters
    assert found.together
    assert found.time_to_closest_s == 0.0
    assert found.time_sigma_s is None
    assert found.distance_m == found.distance_now_m == pytest.approx(apart_m, rel=2e-3)
    # Two at one position may collide: the interval starts at zero.
    assert found.distance_low_m <= found.distance_m
    assert found.probability > 0.99


def test_two_that_are_near_and_fly_apart_are_nearest_now_but_not_together() -> None:
    (found,) = asked(snapshot([[0.0, 0.0, 200.0, 0.0], [-2e3, 0.0, -200.0, 0.0]])).encounters
    assert not found.together
    assert found.time_to_closest_s == 0.0


def test_tentative_tracks_are_counted_not_reported_and_coasting_ones_are_marked() -> None:
    near = [[1e3 * place, 0.0, 200.0, 0.0] for place in range(3)]
    scene = snapshot(near, [0.0, 30.0, 0.0])
    scene.rows["state"][2] = STATE_TENTATIVE
    found = asked(scene)
    assert (found.tracks, found.tracks_tentative, found.total) == (2, 1, 1)
    assert (found.encounters[0].first_state, found.encounters[0].second_state) == (
        "confirmed", "coasting",
    )  # fmt: skip
    assert found.encounters[0].second_age_s == 30.0


def test_tracks_without_state_or_without_update_are_not_included() -> None:
    scene = snapshot([[1e3 * place, 0.0, 200.0, 0.0] for place in range(3)])
    scene.rows["track_id"][1] = 7
    found = asked(scene._replace(rows=np.sort(scene.rows, order="track_id")))
    assert found.tracks == 2
    assert [(one.first_track_id, one.second_track_id) for one in found.encounters] == [(1, 3)]


def test_tracks_off_the_plane_are_counted_and_those_that_leave_it_meet_until_then() -> None:
    """The plane ends at 5 517 km: the second pair is beyond it when it would meet."""
    edge_m = 5.516e6
    scene = snapshot(
        [
            [edge_m + 1e5, 0.0, 0.0, 0.0],
            [edge_m - 3e3, 0.0, 300.0, 0.0],
            [edge_m - 3e3, 30e3, 300.0, -300.0],
            [edge_m - 60e3, 100e3, 300.0, 0.0],
            [edge_m - 60e3, 130e3, 300.0, -300.0],
        ]
    )
    found = asked(scene, distance_m=5e3)
    assert found.tracks_off_plane >= 1
    assert [(one.first_track_id, one.second_track_id) for one in found.encounters] == [(4, 5)]


def test_heights_of_different_kinds_or_unknown_are_not_compared() -> None:
    scene = snapshot([[1e3 * place, 0.0, 200.0, 0.0] for place in range(3)])
    assert scene.states.climbs is not None
    scene.states.climbs[1] = np.nan
    scene.states.climbs[2, -1] = 1.0  # Reported, and so perhaps geometric.
    found = asked(scene, height_m=300.0)
    assert found.total == 3, "unknown heights stay"
    assert {one.vertical_separation_m for one in found.encounters} == {None}
    assert {one.probability_both for one in found.encounters} == {None}
    bare = scene._replace(states=replace(scene.states, climbs=None))
    assert {one.first_height_m for one in asked(bare).encounters} == {None}


def test_those_far_apart_in_height_are_left_out_unless_they_climb_through() -> None:
    """They are within 9 260 m for a minute and a half: 1 200 m are 13 m/s away."""
    scene = snapshot([[0.0, 0.0, 100.0, 0.0], [12e3, -13e3, 0.0, 110.0]])
    assert scene.states.climbs is not None
    scene.states.climbs[1, 0] += 1200.0
    assert asked(scene).total == 1
    assert asked(scene, height_m=305.0).total == 0
    scene.states.climbs[1, 1] = -8.0
    (found,) = asked(scene, height_m=305.0).encounters
    assert found.probability_both is not None
    assert 0.3 < found.probability_both < found.probability


def test_the_order_and_the_least_probability_are_as_asked_for() -> None:
    rng = np.random.default_rng(3)
    states = np.column_stack([rng.uniform(-6e4, 6e4, (60, 2)), rng.normal(0.0, 150.0, (60, 2))])
    scene = snapshot(states.tolist())
    by_time = asked(scene, limit=10_000)
    times = [one.time_to_closest_s for one in by_time.encounters]
    assert by_time.total == by_time.count == len(times) > 50
    assert times == sorted(times)
    by_chance = asked(scene, limit=5, order="probability")
    assert all(one.probability > 0.99 for one in by_chance.encounters)
    # Without a vertical threshold, heights do not matter.
    every = [one for one in by_time.encounters if one.probability > 0.99]
    every.sort(key=lambda one: (one.time_to_closest_s, one.distance_m))
    assert by_chance.encounters == every[:5]
    percent = [
        np.ceil(100.0 * one.probability)
        for one in asked(scene, limit=10_000, order="probability").encounters
    ]
    assert percent == sorted(percent, reverse=True)
    assert (by_chance.count, by_chance.total) == (5, by_time.total)
    likely = asked(scene, limit=10_000, probability_min=0.9)
    assert likely.total == sum(one.probability >= 0.9 for one in by_time.encounters)


def test_of_equally_probable_pairs_the_nearest_of_known_height_is_first() -> None:
    """Three pairs in formation, far from each other; the second has no heights."""
    near = [(0.0, 2e3), (1e5, 200.0), (2e5, 900.0)]
    scene = snapshot([[x, y, 200.0, 0.0] for x, apart in near for y in (0.0, apart)])
    assert scene.states.climbs is not None
    scene.states.climbs[2:4] = np.nan
    found = asked(scene, height_m=305.0, order="probability").encounters
    assert [one.first_track_id for one in found] == [5, 1, 3]


def test_all_pairs_tried_one_by_one_give_the_same() -> None:
    """Straight flights from different times, all pairs: minimum distance on the plane below D."""
    rng = np.random.default_rng(4)
    count, distance_m, horizon_s = 120, 7e3, 95.0
    states = np.column_stack(
        [rng.uniform(-8e4, 8e4, (count, 2)), rng.normal(0.0, 150.0, (count, 2))]
    )
    states[5], states[7, 2:] = states[4], states[6, 2:]
    ages_s = rng.uniform(0.0, 12.0, count)
    ages_s[5] = ages_s[4]
    scene = snapshot(states.tolist(), ages_s.tolist())
    found = asked(scene, horizon_s=horizon_s, distance_m=distance_m, limit=10_000)
    places = states[:, :2] + ages_s[:, None] * states[:, 2:]
    least = {}
    for i in range(count):
        for j in range(i + 1, count):
            place, rate = places[j] - places[i], states[j, 2:] - states[i, 2:]
            square = float(rate @ rate)
            time_s = min(max(-float(place @ rate) / square, 0.0), horizon_s) if square else 0.0
            least[i + 1, j + 1] = float(np.hypot(*(place + time_s * rate)))
    # True metres at 9 km and up to 110 km from the centre are 0.14 to 0.16 % more.
    by_pair = {(one.first_track_id, one.second_track_id): one for one in found.encounters}
    assert {pair for pair, apart in least.items() if 1.0018 * apart < distance_m} <= set(by_pair)
    assert set(by_pair) <= {pair for pair, apart in least.items() if apart < distance_m}
    for pair, one in by_pair.items():
        if not one.together:
            assert one.distance_m == pytest.approx(least[pair], rel=1.8e-3)
    assert by_pair[5, 6].together
    assert by_pair[5, 6].distance_m == pytest.approx(0.0, abs=1e-6)


def test_what_the_biases_do_to_both_alike_does_not_part_them() -> None:
    """The bias of one radar is unobservable: neighbours have the same error of a kilometre."""
    radar = Radar("r", 50.0, 15.0, biases={0: 300.0, 1: np.radians(0.3)})
    east, north = 100e3, 100e3
    flights = [Flight(0.0, 120.0, (east + 2e3 * place, north, 200.0, 0.0)) for place in range(2)]
    scene = make_scene(np.random.default_rng(2), [radar], flights)
    engine, live = Engine(scene.sensors, TrackingSettings()), LiveTracks()
    for output in (engine.push(scene.batch), engine.flush()):
        live.update(rows_of(output.updates))
    states = engine.tracks()
    assert states.shared is not None
    seen = TrackSnapshot(float(scene.batch.time_s[-1]), live.all(), states)
    settings = TrackingSettings()
    rest = EncounterQuery(), engine.plane, settings, calibration_for(settings)
    (found,) = encounters(seen, *rest)["encounters"]
    alone = seen._replace(states=replace(states, shared=None))
    (apart,) = encounters(alone, *rest)["encounters"]
    position_m = float(np.sqrt(np.trace(states.covariance[0, :2, :2])))
    assert position_m > 800.0
    assert apart["distance_sigma_m"] > 600.0
    assert found["distance_sigma_m"] < 150.0
    assert abs(found["distance_m"] - 2e3) < 3.0 * found["distance_sigma_m"]


def test_an_error_that_tracks_share_moves_them_by_its_velocity_until_the_question() -> None:
    shared = np.array([[[300.0], [-40.0], [2.0], [5.0]], [[0.0], [0.0], [-1.0], [0.0]]])
    states = TrackStates(
        track_id=np.array([1, 2]), time_s=np.zeros(2), mean=np.zeros((2, 4)),
        covariance=np.array([covariance(50.0, 4.0)] * 2) + shared @ shared.swapaxes(-1, -2),
        height_m=np.full(2, np.nan), shared=shared,
    )  # fmt: skip
    ahead_s = np.array([10.0, 3.0])
    paths = _paths(calibration_for(TrackingSettings()), states, ahead_s, np.arange(0.0, 60.0, 10.0))
    np.testing.assert_allclose(
        paths.shared[..., 0], [[320.0, 10.0, 2.0, 5.0], [-3.0, 0.0, -1.0, 0.0]]
    )
    # The states are those of the tracker.
    assert shared[0, 0, 0] == 300.0


def _states_of(engine: Engine) -> tuple[TrackStates, SystemPlane]:
    return engine.tracks(), engine.plane


@pytest.mark.slow
@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
def test_a_row_of_the_table_is_what_was_answered_at_the_end_of_its_epoch(filter_name: str) -> None:
    """Queries at the ends of shortened streams, compared with the table of the whole.

    At the end forecasts of ten seconds have been evaluated, so that the calibration is used.
    """
    settings = TrackingSettings(filter_name=filter_name, reorder_horizon_s=0.0)
    batch, _ = measurement_batch(recording(2400).sort("time_s"), sensors())
    query = EncounterQuery(60.0, 12_000.0, 200.0, limit=None)
    engine = Engine(sensors(), settings, pictures=True, sampling=Sampling.ALL)
    table = EncounterTable(query, engine.plane, settings)
    parts = [
        table.update(engine.push(batch.select(slice(k, k + 530)))) for k in range(0, 2400, 530)
    ]
    rows = pl.concat([*parts, table.update(engine.flush()), table.finish()])
    ends_s = rows["time_s"].unique().sort().to_list()
    assert len(ends_s) == 30, "120 s have as many epochs"
    calibration = calibration_for(settings)
    short = Engine(sensors(), settings, sampling=Sampling.DRAWN)
    calibration.observe(short.push(batch))
    assert calibration.scores.calibrated_to_s >= 10.0
    for end_s in (ends_s[4], ends_s[-8], ends_s[-1]):
        publication = Publication(sensors(), settings, RuntimeLimits())
        view = publication.view
        assert answered(view, query)["time_s"] is None
        short = Engine(sensors(), settings, sampling=Sampling.DRAWN)
        publication.attach(partial(_states_of, short), dict)
        assert answered(view, query)["encounters"] == []
        publication.publish(short.push(batch.select(batch.time_s <= end_s)), end_s)
        publication.publish(short.flush(), end_s)
        answer = answered(view, query)
        assert answer["time_s"] == end_s
        assert answer["total"] > 3
        assert rows.filter(pl.col("time_s") == end_s).to_dicts() == answer["encounters"]


def answered(view: LiveView, query: EncounterQuery) -> dict[str, Any]:
    answer = view.ask(ENCOUNTERS, **asdict(query))
    assert answer is not None
    return answer


def test_a_table_warns_of_missing_pairs() -> None:
    """Of 320 aircraft above each other 51 040 pairs are near, and there is room for 50 000."""
    count = 320
    crowd = snapshot([[10.0 * k, 0.0, 0.0, 0.0] for k in range(count)]).states
    climbs = np.tile(LEVEL, (count, 1))
    climbs[:, 0] += 100.0 * np.arange(count)
    events = [Update(track, NOW_S, track) for track in range(1, count + 1)]
    picture = Picture(NOW_S, replace(crowd, climbs=climbs))
    table = EncounterTable(EncounterQuery(20.0, height_m=1.0, limit=None), PLANE, SETTINGS)
    table.update(output_of(events))
    assert table.warnings() == []
    rows = table.update(replace(output_of([]), pictures=(picture,)))
    assert rows.is_empty(), "none is near in height"
    (warning,) = table.warnings()
    # In either piece of the horizon.
    assert warning.startswith("encounters may be missing: 2080 pairs")


def test_no_tracks_have_no_encounters() -> None:
    empty = snapshot([])
    found = asked(empty)
    assert (found.tracks, found.total, found.time_s) == (0, 0, NOW_S)
    assert no_encounters(EncounterQuery())["encounters"] == []


@pytest.mark.parametrize(
    "wrong",
    [
        {"horizon_s": 1e-300}, {"horizon_s": 601.0}, {"horizon_s": float("nan")},
        {"distance_m": -1.0}, {"distance_m": 1e6}, {"height_m": 0.0}, {"height_m": float("nan")},
        {"probability_min": 1.5}, {"probability_min": float("nan")}, {"order": "name"},
        {"limit": 0}, {"limit": 10_001},
    ],
)  # fmt: skip
def test_a_parameter_out_of_bounds_is_rejected_with_its_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(ForecastError) as raised:
        EncounterQuery(**wrong)
    assert raised.value.parameter == next(iter(wrong))
