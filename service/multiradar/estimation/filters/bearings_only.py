"""A trajectory from angles alone, or from angles and ranges, in information form.

The information is Y = P⁻¹ and y = Y χ, so that Y = 0 without any, and an angle adds Hᵀ σ⁻² H, of
rank one, whatever the range. No large variance stands for an infinite one.

The state is position and velocity, in the plane or in space; the aircraft flies straight with white
acceleration. There may be any number of sources, fixed or moving; sights are processed in the order
of time.

The estimate states whether the lines of sight intersect (condition (10)), which triangulation
requires. The bearing of a single source that does not manoeuvre rotates without giving the distance
of an aircraft in straight flight; the covariance then shows it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import BearingsError, MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.gaussian import symmetric_part
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

#: Lines of sight intersect if their crossing angle exceeds this many of their sigmas.
CROSSING_MIN = 3.0
#: A distance is observable if its sigma is below this fraction of it.
DISTANCE_SHARE_MAX = 0.3

# Smallest eigenvalue of the information, scaled to a unit diagonal, that differs from zero.
_REGULAR_MIN = 1e-13
# Iterations of the intersection, and of Gauss–Newton after it; three are usual.
_LINEAR_ROUNDS = 4
_ROUNDS_MAX = 20
_SETTLED_SHARE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class BearingsState:
    """Information about an aircraft; leading axes are aircraft, or runs of a study.

    Attributes
    ----------
    time_s : float
        Time of the state.
    information : (..., 2 d, 2 d) float64
        Y, of positions (m) and then velocities (m/s).
    vector : (..., 2 d) float64
        y = Y χ.
    crossing : (..., d, d) float64
        Σ n nᵀ / σ² over the sights so far, n across the line of sight: singular while all are
        parallel. A range adds the direction along the line.

    References
    ----------
    Nenartovich, Isakov, equations (6), (9) and (10).
    """

    time_s: float
    information: Floats
    vector: Floats
    crossing: Floats

    @property
    def dimensions(self) -> int:
        """2 in the plane, 3 in space.

        References
        ----------
        The project's own: the paper describes the plane.
        """
        return int(self.crossing.shape[-1])

    @property
    def crossing_strength(self) -> Floats:
        """Crossing angle of the lines of sight in units of their errors: 0 if parallel, (...).

        References
        ----------
        Nenartovich, Isakov, condition (10), in units of the errors.
        """
        least = np.linalg.eigvalsh(self.crossing)[..., 0]
        return np.asarray(np.sqrt(np.maximum(least, 0.0)))

    @property
    def lines_cross(self) -> NDArray[np.bool_]:
        """Whether the lines of sight intersect beyond the errors of the angles, (...).

        References
        ----------
        Nenartovich, Isakov, condition (10).
        """
        return np.asarray(self.crossing_strength > CROSSING_MIN)

    def estimate(self) -> tuple[Floats, Floats]:
        """Return the state and its covariance.

        Returns
        -------
        mean : (..., 2 d) ndarray
            Position, m, and velocity, m/s.
        covariance : (..., 2 d, 2 d) ndarray
            Its covariance.

        Raises
        ------
        BearingsError
            If the sights so far do not determine a state.

        References
        ----------
        Nenartovich, Isakov, equation (9): P is the inverse of the information.
        """
        scale = _scale(self.information)
        scaled = self.information / scale[..., :, None] / scale[..., None, :]
        if not (np.linalg.eigvalsh(scaled)[..., 0] > _REGULAR_MIN).all():
            raise BearingsError("NOT_OBSERVABLE", "the measurements do not determine a state")
        covariance = np.linalg.inv(scaled) / scale[..., :, None] / scale[..., None, :]
        mean = (covariance @ self.vector[..., None])[..., 0]
        return mean, symmetric_part(covariance)


def initiate(sights: Sequence[Sight], times_s: ArrayLike, speed_sigma_mps: float) -> BearingsState:
    """Initiate a track from its first sights, all of which are used to locate it.

    Parameters
    ----------
    sights : sequence of Sight
        From at least two sources, or from one with a range; in the order of time.
    times_s : (n,) array_like
        Their times, s, ascending.
    speed_sigma_mps : float
        Prior of the velocity: standard deviation of each component about 0, m/s.

    Returns
    -------
    BearingsState
        At the time of the last sight.

    Raises
    ------
    BearingsError
        If the lines of sight do not intersect beyond their errors, or intersect behind a source.
    TimeOrderError, ShapeError, MotionParameterError
        If times decrease; there are no sights, or they mix plane and space; the sigma of the speed
        is not positive.

    Notes
    -----
    First the lines are intersected iteratively (each angle a linear equation, weighted by its
    distance), then the angles themselves are fitted by Gauss–Newton, which removes the bias of the
    linear equations. The aircraft is assumed to fly straight meanwhile.

    References
    ----------
    Nenartovich, Isakov, equations (9) and (12), for the linear equations; initiation without a
    prior and the iterations are the project's own.
    """
    times = _checked_times(sights, times_s)
    if not 0.0 < speed_sigma_mps < np.inf:
        raise MotionParameterError("speed_sigma_mps", "a positive number", speed_sigma_mps)
    d = sights[0].dimensions
    empty = BearingsState(float(times[-1]), *_nothing(sights, d))
    _require_crossing(sights, empty)
    prior = np.zeros((2 * d, 2 * d))
    prior[d:, d:] = np.eye(d) / speed_sigma_mps**2
    ago = times - times[-1]
    mean = _intersected(sights, ago, prior)
    _require_ahead(sights, ago, mean)
    state = empty
    for _ in range(_ROUNDS_MAX):
        before, state = mean, _fitted(sights, ago, prior, mean, state)
        mean, covariance = state.estimate()
        moved = np.linalg.norm((mean - before)[..., :d], axis=-1)
        if (moved <= _SETTLED_SHARE * np.sqrt(covariance[..., 0, 0])).all():
            break
    else:
        raise BearingsError(
            "NOT_OBSERVABLE", f"the position did not converge after {_ROUNDS_MAX} iterations"
        )
    _require_ahead(sights, ago, mean)
    crossing = empty.crossing
    for sight, t in zip(sights, ago.tolist(), strict=True):
        crossing = crossing + _crossing(sight, mean[..., :d] + t * mean[..., d:])
    return replace(state, crossing=crossing)


def predict(state: BearingsState, time_s: float, acceleration_density: float) -> BearingsState:
    """Predict the information.

    Parameters
    ----------
    state : BearingsState
        State before.
    time_s : float
        A time not before that of the state, s.
    acceleration_density : float
        Spectral density of the white acceleration on each axis, m²/s³, not negative.

    Returns
    -------
    BearingsState
        (I + M Q)⁻¹ M with M = Φ⁻ᵀ Y Φ⁻¹, also for singular Y.

    Raises
    ------
    TimeOrderError
        If the time is before that of the state, or not a number.
    MotionParameterError
        If the density is negative or not a number.

    References
    ----------
    Nenartovich, Isakov, equations (6) and (7), in information form; (9) adds the information
    without prediction. The form is that of P. S. Maybeck, "Stochastic Models, Estimation, and
    Control", volume 1, Academic Press 1979, section 5.7.
    """
    interval = time_s - state.time_s
    if not 0.0 <= interval < np.inf:
        raise TimeOrderError("sight", time_s, state.time_s)
    if not 0.0 <= acceleration_density < np.inf:
        raise MotionParameterError("acceleration_density", "0 or more", acceleration_density)
    d = state.dimensions
    whole = np.eye(d)
    back = np.block([[whole, -interval * whole], [np.zeros((d, d)), whole]])
    t = interval
    noise = acceleration_density * np.block(
        [[t**3 / 3.0 * whole, t**2 / 2.0 * whole], [t**2 / 2.0 * whole, t * whole]]
    )
    moved = back.T @ state.information @ back
    fading = np.eye(2 * d) + moved @ noise
    vector = np.linalg.solve(fading, (back.T @ state.vector[..., None]))[..., 0]
    information = symmetric_part(np.linalg.solve(fading, moved))
    return replace(state, time_s=float(time_s), information=information, vector=vector)


def update(state: BearingsState, sight: Sight) -> BearingsState:
    """Update by a sight at the time of the state.

    Parameters
    ----------
    state : BearingsState
        One that determines a position, at the time of the sight.
    sight : Sight
        Angles, with or without a range.

    Returns
    -------
    BearingsState
        Y + Hᵀ W⁻¹ H, with H at the state.

    Raises
    ------
    BearingsError
        If the state determines no position for the linearisation of the angles.
    ShapeError
        If one is of the plane and the other of space.

    References
    ----------
    Nenartovich, Isakov, equations (6), (11) and (12): a missing range does not enter the update.
    """
    if sight.dimensions != state.dimensions:
        raise ShapeError("sight", f"{state.dimensions} dimensions", (sight.dimensions,))
    d = state.dimensions
    mean, _ = state.estimate()
    position = mean[..., :d]
    residuals, slopes, sigmas = sight.residuals(position)
    weighted = np.swapaxes(slopes, -1, -2) / sigmas**2
    information = state.information.copy()
    information[..., :d, :d] += weighted @ slopes
    expected = residuals + (slopes @ position[..., None])[..., 0]
    vector = state.vector.copy()
    vector[..., :d] += (weighted @ expected[..., None])[..., 0]
    return replace(
        state,
        information=symmetric_part(information),
        vector=vector,
        crossing=state.crossing + _crossing(sight, position),
    )


def is_observable(state: BearingsState, source_m: ArrayLike) -> NDArray[np.bool_]:
    """Return whether lines of sight intersect and the distance from a source is observable.

    Parameters
    ----------
    state : BearingsState
        One that determines a state.
    source_m : (d,) array_like
        The source, such as the nearest one, m.

    Returns
    -------
    (...) bool
        `lines_cross`, and the largest sigma of the position at most `DISTANCE_SHARE_MAX` of the
        distance.

    Raises
    ------
    BearingsError
        If the sights so far determine no state.

    References
    ----------
    Nenartovich, Isakov, condition (10); the limit on the distance is the project's own, for cases
    that (10) does not detect.
    """
    d = state.dimensions
    mean, covariance = state.estimate()
    distance = np.linalg.norm(mean[..., :d] - np.asarray(source_m, np.float64), axis=-1)
    worst = np.sqrt(np.linalg.eigvalsh(covariance[..., :d, :d])[..., -1])
    return np.asarray(state.lines_cross & (worst <= DISTANCE_SHARE_MAX * distance))


def _checked_times(sights: Sequence[Sight], times_s: ArrayLike) -> Floats:
    times = np.atleast_1d(np.asarray(times_s, np.float64))
    if not len(sights) or times.shape != (len(sights),) or not np.isfinite(times).all():
        raise ShapeError(
            "times",
            f"one time for each of {len(sights)} sights, and at least one sight",
            times.shape,
        )
    for before, after in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        if after < before:
            raise TimeOrderError("sight", after, before)
    kinds = {sight.dimensions for sight in sights}
    if len(kinds) > 1:
        raise ShapeError("sights", "all sights in two dimensions, or all in three", (len(sights),))
    return times


def _nothing(sights: Sequence[Sight], d: int) -> tuple[Floats, Floats, Floats]:
    shape = np.broadcast_shapes(*(np.shape(sight.azimuth_rad) for sight in sights))
    return np.zeros((*shape, 2 * d, 2 * d)), np.zeros((*shape, 2 * d)), np.zeros((*shape, d, d))


# Condition (10), and a case it does not detect: one fixed source, whose bearing rotates.
def _require_crossing(sights: Sequence[Sight], empty: BearingsState) -> None:
    if any(sight.range_m is not None for sight in sights):
        return
    sources = np.array([sight.source_m for sight in sights])
    if not np.ptp(sources, axis=0).any():
        raise BearingsError("NOT_OBSERVABLE", "all lines of sight start at the same position")
    crossing = empty.crossing
    for sight in sights:
        crossing = crossing + _crossing(sight, None)
    if not replace(empty, crossing=crossing).lines_cross.all():
        raise BearingsError("NOT_OBSERVABLE", "lines of sight are parallel within their errors")


# n nᵀ / σ² of the angles; of a range, along the line of sight, in units of the distance.
def _crossing(sight: Sight, position: Floats | None) -> Floats:
    normals, sigmas = sight.normals()
    found = np.asarray(np.swapaxes(normals, -1, -2) / sigmas**2 @ normals)
    if sight.range_m is None or sight.range_sigma_m is None or position is None:
        return found
    line = position - sight.source_m
    distance = np.linalg.norm(line, axis=-1)
    along = line / np.where(distance > 0.0, distance, 1.0)[..., None]
    weight = (distance / sight.range_sigma_m) ** 2
    return np.asarray(found + weight[..., None, None] * along[..., :, None] * along[..., None, :])


# Intersection of the lines of sight: ⟨n, p + v t − R⟩ = 0 with the error r σ, r from the previous
# iteration.
def _intersected(sights: Sequence[Sight], ago: Floats, prior: Floats) -> Floats:
    d = sights[0].dimensions
    information, vector, _ = _nothing(sights, d)
    distances = [np.ones(vector.shape[:-1]) for _ in sights]
    mean = np.zeros(vector.shape)
    for round_ in range(_LINEAR_ROUNDS):
        # The first iteration has no distances for its weights: the velocity is fixed at 0.
        information[...] = prior if round_ else np.diag(np.r_[np.zeros(d), np.full(d, 1e12)])
        vector[...] = 0.0
        for sight, t, distance in zip(sights, ago.tolist(), distances, strict=True):
            rows, sigmas, known = _linear_rows(sight)
            weights = 1.0 / (distance[..., None] * sigmas) ** 2
            whole = np.concatenate([rows, t * rows], axis=-1)
            weighted = np.swapaxes(whole, -1, -2) * weights[..., None, :]
            information += weighted @ whole
            vector += (weighted @ known[..., None])[..., 0]
        mean = _solved(information, vector)
        for index, (sight, t) in enumerate(zip(sights, ago.tolist(), strict=True)):
            line = mean[..., :d] + t * mean[..., d:] - sight.source_m
            distances[index] = np.maximum(np.linalg.norm(line, axis=-1), 1.0)
    return mean


# Rows of the linear equations, their sigmas at a distance of 1 m, and their right-hand sides.
def _linear_rows(sight: Sight) -> tuple[Floats, Floats, Floats]:
    rows, sigmas = sight.normals()
    known = rows @ sight.source_m
    if sight.range_m is None:
        return rows, sigmas, known
    # Along the line: the range itself.
    rise = 0.0 if sight.elevation_rad is None else sight.elevation_rad
    azimuth, level = sight.azimuth_rad, np.cos(rise)
    parts = [level * np.sin(azimuth), level * np.cos(azimuth)]
    if sight.dimensions > len(parts):
        parts.append(np.sin(rise) + 0.0 * azimuth)
    along = np.stack(parts, axis=-1)[..., None, :]
    measured = sight.range_m[..., None] + along @ sight.source_m
    share = float(sight.range_sigma_m or 1.0) / float(np.median(sight.range_m))
    return (
        np.concatenate([rows, along], axis=-2),
        np.r_[sigmas, share],
        np.concatenate([known, measured], axis=-1),
    )


def _solved(information: Floats, vector: Floats) -> Floats:
    scale = _scale(information)
    scaled = information / scale[..., :, None] / scale[..., None, :]
    try:
        solution = np.linalg.solve(scaled, (vector / scale)[..., None])[..., 0]
    except np.linalg.LinAlgError as error:
        reason = "the measurements do not determine a position"
        raise BearingsError("NOT_OBSERVABLE", reason) from error
    return np.asarray(solution / scale)


# One iteration of Gauss–Newton over all sights.
def _fitted(
    sights: Sequence[Sight], ago: Floats, prior: Floats, mean: Floats, state: BearingsState
) -> BearingsState:
    d = state.dimensions
    information = np.zeros_like(state.information) + prior
    vector = np.zeros_like(state.vector)
    for sight, t in zip(sights, ago.tolist(), strict=True):
        residuals, slopes, sigmas = sight.residuals(mean[..., :d] + t * mean[..., d:])
        whole = np.concatenate([slopes, t * slopes], axis=-1)
        weighted = np.swapaxes(whole, -1, -2) / sigmas**2
        information += weighted @ whole
        expected = residuals + (whole @ mean[..., None])[..., 0]
        vector += (weighted @ expected[..., None])[..., 0]
    return replace(state, information=symmetric_part(information), vector=vector)


# Lines may also intersect behind a source, opposite to the measured direction.
def _require_ahead(sights: Sequence[Sight], ago: Floats, mean: Floats) -> None:
    d = sights[0].dimensions
    for sight, t in zip(sights, ago.tolist(), strict=True):
        line = mean[..., :d] + t * mean[..., d:] - sight.source_m
        ahead = line[..., 0] * np.sin(sight.azimuth_rad) + line[..., 1] * np.cos(sight.azimuth_rad)
        if not (ahead > 0.0).all():
            raise BearingsError("BEHIND_SOURCE", "lines of sight intersect behind a source")


def _scale(information: Floats) -> Floats:
    diagonal = np.diagonal(information, axis1=-2, axis2=-1)
    return np.asarray(np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
