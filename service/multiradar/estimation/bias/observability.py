"""Unobservable combinations of biases.

A filter shows that a bias is unobservable only by a sigma that stays at its prior. The range offset
of one radar may fall to a third of its prior sigma while the sum of two azimuth offsets remains
unknown; so combinations are evaluated, not only single parameters.
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

#: A combination of biases is unobservable while its variance exceeds this fraction of the prior
#: variance: the measurements then inform less about it than the prior.
UNOBSERVABLE_SHARE_MIN = 0.5
#: A parameter with more than this share of its variance in the unobservable space is named alone.
ALONE_SHARE_MIN = 0.95
#: Weights below this fraction of the largest are left out of the name of a combination.
WEIGHT_SHARE_MIN = 0.2
#: Parameters of one kind whose amounts differ by less than this fraction are named "together".
EQUAL_SHARE = 0.15

_WORDS = (
    "range offset", "azimuth offset", "range gain", "time offset", "azimuth sine",
    "azimuth cosine", "frame shift east", "frame shift north", "frame rotation",
)  # fmt: skip
# Effect that is common to sensors whose parameters of a kind cannot be separated from it.
_COMMON = {
    PARAMETER_RANGE_OFFSET: "a common offset of all ranges",
    PARAMETER_AZIMUTH_OFFSET: "a common rotation",
    PARAMETER_RANGE_GAIN: "a common scale",
}


@dataclass(frozen=True, slots=True)
class UnobservableBias:
    """A combination of biases that the measurements do not determine.

    Attributes
    ----------
    name : str
        In words, as `azimuth offsets of A and B together (a common turn)`.
    prior_ratio : float
        Its sigma over the prior sigma: 1 without any information.
    weights : tuple of c floats
        Weight of each parameter, in units of its prior sigma; the largest is 1.
    reason : str
        Why there is no information about it at all, and what to do; empty if there is some.
    """

    name: str
    prior_ratio: float
    weights: tuple[float, ...]
    reason: str = ""


def unobservable_combinations(
    sensors: SensorTable, covariance: Floats, elapsed_s: float = 0.0
) -> tuple[UnobservableBias, ...]:
    """Return the unobservable combinations of biases.

    Parameters
    ----------
    sensors : SensorTable
        The sensors, with prior and drift of their biases.
    covariance : (c, c) float64
        Covariance of the biases now.
    elapsed_s : float
        Time since the prior, s: without measurements a variance is that of the prior plus that of
        the drift.

    Returns
    -------
    tuple of UnobservableBias
        Independent combinations that span the unobservable space, single parameters first. Empty
        if all biases are observable.

    Notes
    -----
    With D² the diagonal of prior and drift, D⁻¹ P_ς D⁻¹ has the eigenvalues λ, the variances of
    combinations relative to the prior; those with λ above `UNOBSERVABLE_SHARE_MIN` are
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
    # Share of each parameter's variance in the unobservable space.
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
    # Rows that span the columns of `space`, each with a pivot of its own.
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
    """Name a combination; the largest weight of ``direction`` is 1."""
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
        way = "together" if weights.prod() > 0.0 else "with opposite signs"
        return f"{_WORDS[kinds[0]]} and {_WORDS[kinds[1]]} of {names[0]}, {way}"
    terms = [
        f"{weight:+.2f} {_WORDS[kind]} of {name}"
        for weight, kind, name in zip(weights, kinds, names, strict=True)
    ]
    return f"the combination {', '.join(terms)} (in prior sigmas)"


def _listed(names: list[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"
