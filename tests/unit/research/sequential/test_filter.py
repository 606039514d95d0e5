"""Invalid input of the sequential filter is rejected by name."""

import doctest
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from multiradar.errors import (
    ConfigurationError,
    CovarianceError,
    PriorError,
    SensorPositionError,
    ShapeError,
    TimeOrderError,
    UnknownAircraftError,
    UnknownFilterError,
    UnknownParameterError,
)
from multiradar.estimation.filters.bank import Outcome
from multiradar.research.sequential import filter as filter_module
from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.filter import SequentialFilter
from multiradar.research.sequential.plots import Plots, Starts
from multiradar.research.sequential.sensors import BiasPrior, Sensors, earth_sensors, flat_radars
from support.scenarios.scenes import make_scene, random_flights, three_radars

SITES = [[0.0, 0.0], [50e3, 0.0]]
PRIOR = BiasPrior(np.zeros(4), np.diag([500.0, 0.005] * 2) ** 2)
STATE = [20e3, 30e3, 100.0, 0.0]
COVARIANCE = np.diag([1e3, 1e3, 50.0, 50.0]) ** 2


def radars() -> Sensors:
    return flat_radars(SITES, 15.0, 1e-3, PRIOR)


def started() -> SequentialFilter:
    one = SequentialFilter("two-stage", radars(), aircraft_max=1)
    one.start(7, 10.0, STATE, COVARIANCE)
    return one


def indefinite(size: int) -> np.ndarray:
    matrix = np.eye(size)
    matrix[0, 1] = matrix[1, 0] = 2.0
    return matrix


@pytest.mark.parametrize("matrix", [indefinite(4), np.triu(np.ones((4, 4))), np.eye(4) * np.nan])
def test_invalid_covariances_are_rejected(matrix: np.ndarray) -> None:
    one = started()
    before = one.aircraft(7)
    with pytest.raises(CovarianceError, match="aircraft"):
        one.start(7, 11.0, STATE, matrix)
    np.testing.assert_array_equal(one.aircraft(7)[1], before[1])
    with pytest.raises(CovarianceError, match="start covariances"):
        Starts([0.0], [STATE], [matrix])


def test_a_prior_is_checked() -> None:
    with pytest.raises(PriorError, match="above 0"):
        BiasPrior([0.0, 0.0], np.diag([1.0, 0.0]))
    with pytest.raises(PriorError, match="above 0"):
        BiasPrior([0.0], [[1.0]], [-1.0])
    with pytest.raises(CovarianceError, match="prior covariance"):
        BiasPrior(np.zeros(2), indefinite(2))
    with pytest.raises(ShapeError, match="prior covariance"):
        BiasPrior(np.zeros(2), np.eye(3))
    with pytest.raises(ShapeError, match="prior means"):
        BiasPrior([np.nan], [[1.0]])
    with pytest.raises(PriorError, match="range sigma"):
        flat_radars(SITES, 0.0, 1e-3, PRIOR)
    with pytest.raises(ShapeError, match="prior of the biases"):
        flat_radars(SITES, 15.0, 1e-3, BiasPrior(np.zeros(3), np.eye(3)))


@pytest.mark.parametrize(
    ("range_sigma", "azimuth_sigma", "named"),
    [
        (1e-200, 1e-3, "range sigma, m: expected 0.1 to 10000, was 1e-200"),
        (1e200, 1e-3, "range sigma"),
        (15.0, 1e-15, "azimuth sigma, rad: expected"),
        (15.0, np.nan, "azimuth sigma"),
    ],
)
def test_noise_is_within_the_bounds_of_radars(
    range_sigma: float, azimuth_sigma: float, named: str
) -> None:
    with pytest.raises(PriorError, match=named):
        flat_radars(SITES, range_sigma, azimuth_sigma, PRIOR)


@pytest.mark.parametrize(
    ("kind", "mean", "sigma", "drift", "named"),
    [
        (0, 0.0, 500.0, 1e200, r"drift of range_offset_m: expected 0 to 100, was 1e\+200"),
        (0, 0.0, 1e150, 0.0, "prior sigma of range_offset_m"),
        (0, 0.0, 1e-150, 0.0, "prior sigma of range_offset_m"),
        (0, 1e200, 500.0, 0.0, "prior mean of range_offset_m"),
        (1, 0.0, 2.0, 0.0, "prior sigma of azimuth_offset, rad: expected .* to 0.174533, was 2"),
        (1, 0.0, 0.01, 0.02, "drift of azimuth_offset, rad"),
        (2, -1.0, 0.01, 0.0, "prior mean of range_gain"),
        (3, 0.0, 0.5, 2.0, "drift of time_offset_s"),
    ],
)
def test_a_prior_is_within_the_bounds_of_radars(
    kind: int, mean: float, sigma: float, drift: float, named: str
) -> None:
    prior = BiasPrior([mean], [[sigma**2]], [drift])
    with pytest.raises(PriorError, match=named):
        flat_radars([[0.0, 0.0]], 15.0, 1e-3, prior, [kind])


def test_radars_exist_and_are_near_the_origin() -> None:
    with pytest.raises(ShapeError, match="at least one radar"):
        flat_radars(np.zeros((0, 2)), 15.0, 1e-3, BiasPrior([], np.zeros((0, 0))))
    with pytest.raises(ConfigurationError, match=r"site of radar 1: expected within 1e\+07 m"):
        flat_radars([[0.0, 0.0], [1e300, 0.0]], 15.0, 1e-3, PRIOR)
    with pytest.raises(ShapeError, match="prior covariance of the biases: expected numbers"):
        BiasPrior([0.0, 0.0], [[1.0, 0.0], [0.0]])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("downweight_nis", 0.0),
        ("refuse_nis", 0.99),
        ("acceleration_density", np.inf),
        ("acceleration_density", 1e308),
        ("acceleration_density", -1e-9),
        ("cone_ratio", 11.0),
        ("speed_sigma_mps", 0.0),
        ("ci_scale_time_s", np.nan),
    ],
)
def test_options_have_the_bounds_of_the_settings(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=f"{name}: expected"):
        Options(**{name: value})
    with pytest.raises(ShapeError, match=f"{name}: expected numbers, was 'low'"):
        Options(**{name: "low"})  # type: ignore[arg-type]


def test_a_radar_needs_a_position() -> None:
    with pytest.raises(SensorPositionError, match="radar 1"):
        flat_radars([[0.0, 0.0], [np.nan, 0.0]], 15.0, 1e-3, PRIOR)
    with pytest.raises(ShapeError, match="sites"):
        flat_radars([0.0, 0.0], 15.0, 1e-3, PRIOR)


def test_a_bias_parameter_must_be_known() -> None:
    with pytest.raises(UnknownParameterError, match=r"9.*0 \(range_offset_m\)"):
        flat_radars(SITES, 15.0, 1e-3, PRIOR, parameters=(0, 9))


def test_a_sensor_has_each_parameter_once() -> None:
    """Kernels hold four per sensor; more were once written out of bounds."""
    prior = BiasPrior(np.zeros(24), np.eye(24))
    with pytest.raises(ConfigurationError, match="sensor 0: expected range_offset_m once, found 6"):
        flat_radars(SITES, 15.0, 1e-3, prior, parameters=(0, 1) * 6)
    with pytest.raises(ConfigurationError, match="sensor 1: expected azimuth_offset_deg once"):
        replace(radars(), parameters=np.array([0, 1, 1, 1]))


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"prior": BiasPrior(np.zeros(2), np.eye(2))}, "prior of the biases"),
        ({"starts": np.array([0, 2, 6])}, "first parameter"),
        ({"starts": np.array([0, 4])}, "first parameter"),
        ({"site_numbers": np.array([0])}, "site numbers"),
        ({"sites": np.zeros((3, 2))}, "sites"),
        ({"noises": np.ones((1, 4))}, "noise"),
    ],
)
def test_the_arrays_of_the_sensors_match(changed: dict[str, Any], named: str) -> None:
    with pytest.raises(ShapeError, match=named):
        replace(radars(), **changed)


def test_a_sensor_measures_an_aircraft_once_at_a_time() -> None:
    """An epoch holds one plot of each sensor; forty of one were once written out of bounds."""
    with pytest.raises(ShapeError, match=r"aircraft 3 at 2\.0 s: expected at most one plot"):
        Plots([1.0] + [2.0] * 40, [3] * 41, [0] * 41, np.ones((41, 2)))
    with pytest.raises(ShapeError, match="at most one plot per sensor"):
        Plots([1.0] * 3, [0, 1, 0], [1, 1, 1], np.ones((3, 2)))
    assert len(Plots([1.0, 1.0, 1.0, 2.0], [0, 0, 1, 0], [0, 1, 0, 0], np.ones((4, 2)))) == 4


def test_a_radar_on_the_earth_needs_the_height_of_its_plots() -> None:
    """Without one the plot of an aircraft at 10 km would be placed on the ground."""
    rng = np.random.default_rng(1)
    scene = make_scene(rng, three_radars(), random_flights(rng, 1, 10.0))
    one = SequentialFilter("two-stage", earth_sensors(scene.sensors, scene.plane), aircraft_max=1)
    plot = [scene.batch.range_m[0], scene.batch.azimuth_rad[0]]
    for height_m in ([], [np.nan]):
        with pytest.raises(ShapeError, match="a height for every plot of a WGS 84 radar"):
            one.observe(0, 1.0, 0, plot, *height_m)
    with pytest.raises(ShapeError, match="finite numbers or NaN"):
        one.observe(0, 1.0, 0, plot, np.inf)
    assert one.observe(0, 1.0, 0, plot, 10e3) is Outcome.STARTED


@pytest.mark.parametrize("form", ["polar", "linearised"])
@pytest.mark.parametrize("name", ["two-stage", "joint", "blom"])
def test_a_negative_range_is_no_measurement(name: str, form: Any) -> None:
    one = SequentialFilter(name, radars(), form=form)
    one.start(7, 0.0, STATE, COVARIANCE)
    before = one.biases()
    assert one.observe(7, 0.0, 0, [-36_100.0, 0.59]) == Outcome.SINGULAR
    assert one.observe(8, 0.0, 0, [-36_100.0, 0.59]) == Outcome.UNLOCATABLE
    np.testing.assert_array_equal(one.biases()[0], before[0])
    np.testing.assert_array_equal(one.aircraft(7)[0], STATE)


def test_plots_without_initiation_use_no_slot() -> None:
    """Neither a rejected plot, nor one that cannot initiate an aircraft."""
    one = SequentialFilter("blom", radars(), aircraft_max=1)
    for aircraft in range(3):
        with pytest.raises(ShapeError, match="values"):
            one.observe(aircraft, 11.0, 0, [np.nan, 0.0])
        assert one.observe(aircraft, 11.0, 0, [-1.0, 0.0]) is Outcome.UNLOCATABLE
        with pytest.raises(UnknownAircraftError, match=f"aircraft {aircraft} is unknown"):
            one.aircraft(aircraft)
        with pytest.raises(UnknownAircraftError):
            one.end(aircraft)
    assert one.observe(5, 11.0, 0, [36_100.0, 0.59]) is Outcome.STARTED
    assert np.isfinite(one.aircraft(5)[0]).all()
    with pytest.raises(ConfigurationError, match="at most 1"):
        one.observe(6, 11.0, 0, [36_100.0, 0.59])


def test_times_do_not_go_back() -> None:
    one = started()
    one.observe(7, 11.0, 0, [36_100.0, 0.59])
    with pytest.raises(TimeOrderError, match=r"aircraft 7.*11.*10"):
        one.observe(7, 10.5, 0, [36_100.0, 0.59])
    with pytest.raises(TimeOrderError, match="walk"):
        one.walk(-1.0)
    with pytest.raises(TimeOrderError, match="plot"):
        Plots([1.0, 0.5], [0, 0], [0, 0], np.ones((2, 2)))


def test_shapes_and_indices_are_checked() -> None:
    one = started()
    with pytest.raises(ShapeError, match="state"):
        one.start(7, 0.0, [1.0, 2.0], COVARIANCE)
    with pytest.raises(ShapeError, match="value"):
        one.observe(7, 11.0, 0, [1.0, 2.0, 3.0])
    with pytest.raises(ShapeError, match="values"):
        one.observe(7, 11.0, 0, [np.nan, 0.0])
    with pytest.raises(ShapeError, match="sensors"):
        one.observe(7, 11.0, 5, [1e4, 0.0])
    with pytest.raises(ShapeError, match="at most one plot per sensor"):
        one.observe_together(7, 11.0, [0, 0], np.ones((2, 2)))
    with pytest.raises(ShapeError, match="aircraft"):
        Plots([1.0], [0.5], [0], np.ones((1, 2)))


def test_sensor_indices_must_be_integers() -> None:
    one = started()
    for sensor in (0.5, "a", True, -1, 2):
        with pytest.raises(ShapeError, match="plot sensors"):
            one.observe(7, 11.0, sensor, [36_100.0, 0.59])  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="aircraft number: expected an integer, was 'AB'"):
        one.observe("AB", 11.0, 0, [36_100.0, 0.59])  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="plot time: expected numbers, was 'noon'"):
        one.observe(7, "noon", 0, [36_100.0, 0.59])  # type: ignore[arg-type]


def test_a_bias_walk_is_at_most_a_year() -> None:
    one = started()
    year_s = 366.0 * 86_400.0
    one.walk(year_s)
    for duration_s in (np.nextafter(year_s, np.inf), 1e308):
        with pytest.raises(ConfigurationError, match=r"walk: expected at most 3\.16"):
            one.walk(duration_s)
    with pytest.raises(ShapeError, match="duration of the random walk: expected numbers"):
        one.walk("long")  # type: ignore[arg-type]


def test_excessive_numbers_of_aircraft_are_rejected() -> None:
    for number in (1.5, 0, True):
        with pytest.raises(ConfigurationError, match="aircraft_max: expected an integer of 1"):
            SequentialFilter("joint", radars(), aircraft_max=number)  # type: ignore[arg-type]
    for name, most in (("joint", 2891), ("two-stage", 1_242_756)):
        with pytest.raises(ConfigurationError, match=f"at most {most} with {name}, was"):
            SequentialFilter(name, radars(), aircraft_max=10**7)


def test_names_and_sizes_are_checked() -> None:
    with pytest.raises(UnknownFilterError, match="unknown filter '\\[\\]'"):
        SequentialFilter([], radars())  # type: ignore[arg-type]
    with pytest.raises(UnknownFilterError):
        SequentialFilter("kalman", radars())
    with pytest.raises(ConfigurationError, match="aircraft_max"):
        SequentialFilter("joint", radars(), aircraft_max=0)
    with pytest.raises(ConfigurationError, match="form"):
        SequentialFilter("joint", radars(), form="square")  # type: ignore[arg-type]
    one = started()
    with pytest.raises(ConfigurationError, match="at most 1"):
        one.start(8, 0.0, STATE, COVARIANCE)
    one.end(7)
    one.start(8, 0.0, STATE, COVARIANCE)
    assert one.observe(8, 1.0, 1, [42_400.0, 5.5]) == Outcome.UPDATED


def test_sensors_on_the_earth_are_filtered_too() -> None:
    """Slant ranges on WGS 84, by the two-stage and the joint filter alike."""
    rng = np.random.default_rng(1)
    scene = make_scene(rng, three_radars(), random_flights(rng, 1, 60.0))
    sensors = earth_sensors(scene.sensors, scene.plane)
    filters = [SequentialFilter(name, sensors) for name in ("joint", "two-stage")]
    batch = scene.batch
    for one in filters:
        one.start(0, float(batch.time_s[0]), scene.truth[0] + 100.0, np.eye(4) * 500.0**2)
        for row in range(len(batch)):
            value = [batch.range_m[row], batch.azimuth_rad[row]]
            one.observe(
                0, float(batch.time_s[row]), int(batch.sensor[row]), value,
                float(batch.height_m[row]),
            )  # fmt: skip
    mean, covariance = filters[0].aircraft(0)
    np.testing.assert_allclose(filters[1].aircraft(0)[0], mean, rtol=0, atol=1e-6)
    error = mean - scene.truth[len(batch) - 1]
    assert error @ np.linalg.solve(covariance, error) < 25.0


def test_the_docstring_example_is_correct() -> None:
    results = doctest.testmod(filter_module)
    assert results.attempted > 5
    assert results.failed == 0


@pytest.mark.parametrize("name", ["two-stage", "blom", "ci"])
def test_a_restarted_aircraft_equals_a_new_one(name: str) -> None:
    fresh, again = (SequentialFilter(name, radars(), aircraft_max=1) for _ in range(2))
    again.start(7, 10.0, STATE, COVARIANCE)
    for second in range(11, 30):
        # A manoeuvre: the plots depart from the course increasingly.
        east = STATE[0] + 100.0 * (second - 10)
        north = STATE[1] + 30.0 * (second - 10) ** 2
        value = [np.hypot(east, north), np.arctan2(east, north)]
        again.observe(7, float(second), 0, value)
    # With a single motion model the manoeuvre detection changes nothing.
    again._one.aircraft.fading_nis[:] = 3.0
    for one in (fresh, again):
        one.start(7, 40.0, STATE, COVARIANCE)
    found, expected = (one._one.aircraft for one in (again, fresh))
    for field, left, right in zip(found._fields, found, expected, strict=True):
        # The plots of the last epoch are not used.
        if field not in ("joint", "recent"):
            np.testing.assert_array_equal(left, right, field)
