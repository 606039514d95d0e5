"""The plane of a manoeuvre: maximum likelihood, rejection, and its rate."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import chi2

from multiradar.errors import ConfigurationError, CovarianceError, PlaneError, ShapeError
from multiradar.restoration.geometry.manoeuvre_plane import (
    LEVEL,
    POINTS_MIN,
    ManoeuvrePlane,
    fit_plane,
    fit_proportional,
)

Floats = NDArray[np.float64]

NORMAL = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
COVARIANCE = np.array([[900.0, 200.0, -30.0], [200.0, 400.0, 20.0], [-30.0, 20.0, 64.0]])


def circle(count: int, radius_m: float = 3000.0) -> Floats:
    """Points on part of a circle across `NORMAL`, far from the origin."""
    across = np.linalg.svd(NORMAL[None, :])[2][1:].T
    angle = np.linspace(0.0, 3.0, count)
    flat = radius_m * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(np.array([40e3, -25e3, 9e3]) + flat @ across.T)


def noisy(points: Floats, covariances: Floats, rng: np.random.Generator) -> Floats:
    """The points with errors of their covariances."""
    drawn = rng.standard_normal(points.shape)
    return np.asarray(points + np.einsum("nij,nj->ni", np.linalg.cholesky(covariances), drawn))


def turned(count: int, rng: np.random.Generator) -> Floats:
    """Covariances of radars in all directions: not proportional."""
    angle = rng.uniform(0.0, np.pi, count)
    cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros(count)
    turn = np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, zero + 1.0]])
    turn = turn.transpose(2, 0, 1)
    return np.asarray(turn @ np.diag([30.0**2, 200.0**2, 8.0**2]) @ turn.transpose(0, 2, 1))


def functional(parameters: Floats, points: Floats, covariances: Floats) -> float:
    """(1.12): the sum of (a − ⟨n, x⟩)² / ⟨D n, n⟩, by two angles of n and a."""
    tilt, azimuth, distance = parameters
    n = np.array([np.sin(tilt) * np.sin(azimuth), np.sin(tilt) * np.cos(azimuth), np.cos(tilt)])
    variance = np.einsum("i,nij,j->n", n, covariances, n)
    return float((((distance - points @ n) ** 2) / variance).sum())


def searched(points: Floats, covariances: Floats) -> float:
    """The minimum of (1.12) by a search without eigenvectors."""
    middle = points.mean(axis=0)
    start = [np.arccos(NORMAL[2]), np.arctan2(NORMAL[0], NORMAL[1]), 0.0]
    found = minimize(
        functional, start, args=(points - middle, covariances), method="Nelder-Mead",
        options={"xatol": 1e-10, "fatol": 1e-10, "maxiter": 5000, "maxfev": 5000},
    )  # fmt: skip
    return float(found.fun)


def test_exact_points_give_their_plane() -> None:
    """The normal to rounding, 1e-12 rad at 3 km; the distance to 1e-7 m at 50 km."""
    points = circle(50)
    for plane in (
        fit_proportional(points, COVARIANCE),
        fit_plane(points, np.broadcast_to(COVARIANCE, (50, 3, 3))),
    ):
        assert plane.normal == pytest.approx(NORMAL, abs=1e-11)
        assert plane.distance_m == pytest.approx(float(points[0] @ NORMAL), abs=1e-6)
        assert plane.statistic < 1e-12
        assert plane.p_value == 1.0
        assert plane.positions_m == pytest.approx(points, abs=1e-6)


def test_the_eigenproblem_has_the_least_value_of_the_functional() -> None:
    """Λ is the minimum of (1.2), at the normal, for D that is not diagonal."""
    rng = np.random.default_rng(1)
    scales = 1.0 + np.arange(30) % 3
    covariances = scales[:, None, None] ** 2 * COVARIANCE
    points = noisy(circle(30), covariances, rng)
    plane = fit_proportional(points, COVARIANCE, scales)
    assert plane.statistic == pytest.approx(searched(points, covariances), rel=1e-7)
    again = fit_plane(points, covariances)
    assert again.statistic == pytest.approx(plane.statistic, rel=1e-9)
    assert again.normal == pytest.approx(plane.normal, abs=1e-8)


def procedure_of_paper(
    points: Floats, covariance: Floats, scales: Floats
) -> tuple[Floats, float, float]:
    """Normal, distance and Λ word by word: (1.5), D = h M hᵀ, R (1.7), g_k, (1.6), (1.7)."""
    weights = scales**-2
    total = weights @ points
    q = np.einsum("n,ni,nj->ij", weights, points, points) - np.outer(total, total) / weights.sum()
    m, h = np.linalg.eigh(covariance)
    root = np.diag(m**-0.5)
    values, g = np.linalg.eigh(root @ h.T @ q @ h @ root)
    normal = h @ root @ g[:, 0]
    normal *= np.sign(normal[2]) / np.linalg.norm(normal)
    return normal, float(normal @ total / weights.sum()), float(values[0])


def test_the_procedure_of_the_paper_agrees() -> None:
    """Points a few kilometres from the origin, where sums of squares keep ten digits."""
    rng = np.random.default_rng(11)
    scales = rng.uniform(0.3, 4.0, 60)
    covariances = scales[:, None, None] ** 2 * COVARIANCE
    points = noisy(circle(60) - np.array([38e3, -24e3, 9e3]), covariances, rng)
    plane = fit_proportional(points, COVARIANCE, scales)
    normal, distance, least = procedure_of_paper(points, COVARIANCE, scales)
    assert plane.normal == pytest.approx(normal, abs=1e-9)
    assert plane.distance_m == pytest.approx(distance, abs=1e-5)
    assert plane.statistic == pytest.approx(least, rel=1e-6)
    # (1.8): along D n, whatever the scale.
    along = COVARIANCE @ normal
    moved = points + np.outer((distance - points @ normal) / (normal @ along), along)
    assert plane.positions_m == pytest.approx(moved, abs=1e-4)


def test_scales_weight_points() -> None:
    """(1.4): α of one half is equivalent to four points with α of one."""
    rng = np.random.default_rng(12)
    points = noisy(circle(30), np.broadcast_to(COVARIANCE, (30, 3, 3)), rng)
    scales = np.where(np.arange(30) % 3, 1.0, 0.5)
    copies = np.where(np.arange(30) % 3, 1, 4)
    weighted = fit_proportional(points, COVARIANCE, scales)
    repeated = fit_proportional(np.repeat(points, copies, axis=0), COVARIANCE)
    assert weighted.normal == pytest.approx(repeated.normal, abs=1e-10)
    assert weighted.statistic == pytest.approx(repeated.statistic, rel=1e-9)
    assert (weighted.degrees_of_freedom, repeated.degrees_of_freedom) == (27, 57)


def test_nonproportional_covariances_reach_the_minimum() -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        covariances = turned(30, rng)
        points = noisy(circle(30), covariances, rng)
        plane = fit_plane(points, covariances)
        assert plane.statistic == pytest.approx(searched(points, covariances), rel=1e-6)


def test_projected_positions_lie_in_the_plane_and_cost_the_statistic() -> None:
    """(1.8) is on the plane; (1.16): the positions cost Λ in their own covariances."""
    rng = np.random.default_rng(3)
    covariances = turned(40, rng)
    points = noisy(circle(40), covariances, rng)
    plane = fit_plane(points, covariances)
    assert plane.positions_m @ plane.normal == pytest.approx(plane.distance_m, abs=1e-6)
    moved = plane.positions_m - points
    cost = np.einsum("ni,nij,nj->", moved, np.linalg.inv(covariances), moved)
    assert cost == pytest.approx(plane.statistic, rel=1e-9)


def test_the_frame_does_not_matter() -> None:
    """A shift of the origin by 6 000 km moves Λ by rounding alone, and a by that shift."""
    rng = np.random.default_rng(4)
    points = noisy(circle(40), np.broadcast_to(COVARIANCE, (40, 3, 3)), rng)
    shift = np.array([4e6, -3e6, 2e6])
    here, there = (fit_proportional(one, COVARIANCE) for one in (points, points + shift))
    assert there.statistic == pytest.approx(here.statistic, rel=1e-6)
    expected = here.distance_m + float(shift @ here.normal)
    assert there.distance_m == pytest.approx(expected, abs=1e-2)


def test_the_normal_points_up() -> None:
    plane = fit_proportional(-circle(20), COVARIANCE)
    assert plane.normal[2] > 0.0
    assert plane.distance_m == pytest.approx(-float(circle(1)[0] @ NORMAL), abs=1e-6)
    vertical = np.column_stack([np.zeros(9), np.arange(9.0) ** 2 * 100.0, np.arange(9.0) * 1e3])
    assert fit_proportional(vertical, COVARIANCE).normal == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.slow
def test_planar_motion_is_rejected_at_the_significance_level() -> None:
    """600 circles: p-values are uniform, and √(2 Λ) > √(2 N) + 2 rejects some 2 %, not 0.3 %."""
    rng = np.random.default_rng(5)
    covariances = turned(60, rng)
    planes = [fit_plane(noisy(circle(60), covariances, rng), covariances) for _ in range(600)]
    p_values = np.sort([plane.p_value for plane in planes])
    # Kolmogorov–Smirnov at 0.1 %: 1.95 / √600.
    assert np.abs(p_values - (np.arange(600) + 0.5) / 600).max() < 1.95 / np.sqrt(600)
    rejected = sum(plane.refused_by_printed_criterion is True for plane in planes)
    assert 2 <= rejected <= 30
    assert planes[0].degrees_of_freedom == 57
    assert planes[0].p_value == pytest.approx(chi2.sf(planes[0].statistic, 57), rel=1e-10)


@pytest.mark.slow
def test_the_sigma_of_the_normal_is_that_of_its_errors() -> None:
    """RMS of the largest tilt over 400 runs: within 12 %, 3.4 sigma."""
    rng = np.random.default_rng(6)
    covariances = turned(40, rng)
    planes = [fit_plane(noisy(circle(40), covariances, rng), covariances) for _ in range(400)]
    errors = np.array([plane.normal for plane in planes]) - NORMAL
    worst = np.sqrt(np.linalg.eigvalsh(errors.T @ errors / 400)[-1])
    expected = np.sqrt(np.mean([plane.normal_sigma_rad**2 for plane in planes]))
    assert expected == pytest.approx(worst, rel=0.12)


def test_a_helix_is_rejected() -> None:
    rng = np.random.default_rng(7)
    points = circle(200) + np.linspace(0.0, 600.0, 200)[:, None] * NORMAL
    points += 300.0 * np.sin(np.linspace(0.0, 3.0, 200))[:, None] * NORMAL
    covariances = np.broadcast_to(625.0 * np.eye(3), (200, 3, 3))
    plane = fit_plane(noisy(points, covariances, rng), covariances)
    assert plane.p_value < LEVEL
    assert not plane.is_planar
    assert plane.refused_by_printed_criterion is True


def test_the_criterion_of_the_paper_applies_above_thirty_points() -> None:
    assert fit_proportional(circle(30), COVARIANCE).refused_by_printed_criterion is None
    plane = fit_proportional(circle(31), COVARIANCE)
    assert plane.refused_by_printed_criterion is False
    assert plane.printed_threshold == pytest.approx(np.sqrt(62.0) + 2.0)
    assert ManoeuvrePlane(NORMAL, 0.0, 50.0, circle(31), 0.1).printed_statistic == 10.0


def test_points_on_a_line_determine_no_plane() -> None:
    rng = np.random.default_rng(8)
    line = np.linspace(0.0, 20e3, 25)[:, None] * np.array([0.6, 0.8, 0.0])
    covariances = np.broadcast_to(COVARIANCE, (25, 3, 3))
    for points in (line, noisy(line, covariances, rng), np.zeros((25, 3))):
        with pytest.raises(PlaneError, match="straight line") as error:
            fit_plane(points, covariances)
        assert error.value.code == "POINTS_ON_A_LINE"


def test_too_few_points_are_rejected() -> None:
    for count in range(POINTS_MIN):
        with pytest.raises(PlaneError, match=f"found {count}") as error:
            fit_proportional(circle(20)[:count].reshape(-1, 3), COVARIANCE)
        assert error.value.code == "TOO_FEW_POINTS"


def test_inconsistent_arrays_are_rejected() -> None:
    points = circle(9)
    with pytest.raises(ShapeError):
        fit_proportional(points[:, :2], COVARIANCE)
    with pytest.raises(ShapeError):
        fit_plane(points, np.broadcast_to(COVARIANCE, (8, 3, 3)))
    with pytest.raises(CovarianceError):
        fit_proportional(points, -COVARIANCE)
    with pytest.raises(ConfigurationError):
        fit_proportional(points, COVARIANCE, np.zeros(9))
    with pytest.raises(ShapeError):
        fit_proportional(np.full((9, 3), np.nan), COVARIANCE)
