"""The plane in which an aircraft manoeuvres, and a test of planarity.

Points x_i* = x_i + ξ_i with known covariances D_i are assumed to lie in a plane ⟨n, x⟩ = a. For
proportional covariances, D_i = α_i² D, maximum likelihood is an eigenproblem of a 3 × 3 matrix
(`fit_proportional`). Covariances of radars at several sites have different directions; `fit_plane`
continues from there to the minimum of the same functional for any D_i.

The minimum Λ of the functional is χ² distributed with N − 3 degrees of freedom for planar motion: N
residuals, three parameters. The criterion of the paper differs; it is available by its own name.

Signs: the last component of the normal is not negative (then the second, then the first), so that
with coordinates east, north, up the normal points up; the distance a is negative where the plane
passes below the origin.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaincc

from multiradar.errors import PlaneError
from multiradar.estimation.array_checks import finite_array, positive_array
from multiradar.estimation.gaussian import require_covariance, symmetric_part

Floats = NDArray[np.float64]

#: Three parameters are estimated from the points; the test needs one more.
POINTS_MIN = 4
#: Significance level of the test, as in the paper: rate of rejection of planar motion.
LEVEL = 0.003
#: The criterion of the paper applies to more points than this.
PAPER_CRITERION_ABOVE = 30

# Maximum steps of the iteration from the proportional solution, maximum halvings of a step, and the
# step, rad, that ends the iteration.
_STEPS_MAX = 50
_HALVINGS_MAX = 8
_STEP_RAD = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class ManoeuvrePlane:
    """A plane through points, with its test statistic.

    Attributes
    ----------
    normal : (3,) float64
        Unit normal n.
    distance_m : float
        a: distance of the plane from the origin, m, along the normal.
    statistic : float
        Λ, the minimum of the functional (1.2).
    positions_m : (N, 3) float64
        The points projected on the plane along D_i n, equation (1.8).
    normal_sigma_rad : float
        Largest standard deviation of the direction of the normal, rad.
    """

    normal: Floats
    distance_m: float
    statistic: float
    positions_m: Floats
    normal_sigma_rad: float

    @property
    def points(self) -> int:
        """N, the number of points."""
        return len(self.positions_m)

    @property
    def degrees_of_freedom(self) -> int:
        """N − 3."""
        return self.points - 3

    @property
    def p_value(self) -> float:
        """Probability of a statistic at least as large for planar motion."""
        return float(gammaincc(0.5 * self.degrees_of_freedom, 0.5 * self.statistic))

    @property
    def is_planar(self) -> bool:
        """Whether the motion is consistent with a plane at `LEVEL`."""
        return self.p_value >= LEVEL

    @property
    def printed_statistic(self) -> float:
        """√(2 Λ), left side of the criterion (1.17)."""
        return math.sqrt(2.0 * self.statistic)

    @property
    def printed_threshold(self) -> float:
        """√(2 N) + 2, right side of the criterion (1.17)."""
        return math.sqrt(2.0 * self.points) + 2.0

    @property
    def refused_by_printed_criterion(self) -> bool | None:
        """Whether criterion (1.17) rejects the plane; None if undefined: at most 30 points."""
        if self.points <= PAPER_CRITERION_ABOVE:
            return None
        return self.printed_statistic > self.printed_threshold


def fit_proportional(
    positions_m: ArrayLike, covariance_m2: ArrayLike, scales: ArrayLike | None = None
) -> ManoeuvrePlane:
    """Fit a plane to points with proportional covariances, D_i = α_i² D.

    Parameters
    ----------
    positions_m : (N, 3) array_like
        Measured positions x_i*, m, in any Cartesian frame.
    covariance_m2 : (3, 3) array_like
        D, m².
    scales : (N,) array_like, optional
        α_i, positive; 1 by default.

    Returns
    -------
    ManoeuvrePlane
        The plane of maximum likelihood.

    Raises
    ------
    PlaneError
        If there are fewer than `POINTS_MIN` points, or they are consistent with a line at `LEVEL`,
        so that no plane is determined.
    ShapeError, CovarianceError, ConfigurationError
        If the shapes do not match, or the arrays are not numeric; D is not a covariance; a scale is
        not positive.

    Notes
    -----
    The paper whitens with the eigenvectors of D, R = M^(−1/2) hᵀ Q h M^(−1/2). Any root of D is
    equivalent; here it is that of Cholesky. The eigenvalues of R are squares of the singular values
    of the whitened points, which avoids cancellation for points far from the origin.

    References
    ----------
    Korobochkin, equations (1.4), (1.5), (1.6), (1.7) and (1.8). The test for a line is the
    project's own: 2 N residuals, four parameters.
    """
    points = _points(positions_m)
    d = require_covariance(covariance_m2, "point covariance")
    finite_array(d, "point covariance", (3, 3))
    alpha = np.ones(len(points))
    if scales is not None:
        alpha = positive_array(scales, "scales", (len(points),))
    normal = _eigenproblem(points, d, alpha)
    return _plane(points, alpha[:, None, None] ** 2 * d, normal)


def fit_plane(positions_m: ArrayLike, covariances_m2: ArrayLike) -> ManoeuvrePlane:
    """Fit a plane to points with any covariances.

    Parameters
    ----------
    positions_m : (N, 3) array_like
        Measured positions x_i*, m, in any Cartesian frame.
    covariances_m2 : (N, 3, 3) array_like
        Their covariances D_i, m².

    Returns
    -------
    ManoeuvrePlane
        The plane of maximum likelihood.

    Raises
    ------
    PlaneError
        If there are fewer than `POINTS_MIN` points, they are consistent with a line at `LEVEL`, so
        that no plane is determined, or the iteration does not converge.
    ShapeError, CovarianceError
        If the shapes do not match, or the arrays are not numeric; a matrix is not a covariance.

    Notes
    -----
    Starts from the eigenproblem with D the mean of D_i and α_i² the mean ratio of both, which is
    the solution for proportional covariances. Gauss–Newton steps lead from there to the minimum of
    (1.12). The test for a line uses the proportional covariances.

    References
    ----------
    Korobochkin, equations (1.2), (1.8), (1.11) and (1.12). The steps are the project's own.
    """
    points = _points(positions_m)
    d = require_covariance(covariances_m2, "point covariances")
    finite_array(d, "point covariances", (len(points), 3, 3))
    mean = d.mean(axis=0)
    ratio = np.einsum("ij,nji->n", np.linalg.inv(mean), d) / 3.0
    normal = _eigenproblem(points, mean, np.sqrt(ratio))
    plane = _plane(points, d, normal)
    for _ in range(_STEPS_MAX):
        step = _gauss_newton(plane, points, d)
        better = _stepped(points, d, plane, step)
        if better is None or np.linalg.norm(step) < _STEP_RAD:
            return plane
        plane = better
    raise PlaneError("NO_CONVERGENCE", f"the plane fit did not converge in {_STEPS_MAX} iterations")


def _points(positions_m: ArrayLike) -> Floats:
    points = finite_array(positions_m, "positions", (None, 3))
    if len(points) < POINTS_MIN:
        reason = f"expected at least {POINTS_MIN} points for a plane, found {len(points)}"
        raise PlaneError("TOO_FEW_POINTS", reason)
    return points


# Equations (1.5) to (1.7): the normal, or PlaneError if the points are consistent with a line.
def _eigenproblem(points: Floats, d: Floats, alpha: Floats) -> Floats:
    root = np.linalg.cholesky(d)
    weight = alpha**-2
    centred = points - weight @ points / weight.sum()
    white = np.linalg.solve(root, centred.T) / alpha
    vectors, singular, _ = np.linalg.svd(white, full_matrices=False)
    beside_line = float(singular[1] ** 2 + singular[2] ** 2)
    p_value = float(gammaincc(len(points) - 2, 0.5 * beside_line))
    if p_value >= LEVEL:
        raise PlaneError(
            "POINTS_ON_A_LINE",
            f"{len(points)} points are consistent with a straight line (p-value {p_value:.3g}) "
            f"and do not determine a plane",
        )
    # n = h M^(−1/2) g_k with the root of D in place of h M^(1/2).
    return _unit(np.linalg.solve(root.T, vectors[:, 2]))


# The best plane for a given normal: (1.7) with the weights of any covariances, (1.8) and (1.11).
def _plane(points: Floats, d: Floats, normal: Floats) -> ManoeuvrePlane:
    spread = _times(d, normal)
    variance = spread @ normal
    along = points @ normal
    # About the mean of the points, which avoids cancellation in Λ far from the origin.
    middle = float(along.mean())
    distance = middle + float(((along - middle) / variance).sum() / (1.0 / variance).sum())
    miss = distance - along
    positions = points + (miss / variance)[:, None] * spread
    return ManoeuvrePlane(
        normal=normal,
        distance_m=distance,
        statistic=float((miss**2 / variance).sum()),
        positions_m=positions,
        normal_sigma_rad=_normal_sigma(positions, d, normal, spread),
    )


# The product of each matrix and a vector.
def _times(matrices: Floats, vector: Floats) -> Floats:
    return np.asarray((matrices.reshape(-1, 3) @ vector).reshape(-1, 3))


# Information H about the two tilts of the normal, and the mean contribution N of the noise to it:
# the points scatter along the plane too. The tilts have the covariance (H − N)⁻¹ H (H − N)⁻¹, which
# for one radar is that of principal components.
def _normal_sigma(positions: Floats, d: Floats, normal: Floats, spread: Floats) -> float:
    tilts = _tilts(normal)
    flat = positions @ tilts
    weight = 1.0 / (spread @ normal)
    flat = flat - weight @ flat / weight.sum()
    information = (weight[:, None] * flat).T @ flat
    within = (weight @ d.reshape(-1, 9)).reshape(3, 3)
    cross = weight[:, None] * (spread @ tilts)
    noise = tilts.T @ within @ tilts - cross.T @ cross
    left = symmetric_part(information - noise)
    if not np.linalg.eigvalsh(left)[0] > 0.0:
        # The scatter is not above noise in some direction: the tilt about it is undetermined.
        return 0.5 * math.pi
    inverse = np.linalg.inv(left)
    worst = np.linalg.eigvalsh(symmetric_part(inverse @ information @ inverse))[-1]
    return min(math.sqrt(float(worst)), 0.5 * math.pi)


# Gauss–Newton step of both tilts.
def _gauss_newton(plane: ManoeuvrePlane, points: Floats, d: Floats) -> Floats:
    tilts = _tilts(plane.normal)
    sigma = np.sqrt(_times(d, plane.normal) @ plane.normal)
    residual = (points @ plane.normal - plane.distance_m) / sigma
    flat = (plane.positions_m - plane.positions_m.mean(axis=0)) @ tilts
    jacobian = np.column_stack([flat, -np.ones(len(flat))]) / sigma[:, None]
    solution = np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
    return np.asarray(tilts @ solution[:2])


# The plane after the step, or after a part of it if the whole does not decrease the functional.
# None: no part decreases it by more than rounding.
def _stepped(
    points: Floats, d: Floats, plane: ManoeuvrePlane, step: Floats
) -> ManoeuvrePlane | None:
    for halvings in range(_HALVINGS_MAX):
        stepped = _plane(points, d, _unit(plane.normal + step / 2.0**halvings))
        if stepped.statistic < plane.statistic:
            return stepped
    return None


# Two unit vectors across the normal, as columns.
def _tilts(normal: Floats) -> Floats:
    return np.linalg.svd(normal[None, :])[2][1:].T


def _unit(vector: Floats) -> Floats:
    unit = vector / np.linalg.norm(vector)
    leading = next(part for part in unit[::-1].tolist() if abs(part) > 1e-12)
    return np.asarray(unit if leading > 0.0 else -unit)
