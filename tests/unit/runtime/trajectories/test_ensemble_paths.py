"""A forecast from a bundle has members, or a reason if there is none."""

import numpy as np
import pytest

from multiradar.errors import ForecastError, TrajectoryError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.forecast.settings import AHEAD_MAX_S
from multiradar.runtime.trajectories.ensemble_paths import (
    MEMBERS_MAX,
    ensemble_path,
    member_documents,
)
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar_schemas.products.forecast import ForecastMember
from support.scenarios.flown import flight, plots_of

PLANE = SystemPlane(np.radians(50.0), np.radians(15.0))
NOW_S = 96.0
AHEAD_S = np.array([0.0, 10.0, 60.0, 300.0])


@pytest.fixture(scope="module")
def reading() -> Reading:
    bundle = Bundle(BundleSettings())
    bundle.push_all(plots_of(flight(((0.0, 0.0), (75.0, 2.5))), 97.0, np.random.default_rng(5)))
    return Reading(bundle, 65, 9000.0)


def test_members_are_bounded_and_of_sum_one(reading: Reading) -> None:
    course = ensemble_path(reading, NOW_S + AHEAD_S, 0.95)
    documents = member_documents(course, PLANE, 9000.0)
    assert len(course.ensemble) > MEMBERS_MAX
    for each in documents:
        members = [ForecastMember.model_validate(one) for one in each]
        assert 1 <= len(members) <= MEMBERS_MAX + 1
        assert sum(one.weight for one in members) == pytest.approx(1.0)
        weights = [one.weight for one in members if one.trajectory is not None]
        assert weights == sorted(weights, reverse=True)
    # At first no manoeuvre has started, at last the rest is merged into one.
    assert {one["later"] for one in documents[0]} <= {"straight", None}
    assert documents[-1][-1]["trajectory"] is None
    assert all(one["trajectory"] is not None for one in documents[-1][:-1])


def test_the_members_have_the_mean_of_the_ensemble(reading: Reading) -> None:
    course = ensemble_path(reading, NOW_S + AHEAD_S, 0.95)
    for k, each in enumerate(member_documents(course, PLANE, 9000.0)):
        latitude_rad, longitude_rad = (
            np.radians([one[name] for one in each]) for name in ("latitude_deg", "longitude_deg")
        )
        places = np.stack(PLANE.to_plane(latitude_rad, longitude_rad), axis=-1)
        mean = np.array([one["weight"] for one in each]) @ places
        np.testing.assert_allclose(mean, course.means[k], atol=0.01)


def test_a_region_grows_with_its_probability(reading: Reading) -> None:
    half, most = (ensemble_path(reading, NOW_S + AHEAD_S, one).factors for one in (0.5, 0.95))
    assert np.all(most > half)
    # Of a mixture, not of one Gaussian.
    assert np.abs(most / gaussian_factor(0.95) - 1.0).max() > 0.1


def test_a_time_too_far_ahead_is_rejected(reading: Reading) -> None:
    with pytest.raises(ForecastError, match="expected at most 720 s") as error:
        ensemble_path(reading, np.array([NOW_S, NOW_S + AHEAD_MAX_S + 1.0]), 0.95)
    assert error.value.parameter == "horizon_s"


def test_a_bundle_without_tracks_has_a_reason() -> None:
    with pytest.raises(TrajectoryError) as error:
        ensemble_path(Reading(Bundle(BundleSettings()), 0, np.nan), np.array([0.0]), 0.95)
    assert error.value.code == "TOO_FEW_PLOTS"


def test_members_outside_the_plane_are_left_out(reading: Reading) -> None:
    course = ensemble_path(reading, NOW_S + AHEAD_S, 0.95)
    course.members.state[1:, 0, :2] = 1e9
    every = [int(np.sum(weights > 0.0)) for weights in course.members.weight]
    documents = [len(each) for each in member_documents(course, PLANE, 9000.0)]
    assert documents == [every[0], *(count - 1 for count in every[1:])]


def test_members_without_weight_are_left_out(reading: Reading) -> None:
    course = ensemble_path(reading, NOW_S + AHEAD_S, 0.95)
    every = [len(each) for each in member_documents(course, PLANE, 9000.0)]
    course.members.weight[1, 0] = 0.0
    documents = [len(each) for each in member_documents(course, PLANE, 9000.0)]
    assert documents == [every[0], every[1] - 1, *every[2:]]
