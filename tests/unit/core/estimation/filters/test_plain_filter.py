"""Without biases the two-stage filter is the plain extended Kalman filter, to rounding.

`make bench` compares it with FilterPy and Stone Soup in the same way.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bank import Outcome
from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.filter import SequentialFilter
from multiradar.research.sequential.sensors import BiasPrior, flat_radars

Floats = NDArray[np.float64]

SITES_M = np.array([[0.0, 0.0], [120e3, -40e3]])
SIGMA = np.array([40.0, 0.001])
DENSITY = 4.0
PRIOR = np.diag([1e6, 1e6, 1e5, 1e5])


def test_two_stage_without_biases_is_the_plain_filter_after_every_plot() -> None:
    """Sixty plots of one aircraft by two radars, irregular: 1e-8 m, 1e-10 of the sigmas."""
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.0, 3.0, 60))
    radars = rng.integers(0, 2, 60)
    truth = np.array([-80e3, 30e3]) + np.array([180.0, -90.0]) * times[:, None]
    line = truth - SITES_M[radars]
    plots = np.column_stack([np.hypot(*line.T), np.arctan2(*line.T)])
    plots += rng.normal(size=plots.shape) * SIGMA
    none = BiasPrior(np.zeros(0), np.zeros((0, 0)))
    one = SequentialFilter(
        "two-stage", flat_radars(SITES_M, SIGMA[0], SIGMA[1], none, ()),
        options=Options(acceleration_density=DENSITY),
    )  # fmt: skip
    mean, covariance, last = np.array([-79e3, 31e3, 0.0, 0.0]), PRIOR, 0.0
    one.start(0, 0.0, mean, covariance)
    for time, radar, plot in zip(times, radars, plots, strict=True):
        assert one.observe(0, float(time), int(radar), plot) is Outcome.UPDATED
        mean, covariance = plain_step(mean, covariance, time - last, SITES_M[radar], plot)
        last = time
        state, spread = one.aircraft(0)
        sigma = np.sqrt(np.diagonal(covariance))
        np.testing.assert_allclose(state, mean, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(spread / np.outer(sigma, sigma),
                                   covariance / np.outer(sigma, sigma), atol=1e-10)  # fmt: skip
    assert np.hypot(*(mean[:2] - truth[-1])) < 4.0 * np.sqrt(covariance[0, 0] + covariance[1, 1])


def plain_step(
    mean: Floats, covariance: Floats, interval: float, site: Floats, plot: Floats
) -> tuple[Floats, Floats]:
    """The textbook step, with blocks for two axes, independent of the package."""
    motion = np.kron(np.array([[1.0, interval], [0.0, 1.0]]), np.eye(2))
    noise = np.array([[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]])
    mean = motion @ mean
    covariance = motion @ covariance @ motion.T + DENSITY * np.kron(noise, np.eye(2))
    east, north = mean[:2] - site
    length = np.hypot(east, north)
    matrix = np.array([
        [east / length, north / length, 0.0, 0.0],
        [north / length**2, -east / length**2, 0.0, 0.0],
    ])  # fmt: skip
    innovation = plot - [length, np.arctan2(east, north)]
    innovation[1] = np.angle(np.exp(1j * innovation[1]))
    gain = covariance @ matrix.T @ np.linalg.inv(matrix @ covariance @ matrix.T + np.diag(SIGMA**2))
    kept = np.eye(4) - gain @ matrix
    return (
        mean + gain @ innovation,
        kept @ covariance @ kept.T + gain @ np.diag(SIGMA**2) @ gain.T,
    )
