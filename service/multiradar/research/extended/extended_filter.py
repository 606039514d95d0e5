"""An extended Kalman filter of one aircraft in space, over any motion model.

`start`, `predict` and `update` are functions on a frozen `Estimate`. Arrays may have leading axes:
then each entry is an aircraft (or a run of a study) of its own, as if it were alone.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.array_checks import component_array, finite_array, require_shape
from multiradar.estimation.gaussian import EIGENVALUE_MIN, require_covariance, symmetric_part
from multiradar.estimation.motion.axes import STATE_SIZE, Floats
from multiradar.estimation.motion.coordinates import CARTESIAN, Coordinates
from multiradar.estimation.motion.inputs import require_positive
from multiradar.research.extended.extended_measurement import SpaceMeasurement
from multiradar.research.motion.model import MotionModel

#: Minimum level fraction of the speed for a defined course, well above rounding.
COURSE_MIN = 1e-9
#: Largest negative eigenvalue of the correlations due to rounding.
ROUNDING_MAX = 1e-12


class Outcome(IntEnum):
    """Outcome of a measurement; the estimate changes with `UPDATED` only."""

    UPDATED = 0
    GATED = 1  #: Outside the gate.
    SINGULAR = 2  #: The innovation covariance or the updated covariance is not positive definite.
    CONE_OF_SILENCE = 3  #: The aircraft is predicted where the sensor measures nothing useful.
    NOT_FINITE = 4  #: The measurement, or its square, is not a finite number.


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Mean and covariance of a state; made by `start`.

    Attributes
    ----------
    mean : (..., 6) array
        In the coordinates named below, canonical.
    covariance : (..., 6, 6) array
        Symmetric to the last bit.
    coordinates : Coordinates
        Coordinates of the state.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 10.3: the extended Kalman filter.
    """

    mean: Floats
    covariance: Floats
    coordinates: Coordinates

    def cartesian(self) -> "Estimate":
        """Return the estimate as (east, north, up, v_east, v_north, v_up), to first order.

        Returns
        -------
        Estimate
            In `CARTESIAN` coordinates.

        References
        ----------
        Vasiliev, Mattis, the projections after equation (5), and I_xK of (7) for the covariance.
        """
        slope = self.coordinates.to_cartesian_jacobian(self.mean)
        covariance = slope @ self.covariance @ np.swapaxes(slope, -1, -2)
        mean = self.coordinates.to_cartesian(self.mean)
        return Estimate(mean, symmetric_part(covariance), CARTESIAN)


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """Result of an update.

    Attributes
    ----------
    estimate : Estimate
        After the measurement.
    outcome : (...) array of int8
        Values of `Outcome`.
    innovation : (..., m) array
        Measured minus predicted; not finite where the measurement is not.
    innovation_covariance : (..., m, m) array
        H P Hᵀ + W.
    distance_squared : (...) array
        Normalised innovation squared, NIS; infinite where undefined.
    """

    estimate: Estimate
    outcome: NDArray[np.int8]
    innovation: Floats
    innovation_covariance: Floats
    distance_squared: Floats


def start(mean: ArrayLike, covariance: ArrayLike, coordinates: Coordinates = CARTESIAN) -> Estimate:
    """Return an estimate in given coordinates from a Cartesian one.

    Parameters
    ----------
    mean : (..., 6) array_like
        East, north, up (m), v_east, v_north, v_up (m/s).
    covariance : (..., 6, 6) array_like
        Its covariance.
    coordinates : Coordinates
        Those of the motion model of the filter.

    Returns
    -------
    Estimate
        Transformed to first order.

    Raises
    ------
    ShapeError
        The mean has a wrong number of components or is not finite, or the shapes differ.
    CovarianceError
        Not a covariance.
    ConfigurationError
        In the velocity frame, the velocity has no course (at rest or vertical): its covariance
        would be unbounded.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5), solved for V, K and φ, and the inverse of
    I_xK of (7) for the covariance. To first order: Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
    "Estimation with Applications to Tracking and Navigation", Wiley 2001, section 10.3.
    """
    values = finite_array(component_array(mean, "mean", STATE_SIZE), "mean")
    matrix = require_covariance(covariance, "covariance")
    require_shape(matrix, "covariance", (*values.shape, STATE_SIZE))
    own = coordinates.from_cartesian(values)
    slope = coordinates.to_cartesian_jacobian(own)
    # Columns for course and climb have the lengths of the level speed and of the speed.
    lengths = np.linalg.norm(slope[..., 4:], axis=-2)
    if not (lengths > COURSE_MIN * np.maximum(lengths[..., 1:], np.finfo(float).tiny)).all():
        raise ConfigurationError(
            "velocity: expected a non-zero horizontal component, was zero or vertical"
        )
    back = np.linalg.inv(slope)
    carried = back @ matrix @ np.swapaxes(back, -1, -2)
    return Estimate(own, symmetric_part(carried), coordinates)


def predict(estimate: Estimate, model: MotionModel, interval_s: float) -> Estimate:
    """Predict an estimate over an interval.

    Parameters
    ----------
    estimate : Estimate
        In the coordinates of the model.
    model : MotionModel
        Motion model.
    interval_s : float
        T, s, not negative.

    Returns
    -------
    Estimate
        f(x) and F P Fᵀ + Q, both evaluated at the old mean.

    Raises
    ------
    ConfigurationError
        The estimate is in other coordinates than the model.
    TimeOrderError
        The interval is negative or not finite.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 10.3: the extended Kalman filter; Vasiliev, Mattis, equations
    (5) and (7), for the models.
    """
    if model.coordinates is not estimate.coordinates:
        raise ConfigurationError(
            f"estimate: expected {model.coordinates.name} coordinates, found "
            f"{estimate.coordinates.name} coordinates"
        )
    slope = model.jacobian(estimate.mean, interval_s)
    covariance = slope @ estimate.covariance @ np.swapaxes(slope, -1, -2)
    covariance += model.noise(estimate.mean, interval_s)
    mean = model.transition(estimate.mean, interval_s)
    return Estimate(mean, symmetric_part(covariance), estimate.coordinates)


def update(
    estimate: Estimate,
    measurement: SpaceMeasurement,
    measured: ArrayLike,
    gate: float | None = None,
) -> Update:
    """Update an estimate with a measurement.

    Parameters
    ----------
    estimate : Estimate
        Predicted to the time of the measurement.
    measurement : SpaceMeasurement
        Sensor model with its noise.
    measured : (..., m) array_like
        One measurement per aircraft.
    gate : float, optional
        Largest accepted normalised innovation squared; None accepts all.

    Returns
    -------
    Update
        The updated estimate and the outcome. A rejected measurement leaves the estimate unchanged;
        NaN never enters it.

    Raises
    ------
    ShapeError
        A measurement has a wrong number of components.
    MotionParameterError
        The gate is not above 0.

    Notes
    -----
    The covariance is (I − K H) P (I − K H)ᵀ + K W Kᵀ, which stays positive semi-definite under
    rounding. Non-finite results are rejected without warnings.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 10.3: the extended Kalman filter; IMM UrO RAN report (2016),
    equations (1.22) and (1.28), and (1.26) with the noise term K D W Dᵀ Kᵀ.
    """
    if gate is not None:
        require_positive(gate, "gate")
    values = component_array(measured, "measurement", measurement.noise.shape[-1])
    with np.errstate(over="ignore", invalid="ignore"):
        return _update(estimate, measurement, values, np.inf if gate is None else gate)


def _update(
    estimate: Estimate, measurement: SpaceMeasurement, measured: Floats, gate: float
) -> Update:
    noise, position = measurement.noise, estimate.mean[..., :3]
    innovation = measurement.residual(measured, measurement.predict(position))
    slope = np.zeros((*estimate.mean.shape[:-1], noise.shape[-1], STATE_SIZE))
    slope[..., :3] = measurement.jacobian(position)
    spread = estimate.covariance @ np.swapaxes(slope, -1, -2)
    total = symmetric_part(slope @ spread + noise)
    inverse, regular = _inverse(total)
    safe = np.where(np.isfinite(innovation), innovation, 0.0)
    distance = (safe * (inverse @ safe[..., None])[..., 0]).sum(axis=-1)
    finite = np.isfinite(innovation).all(axis=-1) & np.isfinite(distance)
    corrected = _corrected(estimate, slope, spread @ inverse, safe, noise)
    finite &= np.isfinite(corrected.mean).all(axis=-1)
    reasons = {
        Outcome.NOT_FINITE: ~finite,
        Outcome.CONE_OF_SILENCE: ~measurement.usable(position),
        Outcome.GATED: regular & ~(distance <= gate),
        Outcome.SINGULAR: ~(regular & _sound(corrected.covariance)),
    }
    outcome = np.select(list(reasons.values()), list(reasons), Outcome.UPDATED).astype(np.int8)
    return Update(
        _where(outcome == Outcome.UPDATED, corrected, estimate),
        outcome,
        innovation,
        total,
        np.where(finite & regular, distance, np.inf),
    )


# x + K ν and (I − K H) P (I − K H)ᵀ + K W Kᵀ, in canonical form.
def _corrected(
    estimate: Estimate, slope: Floats, gain: Floats, innovation: Floats, noise: Floats
) -> Estimate:
    mean = estimate.mean + (gain @ innovation[..., None])[..., 0]
    left = np.eye(STATE_SIZE) - gain @ slope
    covariance = left @ estimate.covariance @ np.swapaxes(left, -1, -2)
    covariance += gain @ noise @ np.swapaxes(gain, -1, -2)
    mean, covariance = estimate.coordinates.canonical(mean, symmetric_part(covariance))
    return Estimate(mean, covariance, estimate.coordinates)


# The inverse, and whether it exists, by correlations: independent of units.
def _inverse(matrix: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    correlations, scale, positive = _correlations(matrix)
    eigenvalue = np.linalg.eigvalsh(correlations).min(axis=-1)
    regular = np.asarray(positive & (eigenvalue >= EIGENVALUE_MIN))
    correlations = np.where(regular[..., None, None], correlations, np.eye(matrix.shape[-1]))
    return np.linalg.inv(correlations) / scale, regular


# Whether the matrix is a covariance within rounding. It is not if the accepted measurement was
# so far off that metres and light seconds are mixed in one matrix.
def _sound(matrix: Floats) -> NDArray[np.bool_]:
    correlations, _, positive = _correlations(matrix)
    eigenvalue = np.linalg.eigvalsh(correlations).min(axis=-1)
    return np.asarray(positive & (eigenvalue >= -ROUNDING_MAX))


# Correlations (or the identity if undefined), their scale, and whether they are defined.
def _correlations(matrix: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    variances = np.diagonal(matrix, axis1=-2, axis2=-1)
    finite = np.isfinite(matrix).all(axis=(-2, -1))
    positive = np.asarray((variances > 0.0).all(axis=-1) & finite)
    sigmas = np.sqrt(np.where(variances > 0.0, variances, 1.0))
    scale = sigmas[..., :, None] * sigmas[..., None, :]
    whole = np.eye(matrix.shape[-1])
    return np.where(positive[..., None, None], matrix / scale, whole), scale, positive


def _where(chosen: NDArray[np.bool_], new: Estimate, old: Estimate) -> Estimate:
    return Estimate(
        np.where(chosen[..., None], new.mean, old.mean),
        np.where(chosen[..., None, None], new.covariance, old.covariance),
        old.coordinates,
    )
