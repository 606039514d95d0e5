"""Positions by other sensors are interpolated within the path of one aircraft."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.cross_sensor.references import (
    GAP_MAX_S,
    SPEED_MAX_MPS,
    Paths,
    common_key,
    keys_by_sensor,
    named_pairs,
)
from multiradar.diagnosis.plots import Plots

Floats = NDArray[np.float64]
AIRCRAFT, OTHER, ADDRESS, CODE = 5, 7, 1, 2


# Plots of the aircraft at these times.
def plots_at(*time_s: float) -> Plots:
    nothing = np.full(len(time_s), np.nan)
    keys = np.full((len(time_s), 3), -1)
    keys[:, ADDRESS] = AIRCRAFT
    return Plots(
        time_s=np.array(time_s), range_m=nothing, azimuth_deg=nothing, latitude_deg=nothing,
        longitude_deg=nothing, height_m=nothing, keys=keys,
    )  # fmt: skip


# Paths of the aircraft and of others by one sensor, along one axis.
def paths_of(name: list[int], time_s: list[float], along_m: list[float]) -> Paths:
    names = np.array(name)
    position_m = np.column_stack([along_m, np.zeros(len(name)), np.zeros(len(name))])
    numbers = np.cumsum(np.diff(names, prepend=names[:1]) != 0)
    return Paths(numbers, names, np.zeros(len(name), np.int64), np.array(time_s), position_m)


@pytest.mark.parametrize("beside", [[], [OTHER]])
def test_a_plot_after_the_path_of_its_aircraft_has_no_position(beside: list[int]) -> None:
    # The other flies on where and when the path of the aircraft ends.
    number = 2 * len(beside)
    paths = paths_of(
        [AIRCRAFT] * 2 + beside * 2,
        [10.0, 20.0, 25.0, 35.0][: 2 + number],
        [2000.0, 4000.0, 5000.0, 7000.0][: 2 + number],
    )
    plots = plots_at(10.0, np.nextafter(10.0, 11.0), 15.0, 20.0, np.nextafter(20.0, 21.0), 22.0)
    found = named_pairs(plots, [(ADDRESS, paths)], 0.0)
    assert found.plot.tolist() == [1, 2, 3]
    np.testing.assert_allclose(found.position_m[:, 0], [2000.0, 3000.0, 4000.0])
    np.testing.assert_allclose(found.velocity_mps, [[200.0, 0.0, 0.0]] * 3)
    assert found.name.tolist() == [AIRCRAFT] * 3
    # A late clock.
    late = named_pairs(plots, [(ADDRESS, paths)], 2.0)
    assert late.plot.tolist() == [2, 3, 4, 5]


@pytest.mark.parametrize(("more_s", "known"), [(0.0, 1), (0.001, 0)])
def test_gaps_are_interpolated_up_to_their_limit(more_s: float, known: int) -> None:
    paths = paths_of([AIRCRAFT] * 2, [0.0, GAP_MAX_S + more_s], [0.0, 6000.0])
    assert named_pairs(plots_at(15.0), [(ADDRESS, paths)], 0.0).size == known


@pytest.mark.parametrize(("more_m", "known"), [(0.0, 1), (0.1, 0)])
def test_paths_faster_than_an_aircraft_are_none(more_m: float, known: int) -> None:
    paths = paths_of([AIRCRAFT] * 2, [0.0, 10.0], [0.0, 10.0 * SPEED_MAX_MPS + more_m])
    assert named_pairs(plots_at(5.0), [(ADDRESS, paths)], 0.0).size == known


# Plots with these identities: track number, address and code; -1 for none.
def named(*keys: tuple[int, int, int]) -> Plots:
    nothing = np.full(len(keys), np.nan)
    return Plots(
        np.zeros(len(keys)), nothing, nothing, nothing, nothing, nothing, np.array(keys)
    )  # fmt: skip


def test_the_key_that_half_of_the_plots_share_names_them() -> None:
    own = named((-1, 5, 1), (-1, 6, 1), (-1, -1, 1), (-1, -1, 2))
    assert common_key(own, [named((-1, 5, -1)), named((-1, 6, -1))]) == ADDRESS
    assert common_key(own, [named((-1, 5, -1))]) is None
    assert common_key(own, [named((-1, 5, 1))]) == CODE
    # Plots without an address share none.
    assert common_key(own, [named((-1, -1, 9))]) is None
    assert common_key(own, []) is None
    assert common_key(own.select(np.arange(0)), [own]) is None


def test_a_sensor_without_the_common_key_is_compared_by_its_own() -> None:
    own = named((-1, 5, 1), (-1, 6, 2))
    others = {
        3: named((-1, 5, 1), (-1, 6, 2)), 4: named((-1, -1, 1), (-1, -1, 2)), 5: named((-1, -1, 7)),
    }  # fmt: skip
    assert keys_by_sensor(own, others) == {3: ADDRESS, 4: CODE, 5: ADDRESS}
    assert keys_by_sensor(own, {5: others[5]}) is None
