"""Compiled treatment of time offsets in the two-stage filter and the IMM on it.

A time stamp that is late by τ displaces a plot by −v τ, so the derivative of a measurement by a
time offset depends on the estimated velocity v of the aircraft: J = −H v. A common delay of all
sensors is unobservable, because it is equivalent to aircraft farther along their paths; the filter
must preserve that.

It does so exactly if one velocity is used throughout. Then V summed over the time offsets of all
sensors is (v, 0), H V + J summed is zero, and no measurement informs about the common delay.
An aircraft therefore stores the velocity v at which its time offsets are linearised. When the
estimate changes, `relinearise_time_offsets` updates v and V together: each column changes by its
share of the difference, and so does a, so that χ̂ = a + V ς̂ is unchanged. An aircraft contributes to
no bias until its velocity is known. Then it is reinitialised at a plot with that velocity
(`initialise_with_velocity`).

The modes of the IMM share v, the velocity of their mixture: then V of each mode, and every mixture
of them, sums to (v, 0), which turning, mixing and correcting preserve.

Symbols as in `_two_stage_kernels`; v = velocity at which time offsets are linearised.

References
----------
The project's own, within the two-stage filter of Friedland, B., "Treatment of bias in recursive
filtering", IEEE TAC 14 (1969), 359-367.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._delay_kernels import initialise_with_delay
from multiradar.estimation.filters._kernels import BIASES_KEPT, STARTED
from multiradar.estimation.filters._start_kernels import start_aircraft
from multiradar.estimation.filters.arrays import Aircraft, Model, Sight
from multiradar.estimation.filters.two_stage._two_stage_kernels import component
from multiradar.estimation.measurement._kernels import PARAMETER_TIME_OFFSET
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# A velocity is known after this many plots if the root of the sum of both its variances, m/s, is
# below this. With 8, 15 and 30 m/s the NEES of the biases is the same, 0.9 for each parameter.
PLOTS_MIN = 4
VELOCITY_SIGMA_MAX = 30.0
# Speed below which the weights of the sensors are limited, and that of a standing aircraft, m/s.
SPEED_MIN = 20.0
STANDING_MAX = 0.1


@in_loop
def has_time_offset(parameters: Integers) -> bool:
    """Return whether the time offset of any sensor is estimated."""
    found = False
    for c in range(parameters.shape[0]):
        found = found or parameters[c] == PARAMETER_TIME_OFFSET
    return found


@in_loop
def offset_velocity(velocities: Floats, k: int) -> tuple[float, float]:
    """Return the velocity at which time offsets of aircraft k are linearised; 0 while unknown."""
    if np.isnan(velocities[k, 0]):
        return 0.0, 0.0
    return velocities[k, 0], velocities[k, 1]


@in_loop
def update_offset_velocity(
    sight: Sight, k: int, s: int, site_number: int, model: Model, aircraft: Aircraft, H: Floats,
    W: Floats,
) -> None:  # fmt: skip
    """Relinearise at the updated velocity of aircraft k, or re-initialise once it is known.

    The modes of an aircraft follow: they share one velocity, since each must be without information
    about a common delay, and their mixture, too.
    """
    starts, parameters, bias = model.starts, model.parameters, model.bias
    bias_covariance = model.bias_covariance
    means, covariances, V = aircraft.mean, aircraft.covariance, aircraft.sensitivity
    velocities, updates = aircraft.velocity, aircraft.updates
    v0 = component(means, V, bias, k, 2)
    v1 = component(means, V, bias, k, 3)
    spread = velocity_variance(covariances, V, bias_covariance, k)
    if not np.isnan(velocities[k, 0]):
        relinearise_aircraft(k, aircraft, parameters, bias, v0, v1)
    elif updates[k] + 1 >= PLOTS_MIN and spread < VELOCITY_SIGMA_MAX**2:
        started = start_aircraft(BIASES_KEPT, sight, s, model, means[k], covariances[k], V[k], H, W)
        if started == STARTED:
            aircraft.measured_from[k] = site_number
            if aircraft.mode_probability.shape[1] > 0:
                aircraft.mode_probability[k, 0] = np.nan
            initialise_with_velocity(
                means, covariances, V, velocities, k, starts[s], starts[s + 1], parameters, v0,
                v1, spread,
            )  # fmt: skip
            if aircraft.delay.shape[1] > 0:
                initialise_with_delay(k, sight.kind, s, H, model, aircraft)


@in_loop
def velocity_variance(covariances: Floats, V: Floats, bias_covariance: Floats, k: int) -> float:
    """Return the sum of the variances of both rates of aircraft k, including the biases."""
    total: float = covariances[k, 7] + covariances[k, 9]
    n = bias_covariance.shape[0]
    for c in range(n):
        for d in range(n):
            v = V[k, 2, c] * V[k, 2, d] + V[k, 3, c] * V[k, 3, d]
            total += v * bias_covariance[c, d]
    return total


@in_loop
def initialise_with_velocity(
    means: Floats,
    covariances: Floats,
    V: Floats,
    velocities: Floats,
    k: int,
    first: int,
    last: int,
    parameters: Integers,
    v0: float,
    v1: float,
    variance: float,
) -> None:
    """Set the estimated velocity of an aircraft that was just initiated at a plot.

    ``variance`` is the sum of the variances of both rates, assigned to each of them. The position
    depends on the time offset of the sensor: ∂χ/∂τ = −H⁻¹ J = v.
    """
    means[k, 2] = v0
    means[k, 3] = v1
    covariances[k, 7] = variance
    covariances[k, 9] = variance
    velocities[k, 0] = v0
    velocities[k, 1] = v1
    for c in range(first, last):
        if parameters[c] == PARAMETER_TIME_OFFSET:
            # a is the position at bias zero: that of the plot, for any time offset.
            V[k, 0, c] = v0
            V[k, 1, c] = v1


@in_loop
def relinearise_aircraft(
    k: int, aircraft: Aircraft, parameters: Integers, bias: Floats, v0: float, v1: float
) -> None:
    """Linearise the time offsets of aircraft k and of its modes at the velocity (v0, v1)."""
    old = aircraft.velocity[k]
    speed = math.sqrt(old[0] * old[0] + old[1] * old[1])
    # The weights of a standing aircraft need some velocity.
    if speed > SPEED_MIN or math.sqrt(v0 * v0 + v1 * v1) > STANDING_MAX:
        slow = not speed > SPEED_MIN
        relinearise_time_offsets(
            aircraft.mean, aircraft.sensitivity, k, old, slow, parameters, bias, v0, v1
        )
        count = aircraft.mode_probability.shape[1]
        for row in range(k * count, (k + 1) * count):
            relinearise_time_offsets(
                aircraft.mode_mean, aircraft.mode_sensitivity, row, old, slow, parameters, bias,
                v0, v1,
            )  # fmt: skip
        old[0] = v0
        old[1] = v1


@in_loop
def relinearise_time_offsets(
    means: Floats,
    V: Floats,
    row: int,
    old: Floats,
    slow: bool,
    parameters: Integers,
    bias: Floats,
    v0: float,
    v1: float,
) -> None:
    """Linearise the time offsets of a state at the velocity (v0, v1) instead of ``old``.

    χ̂ does not change. With a ``slow`` old velocity the weights of the sensors, which divide by it,
    are limited to [0, 1] with the sum kept at most 1, and V becomes what they say: a taxiing
    aircraft that takes off would else carry rounding and small errors along, times its speed.
    """
    d0 = v0 - old[0]
    d1 = v1 - old[1]
    squared = old[0] * old[0] + old[1] * old[1]
    total = 1.0
    if slow:
        total = 0.0
        for c in range(bias.shape[0]):
            if parameters[c] == PARAMETER_TIME_OFFSET:
                total += limited(V[row, 0, c] * old[0] + V[row, 1, c] * old[1], squared)
        total = max(total, 1.0)
    for c in range(bias.shape[0]):
        if parameters[c] == PARAMETER_TIME_OFFSET:
            # Weight of this sensor in the position of the aircraft; all weights add up to one.
            share = (V[row, 0, c] * old[0] + V[row, 1, c] * old[1]) / squared
            c0, c1 = share * d0, share * d1
            if slow:
                share = limited(V[row, 0, c] * old[0] + V[row, 1, c] * old[1], squared) / total
                c0, c1 = share * v0 - V[row, 0, c], share * v1 - V[row, 1, c]
            V[row, 0, c] += c0
            V[row, 1, c] += c1
            means[row, 0] -= c0 * bias[c]
            means[row, 1] -= c1 * bias[c]


@in_loop
def limited(along: float, squared: float) -> float:
    """Return the ratio limited to [0, 1]; 1 without a velocity."""
    share = 1.0
    if along < squared:
        share = max(along / squared, 0.0)
    return share
