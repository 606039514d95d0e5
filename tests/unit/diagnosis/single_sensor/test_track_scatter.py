"""The noise of a radar by the scatter of its plots about smooth paths."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from multiradar.diagnosis.plots import Floats
from multiradar.diagnosis.single_sensor.track_scatter import track_scatter

SIGMA_M, SIGMA_DEG = 40.0, 0.06
NUMBER = 1


def _flown(time_s: Floats, course: float, turn: float, start: Floats) -> Floats:
    """Return places at 220 m/s on a course that turns by so much, rad and rad/s."""
    if turn == 0.0:
        return start + 220.0 * np.outer(time_s, [np.sin(course), np.cos(course)])
    angle = course + turn * time_s
    path = np.column_stack([-np.cos(angle) + np.cos(course), np.sin(angle) - np.sin(course)])
    return start + 220.0 / turn * path


def _scatter(
    sizes: list[int], *, between_s: tuple[float, ...] = (4.0,), turn: float = 0.0,
    wild: float = 0.0, copies: int = 0,
) -> tuple[float, float]:  # fmt: skip
    """Return what is found of tracks of so many plots, some of which are far off their paths."""
    random = np.random.default_rng(7)
    parts = []
    for track, size in enumerate(sizes):
        time_s = np.concatenate([[0.0], np.cumsum(np.resize(between_s, size - 1))])
        start = random.uniform(20e3, 90e3, 2)
        place = _flown(time_s, random.uniform(0.0, 6.0), turn, start)
        if track < wild * len(sizes):
            place += random.normal(0.0, 3000.0, place.shape)
        range_m = np.hypot(*place.T) + random.normal(0.0, SIGMA_M, size)
        azimuth = np.arctan2(*place.T) + np.radians(random.normal(0.0, SIGMA_DEG, size))
        parts.append(np.column_stack([np.full(size, track), time_s, range_m, azimuth]))
    track_id, time_s, range_m, azimuth = np.concatenate([*parts, *parts[:copies]]).T
    # Beside them, another radar with the same tracks, in another order.
    order = random.permutation(2 * len(track_id))
    columns = SimpleNamespace(
        sensor=np.repeat([NUMBER, 0], len(track_id))[order],
        time_s=np.tile(time_s, 2)[order],
        range_m=np.concatenate([range_m, 0.9 * range_m])[order],
        azimuth_rad=np.tile(azimuth, 2)[order],
    )
    tracked = SimpleNamespace(track_id=np.tile(track_id, 2)[order], measured=columns)
    evidence: Any = SimpleNamespace(tracked=lambda: tracked)
    return track_scatter(evidence, NUMBER)


@pytest.mark.parametrize("turn", [0.0, 0.0002])
def test_the_scatter_of_straight_flights_is_the_noise(turn: float) -> None:
    range_m, azimuth_deg = _scatter([60] * 20, turn=turn)
    assert range_m == pytest.approx(SIGMA_M, rel=0.1)
    assert azimuth_deg == pytest.approx(SIGMA_DEG, rel=0.1)


def test_plots_at_one_time_are_no_successive_plots() -> None:
    """Half of the tracks are in the recording twice."""
    range_m, azimuth_deg = _scatter([60] * 20, copies=10)
    assert range_m == pytest.approx(SIGMA_M, rel=0.15)
    assert azimuth_deg == pytest.approx(SIGMA_DEG, rel=0.15)


@pytest.mark.parametrize("how", [{"turn": 0.08}, {"wild": 0.4}])
def test_manoeuvres_are_no_noise(how: dict[str, float]) -> None:
    assert np.isnan(_scatter([60] * 20, **how)).all()  # type: ignore[arg-type]  # by name


@pytest.mark.parametrize(
    ("found", "known"),
    [
        # 15 residuals of each track of 19 plots: those of five plots, for the highest degree.
        (_scatter([19] * 10), True),
        (_scatter([19] * 9 + [18]), False),
        (_scatter([60] * 20, between_s=(4.0, 10.0)), True),
        (_scatter([60] * 20, between_s=(4.0, 10.1)), False),
        # Five plots in a minute.
        (_scatter([60] * 20, between_s=(15.0,)), True),
        (_scatter([60] * 20, between_s=(15.1,)), False),
    ],
)
def test_noise_needs_150_successive_plots(found: tuple[float, float], *, known: bool) -> None:
    assert np.isfinite(found).tolist() == [known, known]
