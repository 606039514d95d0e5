"""Moments of straight flight with manoeuvres that have not started yet.

The heading is a Markov process: straight flight ends at a rate, a turn at one of several turn rates
to either side follows, and ends at a rate. The moments of position and velocity of this process
obey linear differential equations and are exact.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from multiradar.restoration.forecast.settings import AHEAD_MAX_S, ForecastSettings

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

#: Step of the table of moments, s.
STEP_S = 2.0
#: Durations of straight flight are rounded to steps of 1/8 of the natural logarithm, within limits.
_STEPS_PER_E, _SHORTEST_S, _LONGEST_S = 8.0, 10.0, 1e5
#: Moments of each state of the process: probability; means of z, z²; of x; of x z̄, x z; of |x|²,
#: x². z = direction, x = displacement at unit speed, as complex numbers: along, and i to the right.
_CHANCE, _Z, _ZZ, _X, _X_CONJUGATE_Z, _XZ, _X_SQUARE, _XX = range(8)
_MOMENTS = 8
#: Columns of the table: means along, to the right, of their rates, then their covariance.
MEANS, SPREADS = 4, 10


def rounded_duration_s(duration_s: float) -> float:
    """Return a duration of straight flight rounded to a step of the tables.

    Parameters
    ----------
    duration_s : float
        Mean duration.

    Returns
    -------
    float
        Rounded duration, within 7 %.
    """
    bounded = min(max(duration_s, _SHORTEST_S), _LONGEST_S)
    return float(np.exp(np.round(_STEPS_PER_E * np.log(bounded)) / _STEPS_PER_E))


@lru_cache(maxsize=128)
def later_turn_moments(straight_s: float, settings: ForecastSettings) -> Floats:
    """Return moments of position and velocity if straight flight has ended by a turn to the right.

    Parameters
    ----------
    straight_s : float
        Mean duration of straight flight; changes of speed end it too, without a change of heading.
    settings : ForecastSettings
        Turn rates, and their mean duration.

    Returns
    -------
    (n, MEANS + SPREADS) ndarray
        At 0, `STEP_S`, … up to `AHEAD_MAX_S` after a state of unit speed along the first axis, if
        a turn to the right has started since: means of along, right and their rates, and the upper
        triangle of their covariance, row by row. For a turn to the left, moments odd in right
        change their sign. Read-only.

    References
    ----------
    The project's own: moments of a Markov process of the heading.
    """
    turning, transitions = _process(straight_s, settings)
    states = len(turning)
    step = expm(STEP_S * _generator(turning, transitions))
    moments = np.zeros((_MOMENTS, states), np.complex128)
    moments[:_X, 0] = 1.0
    count = int(AHEAD_MAX_S / STEP_S) + 1
    table = np.zeros((count, MEANS + SPREADS))
    for k in range(count):
        # The first state is straight flight that has not ended.
        sums = moments[:, 1:].sum(axis=1)
        if k:
            table[k] = _moments_of(sums / sums[_CHANCE].real)
        moments = (step @ moments.ravel()).reshape(_MOMENTS, states)
    table[0, 2] = 1.0
    table.setflags(write=False)
    return table


# Turn rates of the states, and the matrix of transition rates. States: straight flight before the
# first turn, first turns to the right, straight flight afterwards, later turns right and left.
def _process(straight_s: float, settings: ForecastSettings) -> tuple[Floats, Floats]:
    rates = np.array(settings.turn_rates_rad_per_s)
    count = len(rates)
    turning = np.concatenate([[0.0], rates, [0.0], rates, -rates])
    after = 1 + count
    transitions = np.zeros((len(turning), len(turning)))
    begins = settings.later_turns / straight_s
    transitions[1:after, 0] = begins / count
    transitions[after + 1 :, after] = begins / (2 * count)
    transitions[after, 1:after] = transitions[after, after + 1 :] = 1.0 / settings.turn_s
    transitions -= np.diag(transitions.sum(axis=0))
    return turning, transitions


# d/dt of all moments: transitions between states, dz/dt = i ω z, dx/dt = z.
def _generator(turning: Floats, transitions: Floats) -> Complexes:
    states = len(turning)
    unit = np.eye(states)
    found = np.kron(np.eye(_MOMENTS), transitions).astype(np.complex128)
    blocks = found.reshape(_MOMENTS, states, _MOMENTS, states)
    turn = 1j * np.diag(turning)
    blocks[_Z, :, _Z] += turn
    blocks[_ZZ, :, _ZZ] += 2.0 * turn
    blocks[_X, :, _Z] += unit
    blocks[_X_CONJUGATE_Z, :, _CHANCE] += unit
    blocks[_X_CONJUGATE_Z, :, _X_CONJUGATE_Z] -= turn
    blocks[_XZ, :, _ZZ] += unit
    blocks[_XZ, :, _XZ] += turn
    # |x|² grows by twice the real part of x z̄; the imaginary part remains separate and is dropped
    # when the sum is read.
    blocks[_X_SQUARE, :, _X_CONJUGATE_Z] += 2.0 * unit
    blocks[_XX, :, _XZ] += 2.0 * unit
    return found


def _moments_of(mean: Complexes) -> Floats:
    x, z = mean[_X], mean[_Z]
    first = np.array([x.real, x.imag, z.real, z.imag])
    square, double = mean[_X_SQUARE].real, mean[_XX]
    beside, product, turned = mean[_X_CONJUGATE_Z], mean[_XZ], mean[_ZZ]
    second = np.empty((4, 4))
    second[0, 0], second[1, 1] = 0.5 * (square + double.real), 0.5 * (square - double.real)
    second[0, 1] = 0.5 * double.imag
    second[0, 2] = 0.5 * (beside.real + product.real)
    second[1, 3] = 0.5 * (beside.real - product.real)
    second[0, 3] = 0.5 * (product.imag - beside.imag)
    second[1, 2] = 0.5 * (product.imag + beside.imag)
    second[2, 2], second[3, 3] = 0.5 * (1.0 + turned.real), 0.5 * (1.0 - turned.real)
    second[2, 3] = 0.5 * turned.imag
    spread = second - np.outer(first, first)
    return np.concatenate([first, spread[np.triu_indices(4)]])
