"""The bounds of covariance intersection cover the true covariance, of aircraft and of biases.

A thousand random joint covariances with any cross-covariance: with the gain that the kernels used
the true covariance follows from (1.40) and (1.41), signs as corrected; it must lie below the bound.
"""

import numpy as np

from multiradar.estimation.bias._kernels import fold_biases
from multiradar.estimation.filters._kernels import LOG_BIASES, LOG_COUNT
from multiradar.estimation.filters.separated._separated_kernels import intersect

CASES = 1000
UPPER = np.triu_indices(4)
SCALE = np.array([1.0, 1.0, 0.1, 0.1, 1.0, 1e-5]) * 300.0


def triple(matrix: np.ndarray) -> tuple[float, float, float]:
    return float(matrix[0, 0]), float(matrix[0, 1]), float(matrix[1, 1])


def joint_case(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """True joint covariance of aircraft and biases, H, J, W: from no to full correlation."""
    factors = int(rng.integers(1, 7))
    root = rng.normal(size=(6, factors)) * SCALE[:, None] * 10 ** rng.uniform(-1.5, 0.5, (6, 1))
    covariance = root @ root.T + np.diag((1e-3 * SCALE) ** 2)
    azimuth, slant = rng.uniform(0.0, 6.28), 10 ** rng.uniform(4.0, 5.5)
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    by_state = np.zeros((2, 4))
    by_state[:, :2] = [[sine, cosine], [cosine / slant, -sine / slant]]
    noise = np.diag([10 ** rng.uniform(1.0, 4.0), 10 ** rng.uniform(-8.0, -5.0)])
    return covariance, by_state, np.eye(2), noise


def assert_below(true: np.ndarray, bound: np.ndarray) -> None:
    scale = 1.0 / np.sqrt(np.diagonal(bound))
    least = np.linalg.eigvalsh((bound - true) * np.outer(scale, scale))[0]
    assert least >= -1e-9


def corrected(
    covariance: np.ndarray, gain: np.ndarray, own: slice, matrices: tuple[np.ndarray, ...]
) -> np.ndarray:
    """(1.40) of one part: its error is (I − K C) e − K C′ e′ − K w."""
    by_state, by_bias, noise = matrices
    seen = np.hstack([by_state, by_bias])
    keep = np.eye(6)[own] - gain @ seen
    return np.asarray(keep @ covariance @ keep.T + gain @ noise @ gain.T)


def test_the_bound_of_an_aircraft_holds_for_any_cross_covariance() -> None:
    rng = np.random.default_rng(40)
    changed = 0
    for _ in range(CASES):
        covariance, by_state, by_bias, noise = joint_case(rng)
        state, bias = covariance[:4, :4], covariance[4:, 4:]
        seen = state @ by_state.T
        # The kernel is linear in the innovation: two of them determine its gain.
        gain = np.empty((4, 2))
        for column, innovation in enumerate(np.eye(2)):
            means, packed = np.zeros((1, 4)), state[UPPER][None].copy()
            intersect(
                0, triple(by_state @ seen), triple(by_bias @ bias @ by_bias.T), triple(noise),
                tuple(packed[0].tolist()), tuple(seen.ravel().tolist()), float(innovation[0]),
                float(innovation[1]), 10.0,
                means, packed,
            )  # fmt: skip
            gain[:, column] = means[0]
        bound = np.zeros((4, 4))
        bound[UPPER] = packed[0]
        bound += np.triu(bound, 1).T
        assert_below(corrected(covariance, gain, slice(0, 4), (by_state, by_bias, noise)), bound)
        changed += bool(gain.any())
    assert changed > CASES // 4


def test_the_bound_of_the_biases_holds_for_any_cross_covariance() -> None:
    rng = np.random.default_rng(41)
    changed = 0
    for _ in range(CASES):
        covariance, by_state, by_bias, noise = joint_case(rng)
        state, bias = covariance[:4, :4], covariance[4:, 4:]
        gain = np.empty((2, 2))
        for column, innovation in enumerate(np.eye(2)):
            log = np.zeros((1, LOG_COUNT))
            log[0, :2] = innovation
            log[0, 2:5] = triple(by_state @ state @ by_state.T)
            log[0, 5:8] = triple(noise)
            log[0, LOG_BIASES : LOG_BIASES + 4] = by_bias.T.ravel()
            estimate, bound = np.zeros(2), bias.copy()
            fold_biases(
                log, np.array([0]), np.array([0, 2]), 1.0 / np.diagonal(bias).copy(), estimate,
                bound,
            )  # fmt: skip
            gain[:, column] = estimate
        assert_below(corrected(covariance, gain, slice(4, 6), (by_state, by_bias, noise)), bound)
        changed += bool(gain.any())
    assert changed > CASES // 4
