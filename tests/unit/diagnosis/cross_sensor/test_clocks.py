"""Clock errors by the places on the paths of aircraft, and times of whole scans."""

from typing import cast

import numpy as np
import pytest
from numpy.typing import ArrayLike

from multiradar.diagnosis.cross_sensor.clocks import check_clock, late_on_paths
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.displacements import displacement
from multiradar.diagnosis.cross_sensor.references import Paths
from multiradar.diagnosis.cross_sensor.registration import Registration
from multiradar.diagnosis.plots import Floats, Plots

OWN, OTHER = 0, 1
#: Time between the plots of a path, and how far an aircraft flies in it.
STEP_S, STEP_M = 10.0, 2000.0


def _plots(time_s: Floats, names: int = 7) -> Plots:
    none = np.full(len(time_s), np.nan)
    keys = np.full((len(time_s), 3), -1, np.int64)
    keys[:, 0] = names
    return Plots(np.asarray(time_s, np.float64), none, none, none, none, none, keys)


class _OnPath:
    """A straight path of one aircraft by another sensor, and plots of a sensor beside it."""

    numbers = (OWN, OTHER)

    def __init__(self, time_s: Floats, step: Floats, across_m: Floats, path: int = 500) -> None:
        self._plots = _plots(time_s)
        self._position_m = np.column_stack([STEP_M * step, across_m, np.zeros(len(step))])
        rows = np.arange(path)
        position_m = np.column_stack([STEP_M * rows, np.zeros(path), np.zeros(path)])
        self._paths = Paths(
            0 * rows, 0 * rows + 7, 0 * rows + 1, np.asarray(STEP_S * rows, np.float64), position_m
        )

    def tested(self, _: int) -> Plots:
        return self._plots

    def plots(self, _: int) -> Plots:
        return _plots(self._paths.time_s)

    def tested_positions(self, _: int) -> Floats:
        return self._position_m

    def paths_by(self, _: int, _key: int) -> Paths:
        return self._paths


def _late(
    late_s: ArrayLike, across_m: ArrayLike = 0.0, *, first: int = 1, path: int = 500
) -> float:
    """Return the offset found of plots that are late by so much at their places on a path."""
    late = np.asarray(late_s, np.float64)
    step = first + np.arange(late.size, dtype=np.float64)
    beside = np.array(np.broadcast_to(np.asarray(across_m, np.float64), late.size))
    on_path = _OnPath(STEP_S * step + late, step, beside, path)
    return late_on_paths(cast(Comparison, on_path), OWN, [OWN, OTHER])


def _across(on_path: int, count: int, off_m: float = 3001.0) -> Floats:
    return np.where(np.arange(count) < on_path, 3000.0, off_m)


@pytest.mark.parametrize(
    ("count", "on_path", "known"),
    [(20, 20, True), (19, 19, False), (60, 24, True), (60, 23, False), (50, 20, True)],
)
def test_places_on_paths_are_40_per_cent_and_20(count: int, on_path: int, *, known: bool) -> None:
    found = _late(np.full(count, 33.0), _across(on_path, count))
    assert found == (33.0 if known else 0.0)


@pytest.mark.parametrize(("alike", "known"), [(30, True), (29, False)])
def test_most_places_have_one_offset(alike: int, *, known: bool) -> None:
    """Of 50; the others are farther apart than that of a scan."""
    late_s = np.where(np.arange(50) < alike, 33.0, 100.0 + 20.0 * np.arange(50))
    assert _late(late_s) == (33.0 if known else 0.0)


@pytest.mark.parametrize(("apart_s", "found"), [(14.9, 33.0 + 14.9 / 2.0), (15.1, 0.0)])
def test_offsets_within_a_scan_are_one(apart_s: float, found: float) -> None:
    assert _late(33.0 + apart_s * (np.arange(50) % 2)) == pytest.approx(found)


def test_places_beyond_the_end_of_a_path_do_not_count() -> None:
    """Of 21 plots one is at an end."""
    assert _late(np.full(21, 33.0), first=0) == 33.0
    assert _late(np.full(20, 33.0), first=0) == 0.0
    assert _late(np.full(20, 33.0), first=1, path=22) == 33.0
    assert _late(np.full(20, 33.0), first=1, path=21) == 0.0


def test_without_names_in_common_there_is_no_offset() -> None:
    on_path = _OnPath(np.arange(40.0), np.arange(40.0), np.zeros(40))
    on_path._plots.keys[:] = -1
    assert late_on_paths(cast(Comparison, on_path), OWN, [OTHER]) == 0.0


# Three plots of each scan on average, and 2 s between two scans.
@pytest.mark.parametrize(
    ("scans", "each", "period_s", "code"),
    [
        (10, 3, 2.0, "time_of_scan"),
        (10, 3, 1.9, "clock"),
        (10, 2, 2.0, "clock"),
        (1, 30, 2.0, "clock"),
        (2, 3, 2.0, "time_of_scan"),
    ],
)
def test_all_plots_of_a_scan_have_one_time(
    scans: int, each: int, period_s: float, code: str
) -> None:
    wrong = Registration(time_offset_s=3.0)
    plots = _plots(np.repeat(period_s * np.arange(scans), each))
    assert [one.code for one in check_clock("1-10", wrong, 0.0, plots)] == [code]
    assert check_clock("1-10", Registration(), 0.0, plots) == []


@pytest.mark.parametrize(("distance_m", "text"), [
    (9990.0, "9.99 km north"), (10_000.0, "10.0 km north"), (10_040.0, "10.0 km north"),
])  # fmt: skip
def test_displacements_below_10_km_have_a_digit_more(distance_m: float, text: str) -> None:
    assert displacement(distance_m, 0.0) == text


@pytest.mark.parametrize(("azimuth_deg", "course"), [
    (22.4, "north"), (22.6, "north-east"), (-22.6, "north-west"), (337.6, "north"),
    (179.0, "south"),
])  # fmt: skip
def test_directions_are_the_nearest_of_eight(azimuth_deg: float, course: str) -> None:
    assert displacement(1000.0, np.radians(azimuth_deg)) == f"1.00 km {course}"
