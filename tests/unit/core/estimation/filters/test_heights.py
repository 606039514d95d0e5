"""Quantised, garbled and mixed heights, and their effect on the biases."""

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import (
    ASSUMED_HEIGHT,
    ASSUMED_HEIGHT_SIGMA,
    EXACT_HEIGHTS,
    OPTION_COUNT,
    STARTED,
    UPDATED,
)
from multiradar.estimation.filters.height import _height_kernels as heights
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from support.kernels import plain

Floats = NDArray[np.float64]

HUNDRED_FEET = 30.48
TWENTY_FIVE_FEET = 7.62
NO_HEIGHT = float("nan")
check_height = heights.check_height
update_height = heights.update_height


class Height(NamedTuple):
    """The arrays of the height of one aircraft."""

    height: Floats
    vertical: Floats
    options: Floats

    def hear(
        self,
        time_s: float,
        measured_m: float,
        *,
        dt: float = 5.0,
        kind: int = KIND_RADAR,
        sensor: int = 0,
        begins: bool = False,
    ) -> tuple[int, float, float]:
        """Process a plot; return the result, and the height and variance for its slant range."""
        turn = STARTED if begins else UPDATED
        dt = np.nan if begins else dt
        look: tuple[int, float, float] = check_height(
            turn, kind, measured_m, sensor, time_s, dt, 0, self.height, self.vertical, self.options
        )
        update_height(
            look, kind, measured_m, sensor, time_s, dt, 0, self.height, self.vertical, self.options
        )
        return look

    @property
    def state(self) -> tuple[float, float]:
        return float(self.height[0]), float(self.vertical[0, heights.RATE])

    @property
    def variances(self) -> tuple[float, float]:
        variance = float(heights.height_variance(0, self.vertical))
        return variance, float(self.vertical[0, heights.P11])


def unheard(*, exact: bool = False) -> Height:
    found = Height(np.empty(1), np.empty((1, heights.VERTICAL_COUNT)), np.zeros(OPTION_COUNT))
    found.options[ASSUMED_HEIGHT], found.options[ASSUMED_HEIGHT_SIGMA] = 8000.0, 3000.0
    found.options[EXACT_HEIGHTS] = exact
    heights.reset_height(0, found.height, found.vertical)
    return found


def level(height_m: float = 10_058.4, *, plots: int = 20, sensor: int = 0) -> Height:
    found = unheard()
    for number in range(plots):
        found.hear(5.0 * number, height_m, begins=number == 0, sensor=sensor)
    return found


# True heights and rates of climb: legs of 40 to 120 s, half of them level.
def climb(rng: np.random.Generator, times: Floats) -> tuple[Floats, Floats]:
    knots, rates = [0.0], []
    while knots[-1] < times[-1]:
        knots.append(knots[-1] + rng.uniform(40.0, 120.0))
        rates.append(rng.choice([0.0, 1.0]) * rng.uniform(-13.0, 13.0))
    way = np.concatenate([[0.0], np.cumsum(np.diff(knots) * rates)]) + rng.uniform(4e3, 9e3)
    leg = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(rates) - 1)
    return np.interp(times, knots, way), np.array(rates)[leg]


@pytest.mark.parametrize(("step_m", "rms_m"), [(HUNDRED_FEET, 9.5), (TWENTY_FIVE_FEET, 4.5)])
def test_height_and_rate_of_climb_are_consistent(step_m: float, rms_m: float) -> None:
    rng = np.random.default_rng(5)
    by_height, by_rate, errors = [], [], []
    for _ in range(30):
        times = np.cumsum(rng.uniform(1.0, 6.0, 150))
        true, rate = climb(rng, times)
        one = unheard()
        for number, time_s in enumerate(times):
            dt = time_s - times[number - 1]
            one.hear(time_s, step_m * round(true[number] / step_m), dt=dt, begins=number == 0)
            if number < 5:
                continue
            (height, climbing), (variance, rate_variance) = one.state, one.variances
            errors.append(height - true[number])
            by_height.append((height - true[number]) ** 2 / variance)
            by_rate.append((climbing - rate[number]) ** 2 / rate_variance)
    # Straight legs with sharp ends are not the white acceleration of the filter.
    assert 0.7 < np.mean(by_height) < 1.4
    assert 0.5 < np.mean(by_rate) < 1.5
    assert np.sqrt(np.mean(np.square(errors))) < rms_m


def test_the_variance_in_level_flight_is_at_least_that_of_the_step() -> None:
    coarse, fine = level(), level(10_058.4 + TWENTY_FIVE_FEET)
    assert coarse.variances[0] == pytest.approx(HUNDRED_FEET**2 / 12.0, rel=0.05)
    assert fine.variances[0] >= TWENTY_FIVE_FEET**2 / 12.0
    assert fine.variances[0] < 10.0
    assert abs(coarse.state[1]) < 1e-9


def test_quantisation_steps_belong_to_the_sensor() -> None:
    one = level(10_058.4 + TWENTY_FIVE_FEET, sensor=3)
    _, height, variance = one.hear(100.0, 10_058.4, sensor=3)
    assert height == 10_058.4
    assert variance == pytest.approx(TWENTY_FIVE_FEET**2 / 12.0 + 4.0)
    _, _, coarse = one.hear(105.0, 10_058.4, sensor=2)
    assert coarse == pytest.approx(HUNDRED_FEET**2 / 12.0 + 4.0)


@pytest.mark.parametrize("wrong_m", [-3048.0, -152.4, 152.4, 1524.0])
def test_one_garbled_height_is_ignored(wrong_m: float) -> None:
    garbled, silent = level(), level()
    result, height, variance = garbled.hear(100.0, 10_058.4 + wrong_m)
    silent.hear(100.0, NO_HEIGHT)
    assert result == heights.REJECTED_HEIGHT
    assert height == pytest.approx(10_058.4)
    assert variance < 16.0**2
    assert (garbled.state, garbled.variances) == (silent.state, silent.variances)


def test_inconsistent_garbled_heights_are_ignored() -> None:
    one = level()
    for number, wrong in enumerate([900.0, -1500.0, 3000.0, -700.0, 2000.0]):
        assert one.hear(100.0 + 5.0 * number, 10_058.4 + wrong)[0] == heights.REJECTED_HEIGHT
    assert one.state[0] == pytest.approx(10_058.4)


def test_the_third_consistent_outlier_initialises_the_height() -> None:
    one = level()
    found = [one.hear(100.0 + 5.0 * number, 7010.4 + 30.48 * number)[0] for number in range(3)]
    assert found == [heights.REJECTED_HEIGHT, heights.REJECTED_HEIGHT, heights.INITIATED]
    assert one.state[0] == pytest.approx(7071.36)
    assert one.hear(115.0, 7101.84)[0] == heights.ACCEPTED


def test_a_missing_height_is_predicted_with_growing_variance() -> None:
    one = unheard()
    for number in range(20):
        one.hear(5.0 * number, 5000.0 + 50.0 * number, begins=number == 0)
    found = [one.hear(100.0 + 5.0 * number, NO_HEIGHT) for number in range(12)]
    variances = [variance for _, _, variance in found]
    assert variances == sorted(variances)
    assert found[0][1] == pytest.approx(6000.0, abs=10.0)
    assert found[-1][1] == pytest.approx(6550.0, abs=3.0 * np.sqrt(variances[-1]))
    assert variances[-1] > 100.0**2


def test_a_height_older_than_its_prior_is_discarded() -> None:
    one = level()
    one.hear(1000.0, NO_HEIGHT, dt=900.0)
    assert np.isnan(one.height[0])
    assert one.hear(1005.0, NO_HEIGHT)[1:] == (8000.0, 3000.0**2)


def test_reported_heights_do_not_mix_with_mode_c() -> None:
    one = level(9144.0)
    for number in range(5):
        result, height, _ = one.hear(100.0 + number, 9400.0, dt=1.0, kind=KIND_POSITION)
        assert result == heights.NOTHING
        assert height == pytest.approx(9144.0, abs=1.0)
    # Used after a minute without Mode C; the rate of climb is kept.
    one.vertical[0, heights.RATE] = 2.0
    assert one.hear(170.0, 9400.0, dt=1.0, kind=KIND_POSITION)[0] == heights.INITIATED
    assert one.state == (9400.0, 2.0)
    assert one.hear(175.0, 9144.0)[0] == heights.INITIATED
    assert one.state == (9144.0, 2.0)


def test_reported_heights_do_not_wait_for_a_height_of_the_surface() -> None:
    """After take-off: a surface radar gave the height of its site until a moment before."""
    one = unheard()
    for number in range(10):
        one.hear(float(number), 100.0, dt=1.0, kind=heights.KIND_SURFACE, begins=number == 0)
    assert one.hear(10.0, 115.0, dt=1.0, kind=KIND_POSITION)[0] == heights.INITIATED
    for number in range(11, 40):
        one.hear(float(number), 100.0 + 15.0 * (number - 9), dt=1.0, kind=KIND_POSITION)
    assert one.state == pytest.approx((550.0, 15.0), abs=15.0)
    # Mode C replaces them, and then they wait.
    assert one.hear(40.0, 500.0, dt=1.0)[0] == heights.INITIATED
    assert one.hear(41.0, 580.0, dt=1.0, kind=KIND_POSITION)[0] == heights.NOTHING


def informs(one: Height, look: tuple[int, float, float], slant_m: float) -> bool:
    noises = np.array([[40.0**2, 1e-6, 0.0, 300.0]])
    found = heights.height_informs(
        look, KIND_RADAR, slant_m, 0, 0, one.height, one.vertical, noises
    )
    return bool(found)


def test_accurate_heights_let_a_plot_contribute_to_biases() -> None:
    one = unheard()
    assert not informs(one, one.hear(0.0, NO_HEIGHT, begins=True), 80e3)
    assert not informs(one, one.hear(5.0, 9144.0), 80e3)
    assert informs(one, one.hear(10.0, 9144.0), 80e3)
    assert informs(one, one.hear(15.0, NO_HEIGHT), 80e3)
    assert not informs(one, one.hear(20.0, 6096.0), 80e3)
    assert not informs(one, one.hear(25.0, NO_HEIGHT), 80e3)
    assert informs(one, one.hear(30.0, 9144.0), 80e3)
    assert not informs(one, one.hear(90.0, NO_HEIGHT, dt=60.0), 80e3)


def test_near_a_radar_a_coarse_height_is_not_accurate_enough() -> None:
    # The error of the range is 8.8 km / 15 km of 9 m: more than a tenth of 40 m.
    coarse, fine = level(9144.0), level(9144.0 + TWENTY_FIVE_FEET)
    assert not informs(coarse, coarse.hear(100.0, 9144.0), 15e3)
    assert informs(fine, fine.hear(100.0, 9144.0 + TWENTY_FIVE_FEET), 15e3)


def test_exact_heights_are_not_filtered() -> None:
    one = unheard(exact=True)
    assert one.hear(0.0, 9001.0, begins=True)[1:] == (9001.0, 0.0)
    assert one.hear(5.0, 2000.0)[1:] == (2000.0, 0.0)
    assert one.hear(500.0, NO_HEIGHT, dt=495.0)[1:] == (2000.0, 0.0)
    assert one.variances == (0.0, 0.0)
    assert np.isnan(heights.reportable_rate(0, one.vertical))


def test_compiled_check_equals_the_plain_form() -> None:
    rng = np.random.default_rng(3)
    one, other = unheard(), unheard()
    slow_look, slow_keep = plain(check_height), plain(update_height)
    for number in range(60):
        measured = rng.choice([NO_HEIGHT, 9144.0, 9144.0 + 7.62 * rng.integers(-9, 9), 3048.0])
        look = one.hear(5.0 * number, measured, begins=number == 0)
        dt = np.nan if number == 0 else 5.0
        slow = slow_look(
            STARTED if number == 0 else UPDATED, KIND_RADAR, measured, 0, 5.0 * number, dt, 0,
            other.height, other.vertical, other.options,
        )  # fmt: skip
        slow_keep(
            slow, KIND_RADAR, measured, 0, 5.0 * number, dt, 0, other.height, other.vertical,
            other.options,
        )  # fmt: skip
        np.testing.assert_allclose(look, slow, rtol=1e-12)
    np.testing.assert_allclose(one.vertical, other.vertical, rtol=1e-9)
