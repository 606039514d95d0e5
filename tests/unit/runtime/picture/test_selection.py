"""Too many tracks are thinned evenly over the area, the same ones each time."""

import numpy as np

from multiradar.runtime.picture.selection import WORLD, Area, inside, selected
from multiradar.tracking.outputs import STATE_CONFIRMED, STATE_TENTATIVE


def test_an_area_may_cross_the_antimeridian() -> None:
    longitudes = np.array([170.0, 179.9, -179.9, -170.0, 0.0])
    latitudes = np.full(5, 10.0)
    found = inside(Area(175.0, 0.0, -175.0, 20.0), latitudes, longitudes)
    assert found.tolist() == [False, True, True, False, False]
    assert inside(WORLD, latitudes, longitudes).all()
    assert not inside(Area(175.0, 0.0, -175.0, 5.0), latitudes, longitudes).any()


def test_the_budget_is_spread_over_the_area_and_the_choice_stays() -> None:
    random = np.random.default_rng(5)
    # A dense crowd in one corner, and few aircraft elsewhere.
    crowd = random.uniform(0.0, 0.1, (2, 3000))
    others = random.uniform(0.2, 10.0, (2, 40))
    latitude, longitude = np.concatenate([crowd, others], axis=1)
    state = np.full(len(latitude), STATE_CONFIRMED, np.int8)
    area = Area(0.0, 0.0, 10.0, 10.0)
    found = selected(area, latitude, longitude, state, budget=200)
    assert len(found) == 200
    assert (np.diff(found) > 0).all()
    assert set(range(3000, 3040)) <= set(found.tolist())
    moved = selected(area, latitude + 1e-6, longitude + 1e-6, state, budget=200)
    assert moved.tolist() == found.tolist()


def test_tentative_tracks_come_last() -> None:
    latitude = longitude = np.linspace(1.0, 9.0, 100)
    state = np.where(np.arange(100) % 2 == 0, STATE_TENTATIVE, STATE_CONFIRMED).astype(np.int8)
    found = selected(Area(0.0, 0.0, 10.0, 10.0), latitude, longitude, state, budget=50)
    assert (state[found] == STATE_CONFIRMED).all()


def test_all_tracks_of_the_area_are_kept_within_the_budget() -> None:
    latitude, longitude = np.array([1.0, 20.0, 3.0]), np.array([1.0, 1.0, 4.0])
    state = np.zeros(3, np.int8)
    assert selected(Area(0.0, 0.0, 10.0, 10.0), latitude, longitude, state).tolist() == [0, 2]
