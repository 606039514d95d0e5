"""Which combinations of biases the measurements have told nothing about.

A filter never knows that something cannot be seen: it says so by a sigma that stays what it was. A
single radar's range offset may look known to a third of its prior sigma, and the sum of two radars'
azimuth offsets not at all; so combinations are looked at, not parameters alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)

Floats = NDArray[np.float64]

#: A combination of biases counts as untold while its variance is more than this share of that
#: beforehand: the measurements have then said less about it than the prior did.
UNOBSERVABLE_SHARE_MIN = 0.5
#: A parameter that lies in the untold space but for this share of its variance is named alone.
ALONE_SHARE_MIN = 0.95
#: Parts of a combination below this share of its largest are left out of its name.
WEIGHT_SHARE_MIN = 0.2
#: Parameters of one kind that move by amounts that differ by less than this share move together.
EQUAL_SHARE = 0.15

_WORDS = ("range offset", "azimuth offset", "range gain", "time offset")
# What it is that is common to sensors whose parameters of a kind cannot be told apart from it.
_COMMON = {
    PARAMETER_RANGE_OFFSET: "one offset of all ranges",
    PARAMETER_AZIMUTH_OFFSET: "a common turn",
    PARAMETER_RANGE_GAIN: "a common scale",
}


@dataclass(frozen=True, slots=True)
class UnobservableBias:
    """A combination of biases about which the measurements have told nothing.

    Attributes
    ----------
    name : str
        In words, as `azimuth offsets of A and B together (a common turn)`.
    prior_ratio : float
        Its sigma over that beforehand: 1 where nothing at all was told.
    weights : tuple of c floats
        How far each parameter moves with it, in units of its prior sigma; the largest is 1.
    """

    name: str
    prior_ratio: float
    weights: tuple[float, ...]


def unobservable_combinations(
    sensors: SensorTable, covariance: Floats, elapsed_s: float = 0.0
) -> tuple[UnobservableBias, ...]:
    """Return the combinations of biases that the measurements have not told.

    Parameters
    ----------
    sensors : SensorTable
        The sensors, with prior and drift of their biases.
    covariance : (c, c) float64
        Covariance of the biases now.
    elapsed_s : float
        For how long the biases have walked since the prior held, s: what is not measured is known
        to the prior variance and that of the walk, and no worse.

    Returns
    -------
    tuple of UnobservableBias
        Independent combinations that span all that is untold, parameters that are untold by
        themselves first. Empty where everything is told.

    Notes
    -----
    With D² the diagonal of prior and walk, D⁻¹ P_ς D⁻¹ has the eigenvalues λ, the variances of
    combinations in units of those beforehand; those with λ above `UNOBSERVABLE_SHARE_MIN` are
    unobservable. Any rotation of eigenvectors of equal λ is equivalent, so row reduction with the
    largest pivots turns them into a basis of few parameters each.

    References
    ----------
    F. M. Ham, R. G. Brown, "Observability, eigenvalues, and Kalman filtering", IEEE Trans. AES 19
    (1983), 269-273: eigenvalues of the normalised covariance. Naming the combinations is the
    project's own.
    """
    beforehand = np.sqrt(sensors.prior_sigma**2 + sensors.drift**2 * elapsed_s)
    if len(beforehand) == 0:
        return ()
    scaled = covariance / np.outer(beforehand, beforehand)
    shares, vectors = np.linalg.eigh((scaled + scaled.T) / 2.0)
    space = vectors[:, shares > UNOBSERVABLE_SHARE_MIN]
    # By how much each parameter lies in the untold space.
    inside = np.sum(space**2, axis=1)
    alone = np.flatnonzero(inside > ALONE_SHARE_MIN)
    rest = space - np.eye(len(beforehand))[:, alone] @ space[alone]
    directions = [np.eye(len(beforehand))[one] for one in alone]
    directions += _simple_basis(rest, max(space.shape[1] - len(alone), 0))
    found = []
    for direction in directions:
        unit = direction / np.linalg.norm(direction)
        ratio = float(np.sqrt(unit @ scaled @ unit))
        found.append(UnobservableBias(_name(direction, sensors), ratio, tuple(direction.tolist())))
    return tuple(found)


def _simple_basis(space: Floats, count: int) -> list[Floats]:
    # Rows that span the columns of `space`, each with a pivot that the others do not have.
    left, sizes, _ = np.linalg.svd(space, full_matrices=False)
    rows = left[:, :count].T.copy()
    count = int(np.sum(sizes[:count] > 1e-6))
    rows = rows[:count]
    pivots: list[int] = []
    for one in range(count):
        free = np.abs(rows[one:])
        free[:, pivots] = 0.0
        row, column = divmod(int(np.argmax(free)), free.shape[1])
        rows[[one, one + row]] = rows[[one + row, one]]
        rows[one] /= rows[one, column]
        for other in range(count):
            if other != one:
                rows[other] -= rows[other, column] * rows[one]
        pivots.append(column)
    return [row / row[np.argmax(np.abs(row))] for row in rows]


def _name(direction: Floats, sensors: SensorTable) -> str:
    """Name a combination; ``direction`` has its largest weight at 1."""
    parts = np.flatnonzero(np.abs(direction) > WEIGHT_SHARE_MIN)
    kinds = sensors.parameter_kind[parts].tolist()
    names = [sensors.ids[one] for one in sensors.parameter_sensor[parts]]
    if len(parts) == 1:
        return f"{_WORDS[kinds[0]]} of {names[0]}"
    weights = direction[parts]
    moved = weights * sensors.prior_sigma[parts]
    if len(set(kinds)) == 1 and np.ptp(moved) < EQUAL_SHARE * np.abs(moved).max():
        common = f" ({_COMMON[kinds[0]]})" if kinds[0] in _COMMON else ""
        return f"{_WORDS[kinds[0]]}s of {_listed(names)} together{common}"
    if len(set(names)) == 1 and len(parts) == 2:
        way = "together" if weights.prod() > 0.0 else "one against the other"
        return f"{_WORDS[kinds[0]]} and {_WORDS[kinds[1]]} of {names[0]}, {way}"
    told = [
        f"{weight:+.2f} {_WORDS[kind]} of {name}"
        for weight, kind, name in zip(weights, kinds, names, strict=True)
    ]
    return f"the combination {', '.join(told)} (in prior sigmas)"


def _listed(names: list[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"
