"""A trajectory from angles alone, or from angles and ranges, in information form.

What is known is Y = P⁻¹ and y = Y χ, so that nothing known is Y = 0, and an angle adds Hᵀ σ⁻² H, of
rank one, whatever its range would have been. Nothing stands in for an infinite variance.

The state is position and velocity, in the plane or in space; the aircraft flies straight with white
acceleration. Any number of sources, fixed or moving, one sight after the other, in the order of
time.

Whether the lines of sight cross is told with the estimate (condition (10)). That is what a position
needs; a single source that does not manoeuvre sees its lines turn and yet learns no distance of an
aircraft in straight flight, which the covariance then says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import BearingsError, MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.gaussian import symmetric_part
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

#: Lines of sight cross when they are so many of their errors apart.
CROSSING_MIN = 3.0
#: A distance is known when its sigma is below this share of it.
DISTANCE_SHARE_MAX = 0.3

# Smallest eigenvalue of the information, scaled to ones on its diagonal, that is told from zero.
_REGULAR_MIN = 1e-13
# Rounds of the intersection, and of the search after it; three are usual.
_LINEAR_ROUNDS = 4
_ROUNDS_MAX = 20
_SETTLED_SHARE = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class BearingsState:
    """What is known of an aircraft; leading axes are aircraft, or runs of a study.

    Attributes
    ----------
    time_s : float
        Of the state.
    information : (..., 2 d, 2 d) float64
        Y, of positions (m) and then velocities (m/s).
    vector : (..., 2 d) float64
        y = Y χ.
    crossing : (..., d, d) float64
        Σ n nᵀ / σ² over the sights so far, n across the line of sight: singular while all of them
        are parallel. A range adds the direction along the line.

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
        """By how many of their errors the lines of sight cross: 0 for parallel ones, (...).

        References
        ----------
        Nenartovich, Isakov, condition (10), in units of the errors.
        """
        least = np.linalg.eigvalsh(self.crossing)[..., 0]
        return np.asarray(np.sqrt(np.maximum(least, 0.0)))

    @property
    def lines_cross(self) -> NDArray[np.bool_]:
        """Whether the lines of sight cross beyond the errors of the angles, (...).

        References
        ----------
        Nenartovich, Isakov, condition (10).
        """
        return np.asarray(self.crossing_strength > CROSSING_MIN)

    def estimate(self) -> tuple[Floats, Floats]:
        """Return the state and what its errors are.

        Returns
        -------
        mean : (..., 2 d) ndarray
            Position, m, and velocity, m/s.
        covariance : (..., 2 d, 2 d) ndarray
            Its covariance.

        Raises
        ------
        BearingsError
            If the sights so far determine no state.

        References
        ----------
        Nenartovich, Isakov, equation (9): P is the inverse of the information.
        """
        scale = _scale(self.information)
        scaled = self.information / scale[..., :, None] / scale[..., None, :]
        if not (np.linalg.eigvalsh(scaled)[..., 0] > _REGULAR_MIN).all():
            raise BearingsError("NOT_OBSERVABLE", "expected sights that determine a state")
        covariance = np.linalg.inv(scaled) / scale[..., :, None] / scale[..., None, :]
        mean = (covariance @ self.vector[..., None])[..., 0]
        return mean, symmetric_part(covariance)


def initiate(sights: Sequence[Sight], times_s: ArrayLike, speed_sigma_mps: float) -> BearingsState:
    """Begin a track from the first sights, all of which it needs to be located.

    Parameters
    ----------
    sights : sequence of Sight
        Of two sources at least, or of one with a range; in the order of time.
    times_s : (n,) array_like
        When they were taken, s, ascending.
    speed_sigma_mps : float
        What is known of the velocity beforehand: nothing but this standard deviation about 0, for
        each component, m/s.

    Returns
    -------
    BearingsState
        At the time of the last sight.

    Raises
    ------
    BearingsError
        If the lines of sight do not cross beyond their errors, or cross behind a source.
    TimeOrderError, ShapeError, MotionParameterError
        If times go back, or the sights are none or not all of the plane or of space; the sigma of
        the speed is not positive.

    Notes
    -----
    First the lines are intersected (each angle a linear equation, weighted with its distance,
    rounds of it), then the angles themselves are fitted by Gauss–Newton, which takes the lean out
    that the measured angles leave in the linear equations. The aircraft is taken to fly straight
    meanwhile.

    References
    ----------
    Nenartovich, Isakov, equations (9) and (12), for the linear equations; the start from nothing
    and the rounds are the project's own.
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
        raise BearingsError("NOT_OBSERVABLE", f"expected a place after {_ROUNDS_MAX} rounds")
    _require_ahead(sights, ago, mean)
    crossing = empty.crossing
    for sight, t in zip(sights, ago.tolist(), strict=True):
        crossing = crossing + _crossing(sight, mean[..., :d] + t * mean[..., d:])
    return replace(state, crossing=crossing)


def predict(state: BearingsState, time_s: float, acceleration_density: float) -> BearingsState:
    """Move what is known on in time.

    Parameters
    ----------
    state : BearingsState
        Before.
    time_s : float
        A time not before that of the state, s.
    acceleration_density : float
        Spectral density of the white acceleration on each axis, m²/s³, not negative.

    Returns
    -------
    BearingsState
        (I + M Q)⁻¹ M with M = Φ⁻ᵀ Y Φ⁻¹: also where Y is singular.

    Raises
    ------
    TimeOrderError
        If the time is before that of the state, or no number.
    MotionParameterError
        If the density is negative or no number.

    References
    ----------
    Nenartovich, Isakov, equations (6) and (7), in information form; (9) adds the informations
    without moving them. The form is that of P. S. Maybeck, "Stochastic Models, Estimation, and
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
    """Add what a sight says at the time of the state.

    Parameters
    ----------
    state : BearingsState
        One that determines a place, at the time of the sight.
    sight : Sight
        Angles, with a range or without.

    Returns
    -------
    BearingsState
        Y + Hᵀ W⁻¹ H, with H at the state.

    Raises
    ------
    BearingsError
        If the state determines no place, at which the angles could be linearised.
    ShapeError
        If one is of the plane and the other of space.

    References
    ----------
    Nenartovich, Isakov, equations (6), (11) and (12): the missing range has no part in the update.
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
    """Return whether lines of sight cross and the distance from a source is known.

    Parameters
    ----------
    state : BearingsState
        One that determines a state.
    source_m : (d,) array_like
        The source, such as the nearest one, m.

    Returns
    -------
    (...) bool
        `lines_cross`, and the worst sigma of the position at most `DISTANCE_SHARE_MAX` of the
        distance.

    Raises
    ------
    BearingsError
        If the sights so far determine no state.

    References
    ----------
    Nenartovich, Isakov, condition (10); the share of the distance is the project's own, for what
    (10) does not see.
    """
    d = state.dimensions
    mean, covariance = state.estimate()
    distance = np.linalg.norm(mean[..., :d] - np.asarray(source_m, np.float64), axis=-1)
    worst = np.sqrt(np.linalg.eigvalsh(covariance[..., :d, :d])[..., -1])
    return np.asarray(state.lines_cross & (worst <= DISTANCE_SHARE_MAX * distance))


def _checked_times(sights: Sequence[Sight], times_s: ArrayLike) -> Floats:
    times = np.atleast_1d(np.asarray(times_s, np.float64))
    if not len(sights) or times.shape != (len(sights),) or not np.isfinite(times).all():
        raise ShapeError("times", f"one for each of {len(sights)} sights, at least 1", times.shape)
    for before, after in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        if after < before:
            raise TimeOrderError("sight", after, before)
    kinds = {sight.dimensions for sight in sights}
    if len(kinds) > 1:
        raise ShapeError("sights", "all of the plane or all of space", (len(sights),))
    return times


def _nothing(sights: Sequence[Sight], d: int) -> tuple[Floats, Floats, Floats]:
    shape = np.broadcast_shapes(*(np.shape(sight.azimuth_rad) for sight in sights))
    return np.zeros((*shape, 2 * d, 2 * d)), np.zeros((*shape, 2 * d)), np.zeros((*shape, d, d))


# Condition (10), and what it does not see: one fixed source, whose line turns with the aircraft.
def _require_crossing(sights: Sequence[Sight], empty: BearingsState) -> None:
    if any(sight.range_m is not None for sight in sights):
        return
    sources = np.array([sight.source_m for sight in sights])
    if not np.ptp(sources, axis=0).any():
        raise BearingsError("NOT_OBSERVABLE", "expected sources at two places, was one")
    crossing = empty.crossing
    for sight in sights:
        crossing = crossing + _crossing(sight, None)
    if not replace(empty, crossing=crossing).lines_cross.all():
        raise BearingsError(
            "NOT_OBSERVABLE", "expected lines of sight that cross beyond their errors"
        )


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


# Intersection of the lines of sight: ⟨n, p + v t − R⟩ = 0 with the error r σ, r from the round
# before.
def _intersected(sights: Sequence[Sight], ago: Floats, prior: Floats) -> Floats:
    d = sights[0].dimensions
    information, vector, _ = _nothing(sights, d)
    distances = [np.ones(vector.shape[:-1]) for _ in sights]
    mean = np.zeros(vector.shape)
    for round_ in range(_LINEAR_ROUNDS):
        # The first round has no metre for its weights: the velocity waits for the second.
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
        for place, (sight, t) in enumerate(zip(sights, ago.tolist(), strict=True)):
            line = mean[..., :d] + t * mean[..., d:] - sight.source_m
            distances[place] = np.maximum(np.linalg.norm(line, axis=-1), 1.0)
    return mean


# Rows of the linear equations, their sigmas at a distance of 1 m, and what they equal.
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
        reason = "expected sights that determine a place"
        raise BearingsError("NOT_OBSERVABLE", reason) from error
    return np.asarray(solution / scale)


# One round of Gauss–Newton over all sights.
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


# Lines also cross behind the sources, where nobody looks.
def _require_ahead(sights: Sequence[Sight], ago: Floats, mean: Floats) -> None:
    d = sights[0].dimensions
    for sight, t in zip(sights, ago.tolist(), strict=True):
        line = mean[..., :d] + t * mean[..., d:] - sight.source_m
        ahead = line[..., 0] * np.sin(sight.azimuth_rad) + line[..., 1] * np.cos(sight.azimuth_rad)
        if not (ahead > 0.0).all():
            raise BearingsError("BEHIND_SOURCE", "expected lines of sight that cross ahead")


def _scale(information: Floats) -> Floats:
    diagonal = np.diagonal(information, axis1=-2, axis2=-1)
    return np.asarray(np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)))
