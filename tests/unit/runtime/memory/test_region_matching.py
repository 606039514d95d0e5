"""Tracks of a neighbour are compared with own tracks near them, with the result of all pairs."""

import tracemalloc
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.runtime.memory.regions import matching
from multiradar.runtime.memory.regions.rows import OTHER_DTYPE, OWN_DTYPE
from multiradar_schemas.products.handover import TRACKS_MAX

_EARTH_M = 6_371_008.8


def traffic(
    count: int, other_count: int, corner_deg: tuple[float, float], size_deg: tuple[float, float]
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Aircraft in an area, of which each region has tracks with other errors, ages and fields."""
    random = np.random.default_rng(3)
    every = max(count, other_count)
    latitude = np.radians(corner_deg[0] + size_deg[0] * random.random(every))
    longitude = np.radians(corner_deg[1] + size_deg[1] * random.random(every))
    heading, speed_mps = random.uniform(0.0, 6.3, every), random.uniform(80.0, 260.0, every)

    def tracks(kind: np.dtype[np.void], number: int) -> NDArray[np.void]:
        rows, one = np.zeros(number, kind), random.permutation(every)[:number]
        rows["track_id"] = np.arange(number) + 1
        old = random.random(number) < 0.1
        age_s = random.exponential(3.0, number) + old * random.uniform(0.0, 60.0, number)
        rows["time_s"] = 1000.0 - age_s
        rows["east_mps"] = speed_mps[one] * np.sin(heading[one]) + random.normal(0.0, 5.0, number)
        rows["north_mps"] = speed_mps[one] * np.cos(heading[one]) + random.normal(0.0, 5.0, number)
        east_m, north_m = random.normal(0.0, 100.0, (2, number))
        north_m -= rows["north_mps"] * age_s
        east_m -= rows["east_mps"] * age_s
        rows["latitude_rad"] = latitude[one] + north_m / _EARTH_M
        rows["longitude_rad"] = longitude[one] + east_m / _EARTH_M / np.cos(latitude[one])
        turn = (rows["longitude_rad"] + np.pi) % (2.0 * np.pi) - np.pi
        rows["longitude_rad"] = turn
        rows["position_m2"] = random.lognormal(9.0, 1.5, number)[:, None] * [1.0, 0.4, 1.2]
        rows["velocity_m2ps2"] = random.lognormal(3.0, 1.0, number)
        rows["height_m"] = np.where(random.random(number) < 0.3, np.nan, 3000.0 + one % 9 * 500.0)
        rows["mode_3a"] = np.where(random.random(number) < 0.6, -1, one % 4096)
        rows["mode_s_address"] = np.where(random.random(number) < 0.6, -1, one)
        return rows

    own = tracks(OWN_DTYPE, count)
    own["position_m2"][3], own["latitude_rad"][4], own["velocity_m2ps2"][5] = np.nan, np.nan, 1e9
    return own, tracks(OTHER_DTYPE, other_count)


def every_pair(
    own: NDArray[np.void], others: NDArray[np.void], _held: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield all pairs."""
    rows, columns = np.indices((len(others), len(own))).reshape(2, -1)
    yield rows, columns


@pytest.mark.parametrize(
    ("corner_deg", "size_deg"),
    [
        ((49.0, 9.0), (0.5, 0.8)), ((45.0, 5.0), (8.0, 10.0)), ((-1.0, 179.5), (2.0, 1.0)),
        ((88.9, -180.0), (1.0, 360.0)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("at_once", [100, 50_000])
def test_tracks_match_as_by_all_pairs(
    corner_deg: tuple[float, float], size_deg: tuple[float, float], at_once: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(matching, "PAIRS_AT_ONCE", at_once)
    own, others = traffic(200, 170, corner_deg, size_deg)
    found = others.copy()
    # Of a second message, some pairs match already.
    matching.match(own, found)
    found["time_s"] += 1.0
    again = found.copy()
    matching.match(own, again)
    assert np.count_nonzero(again["own_id"]) > 100
    monkeypatch.setattr(matching, "candidates", every_pair)
    expected = others.copy()
    matching.match(own, expected)
    assert np.array_equal(found["own_id"], expected["own_id"])
    expected["time_s"] += 1.0
    matching.match(own, expected)
    assert np.array_equal(again["own_id"], expected["own_id"])


def test_the_largest_message_is_compared_with_the_tracks_near_its_own() -> None:
    """All pairs of 3000 and 2000 tracks took 2.2 s and 1 GB."""
    own, others = traffic(3000, TRACKS_MAX, (45.0, 5.0), (8.0, 10.0))
    pairs = sum(len(rows) for rows, _ in matching.candidates(own, others, others["own_id"]))
    assert pairs < 0.01 * len(own) * len(others)
    tracemalloc.start()
    matching.match(own, others)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    assert np.count_nonzero(others["own_id"]) > 2900
