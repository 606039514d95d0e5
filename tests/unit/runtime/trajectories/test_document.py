"""The document of a bundle: on whole seconds, in true metres, or a reason if there is none."""

import numpy as np
import pytest

from multiradar.errors import TrajectoryError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.runtime.offline.trajectory_table import table_row
from multiradar.runtime.queries.parameters import PATH_POINTS
from multiradar.runtime.trajectories.document import trajectories_of
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.runtime.trajectories.pool import Reading
from multiradar_schemas.products.trajectories import TRAJECTORY_SCHEMA, Trajectories
from support.scenarios.flown import S_SHAPE, flight, plots_of

POINTS_MAX = int(PATH_POINTS.most)
PLANE = SystemPlane(np.radians(50.0), np.radians(15.0))
SETTINGS = trajectory_options(1, 1, 4.0, 2.0).bundle
NOISE = 2500.0 * np.eye(2)


@pytest.fixture(scope="module")
def reading() -> Reading:
    bundle = Bundle(SETTINGS)
    bundle.push_all(plots_of(flight(S_SHAPE), 150.0, np.random.default_rng(5)))
    return Reading(bundle, 90, 9000.0)


def test_the_document_matches_the_schema(reading: Reading) -> None:
    document = trajectories_of(7, reading, PLANE, 120, 1)
    answer = Trajectories.model_validate({**document, "state": "coasting", "age_s": 12.0})
    assert (answer.track_id, answer.plots, answer.height_m) == (7, 90, 9000.0)
    begin_s, now_s = reading.bundle.window_s
    assert (answer.window_begin_s, answer.time_s, answer.estimate.time_s) == (
        begin_s, now_s, now_s,
    )  # fmt: skip
    weights = [one.weight for one in answer.trajectories]
    assert weights == sorted(weights, reverse=True)
    assert sum(weights) == pytest.approx(1.0)
    for one in answer.trajectories:
        assert one.segments[0].begin_s == begin_s
        assert one.segments[-1].end_s is None
        ends = [segment.end_s for segment in one.segments[:-1]]
        assert ends == [segment.begin_s for segment in one.segments[1:]]
    now = answer.estimate
    chances = (
        now.straight_probability + now.right_probability + now.left_probability
        + now.faster_probability + now.slower_probability
    )  # fmt: skip
    assert chances == pytest.approx(1.0)
    covariance = np.array(now.covariance).reshape(4, 4)
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)
    assert now.position_sigma_m == pytest.approx(np.sqrt(np.trace(covariance[:2, :2])))
    assert now.speed_mps == pytest.approx(np.hypot(now.velocity_east_mps, now.velocity_north_mps))
    assert answer.weighted[-1].time_s == np.floor(now_s)


@pytest.mark.parametrize(
    ("points", "step_s", "expected"),
    [
        (POINTS_MAX, 1, 91),
        (5, 1, 5),
        (0, 1, 0),
        (POINTS_MAX, 60, 2),
        (1, 10, 1),
    ],
)
def test_the_last_points_are_at_multiples_of_the_step(
    reading: Reading, points: int, step_s: int, expected: int
) -> None:
    document = trajectories_of(1, reading, PLANE, points, step_s)
    times = [point["time_s"] for point in document["weighted"]]
    assert times == [point["time_s"] for point in document["best"]]
    assert len(times) == pytest.approx(expected, abs=1 if points == POINTS_MAX else 0)
    assert all(time % step_s == 0.0 for time in times)
    begin_s, now_s = reading.bundle.window_s
    assert all(begin_s <= time <= now_s for time in times)
    if times:
        assert times[-1] > now_s - step_s


def test_far_from_the_centre_positions_and_velocities_are_true_ones() -> None:
    """At 500 km a metre of the plane is 1.003 m on the ground away from the centre."""
    flown = plots_of(flight(((0.0, 0.0),)), 100.0, np.random.default_rng(3))
    bundle = Bundle(SETTINGS)
    for row in range(len(flown)):
        place = flown.position_m[row] + np.array([5e5, 0.0])
        bundle.push(float(flown.time_s[row]), place, flown.covariance_m2[row])
    now = bundle.estimate()
    document = trajectories_of(1, Reading(bundle, 9, np.nan), PLANE, 0, 1)
    matrix = PLANE.local_matrix(now.state[0], now.state[1], 0.0)
    velocity, found = matrix @ now.state[2:], document["estimate"]
    place = np.degrees(PLANE.to_geodetic(now.state[0], now.state[1]))
    assert document["height_m"] is None
    assert (found["latitude_deg"], found["longitude_deg"]) == pytest.approx(place)
    # The plane turns north by 5° there.
    assert (found["velocity_east_mps"], found["velocity_north_mps"]) == pytest.approx(velocity)
    assert found["speed_mps"] == pytest.approx(float(np.hypot(*velocity)))
    assert found["speed_mps"] > 1.002 * now.speed_mps


def test_too_few_plots_and_plots_without_a_triple_have_reasons() -> None:
    bundle, nothing = Bundle(SETTINGS), Bundle(SETTINGS)
    for number in range(3):
        if number < 2:
            bundle.push(10.0 * number, [2000.0 * number, 0.0], NOISE)
        nothing.push(10.0 * number, [7.0 * number, 0.0], NOISE)
    for one, code in ((bundle, "TOO_FEW_PLOTS"), (nothing, "NO_TRIPLE")):
        with pytest.raises(TrajectoryError) as error:
            trajectories_of(1, Reading(one, 3, 0.0), PLANE, 120, 1)
        assert error.value.code == code


def test_a_light_aircraft_is_followed_too() -> None:
    """30 m/s: 800 m take 27 s, of which two lie in the initial window."""
    bundle = Bundle(SETTINGS)
    random = np.random.default_rng(4)
    for time_s in np.arange(0.0, 80.0, 5.0):
        bundle.push(time_s, np.array([30.0 * time_s, 0.0]) + random.normal(0.0, 50.0, 2), NOISE)
    assert bundle.estimate().speed_mps == pytest.approx(30.0, abs=6.0)


def test_a_path_out_of_the_plane_has_a_reason() -> None:
    bundle = Bundle(SETTINGS)
    for number in range(8):
        bundle.push(10.0 * number, [2000.0 * number, 7e6], NOISE)
    with pytest.raises(TrajectoryError) as error:
        trajectories_of(1, Reading(bundle, 8, 0.0), PLANE, 120, 1)
    assert error.value.code == "NO_PLACE"


def test_a_row_of_the_table_has_the_same_numbers(reading: Reading) -> None:
    document = trajectories_of(7, reading, PLANE, 120, 5)
    row = table_row(document)
    assert set(TRAJECTORY_SCHEMA) - set(row) == {"reason"}
    assert row["weights"] == [one["weight"] for one in document["trajectories"]]
    assert row["speed_mps"] == document["estimate"]["speed_mps"]
    assert row["time_s"] == document["time_s"]
    second = [place for place, one in enumerate(row["segment_trajectory"]) if one == 1]
    kinds = [row["segment_kind"][place] for place in second]
    assert kinds == [one["kind"] for one in document["trajectories"][1]["segments"]]
    assert row["best_latitude_deg"] == [point["latitude_deg"] for point in document["best"]]
    assert row["point_time_s"] == [point["time_s"] for point in document["weighted"]]
    assert row["weighted_heading_deg"] != row["best_heading_deg"]
