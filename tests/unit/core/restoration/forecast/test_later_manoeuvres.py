"""Moments of later manoeuvres equal those of simulated flights."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.restoration.forecast.later_manoeuvres import (
    STEP_S,
    later_turn_moments,
    rounded_duration_s,
)
from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings

Floats = NDArray[np.float64]


def flown(straight_s: float, settings: ForecastSettings, until_s: float) -> Floats:
    """Displacements and directions (n, 4) at unit speed, with a first turn to the right."""
    rng = np.random.Generator(np.random.PCG64(9))
    count, step = 20000, 0.5
    turns_s = straight_s / settings.later_turns
    rates = np.array(settings.turn_rates_rad_per_s)
    place, heading = np.zeros(count, np.complex128), np.zeros(count)
    rate, turned = np.zeros(count), np.zeros(count, np.bool_)
    for _ in range(int(until_s / step)):
        # The mean direction of the step, as of an arc.
        middle = heading + 0.5 * step * rate
        place += step * np.exp(1j * middle) * np.sinc(0.5 * step * rate / np.pi)
        heading += step * rate
        straight = rate == 0.0
        ends = rng.uniform(size=count) < step / np.where(straight, turns_s, settings.turn_s)
        side = np.where(turned, rng.choice([-1.0, 1.0], count), 1.0)
        starting = straight & ends
        rate = np.where(starting, side * rng.choice(rates, count), np.where(ends, 0.0, rate))
        turned |= starting
    way = np.exp(1j * heading)
    return np.column_stack([place.real, place.imag, way.real, way.imag])[turned]


@pytest.mark.slow
@pytest.mark.parametrize("until_s", [60.0, 300.0])
def test_moments_equal_those_of_simulated_flights(until_s: float) -> None:
    settings = ForecastSettings()
    expected = later_turn_moments(100.0, settings)[int(until_s / STEP_S)]
    drawn = flown(100.0, settings, until_s)
    sigma = drawn.std(axis=0) / np.sqrt(len(drawn))
    # With steps of half a second turns start and end a quarter of a second late on average.
    slack = np.array([0.3, 0.3, 0.005, 0.005])
    assert np.all(np.abs(expected[:4] - drawn.mean(axis=0)) < 4.0 * sigma + slack)
    spread = np.cov(drawn.T)[np.triu_indices(4)]
    size = np.sqrt(np.outer(drawn.var(axis=0), drawn.var(axis=0)))[np.triu_indices(4)]
    # Some thousand flights give a variance to 2 %; the quarter of a second is 4 % of a minute.
    assert np.abs((expected[4:] - spread) / size).max() < 0.08


def test_tabulated_covariances_are_valid() -> None:
    table = later_turn_moments(rounded_duration_s(100.0), ForecastSettings())
    assert len(table) == AHEAD_MAX_S / STEP_S + 1
    rows, columns = np.triu_indices(4)
    spread = np.zeros((len(table), 4, 4))
    spread[:, rows, columns] = spread[:, columns, rows] = table[:, 4:]
    values = np.linalg.eigvalsh(spread)
    # To rounding: the first covariances are small.
    assert np.all(values[:, 0] > -1e-9 * np.maximum(values[:, -1], 1.0))
    assert table[0].tolist() == [0.0, 0.0, 1.0, *[0.0] * 11]


def test_a_table_that_is_shared_is_not_writeable() -> None:
    table = later_turn_moments(rounded_duration_s(100.0), ForecastSettings())
    with pytest.raises(ValueError, match="read-only"):
        table[0, 0] = 1.0


def test_durations_are_rounded_to_few_and_bounded() -> None:
    for duration_s in (10.0, 55.0, 100.0, 3000.0):
        assert rounded_duration_s(duration_s) == pytest.approx(duration_s, rel=0.07)
    assert len({rounded_duration_s(one) for one in np.geomspace(10.0, 1e5, 1000)}) < 80
    assert rounded_duration_s(1e-9) == pytest.approx(10.0, rel=0.07)
    assert rounded_duration_s(1e9) == pytest.approx(1e5, rel=0.07)
