"""Arcs through triples of plots of the initial window."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.restoration.bundle.initial_arcs import TRIPLE_OFF_M, arcs_through_triples
from multiradar.restoration.control_tracks.tracks import ControlTrack, whole_seconds
from support.scenarios.flown import flight, plots_of

Floats = NDArray[np.float64]
TIMES = np.arange(0.0, 31.0, 3.0)


@pytest.mark.parametrize("lateral", [0.0, 2.0, -3.5])
def test_without_noise_the_arc_is_the_flight(lateral: float) -> None:
    flown = flight(((0.0, lateral),))
    places = flown.geometric(TIMES).position_m
    arc = arcs_through_triples(TIMES, places)[0]
    found = ControlTrack(
        np.array([arc.east_m, arc.north_m, arc.speed_mps, arc.heading_rad]),
        np.array([arc.time_s]), np.array([arc.lateral_mps2]), np.zeros(1),
    )  # fmt: skip
    grid = whole_seconds(0.0, 30.0)
    off = found.geometric(grid).position_m - flown.geometric(grid).position_m
    assert np.hypot(*off.T).max() < 1e-3
    assert arc.lateral_mps2 == pytest.approx(lateral, abs=1e-6)
    assert arc.speed_mps == pytest.approx(180.0, abs=1e-4)
    assert arc.deviation_s < 1e-4


def test_the_best_arc_has_the_least_deviations_in_time() -> None:
    plots = plots_of(flight(((0.0, 2.0),)), 31.0, np.random.default_rng(2), interval_s=3.0)
    arcs = arcs_through_triples(plots.time_s, plots.position_m)
    deviations = [arc.deviation_s for arc in arcs]
    assert deviations == sorted(deviations)
    assert len(arcs) > 5
    # Eleven plots deviating by 0.3 s of flight along it; the arc passes through three of them.
    assert deviations[0] < 8.0 * 0.3


def test_a_wrong_plot_is_in_no_good_triple() -> None:
    flown = flight(((0.0, 1.0),))
    places = flown.geometric(TIMES).position_m
    places[5] += [1500.0, 0.0]
    best = arcs_through_triples(TIMES, places)[0]
    assert best.lateral_mps2 == pytest.approx(1.0, abs=0.01)


def test_triples_are_wide_in_time_and_place() -> None:
    flown = flight(((0.0, 0.0),), speed_mps=60.0)
    times = np.arange(0.0, 26.0, 2.0)
    # 800 m take 13.3 s at this speed: three plots within 26 s are too close.
    assert arcs_through_triples(times, flown.geometric(times).position_m) == []
    close = np.array([0.0, 7.9, 15.8])
    assert arcs_through_triples(close, flight(((0.0, 0.0),)).geometric(close).position_m) == []
    enough = np.array([0.0, 8.0, 16.0])
    wide = flight(((0.0, 0.0),)).geometric(enough).position_m
    assert len(arcs_through_triples(enough, wide)) == 1


def test_a_motion_too_far_from_its_plots_is_not_an_arc() -> None:
    times = np.array([0.0, 10.0, 20.0])
    # A line with its middle plot so far ahead that constant speed misses the plots by more or less
    # than the limit: by 1/6, 1/3 and 1/6 of the second difference of the distances.
    for ahead, count in ((0.9 * 1.5 * TRIPLE_OFF_M, 1), (1.1 * 1.5 * TRIPLE_OFF_M, 0)):
        places = np.array([[0.0, 0.0], [2000.0 + ahead, 0.0], [4000.0, 0.0]])
        assert len(arcs_through_triples(times, places)) == count


def arc_of(time_s: Floats, places: Floats, all_s: Floats, all_m: Floats) -> list[float] | None:
    """The arc through three plots in plain NumPy: speed, lateral acceleration, deviations."""
    sides = np.array([places[1] - places[0], places[2] - places[1], places[2] - places[0]])
    lengths = np.hypot(*sides.T)
    if np.diff(time_s).min() < 8.0 or lengths.min() < 800.0:
        return None
    curvature = 2.0 * (sides[0, 1] * sides[1, 0] - sides[0, 0] * sides[1, 1]) / lengths.prod()
    heading = np.arctan2(*sides[0]) - np.arcsin(np.clip(0.5 * lengths[0] * curvature, -1.0, 1.0))

    def ways(at: Floats) -> Floats:
        ahead = (at - places[0]) @ [np.sin(heading), np.cos(heading)]
        right = (at - places[0]) @ [np.cos(heading), -np.sin(heading)]
        if abs(curvature) < 1e-7:
            return np.asarray(ahead)
        return np.asarray(np.arctan2(ahead * curvature, 1.0 - right * curvature) / curvature)

    way, since = ways(places), time_s - time_s[0]
    speed, offset = np.polyfit(since, way, 1)
    off = np.abs(offset + speed * since - way).max()
    if not (way[2] > way[1] > 0.0) or not 20.0 <= speed <= 700.0 or off > TRIPLE_OFF_M:
        return None
    late = np.abs(time_s[0] + (ways(all_m) - offset) / speed - all_s).sum()
    return [float(speed), float(curvature * speed**2), float(late)]


@pytest.mark.parametrize("sigma", [50.0, 600.0])
def test_the_arcs_are_those_of_the_plain_form(sigma: float) -> None:
    plots = plots_of(
        flight(((0.0, 1.5),)), 31.0, np.random.default_rng(3), interval_s=2.5, sigma_m=sigma
    )
    time_s, places = plots.time_s, plots.position_m
    plain = [
        arc_of(time_s[list(rows)], places[list(rows)], time_s, places)
        for rows in combinations(range(len(plots)), 3)
    ]
    expected = sorted((one for one in plain if one is not None), key=lambda one: one[-1])
    found = [
        [arc.speed_mps, arc.lateral_mps2, arc.deviation_s]
        for arc in arcs_through_triples(time_s, places)
    ]
    assert 20 < len(found) < len(plain)
    assert np.array(found) == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)


def test_without_plots_there_is_no_arc() -> None:
    assert arcs_through_triples(np.zeros(0), np.zeros((0, 2))) == []
    assert arcs_through_triples(np.zeros(3), np.zeros((3, 2))) == []
