"""Motion modes of live tracks, as estimated by the IMM filter."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import DENSE_MAX
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.filters.imm._mode_kernels import STRAIGHT_AT_FIRST

Floats = NDArray[np.float64]
Indices = NDArray[np.intp] | slice
#: Tracks, and the biases on which they depend.
Groups = Iterable[tuple[Indices, Indices]]

#: Tracks of a group.
GROUP_TRACKS = 32


@dataclass(frozen=True, slots=True)
class ModeStates:
    """Motion mode estimates, one row per track.

    Attributes
    ----------
    probability : (n, j) float64
        Mode probabilities; they sum to one.
    mean : (n, j, 4) float64
        East and north in the system plane, m, and their rates, m/s.
    covariance : (n, j, 10) float64
        Upper triangles of the covariances of `mean`, row by row, including the uncertainty of the
        biases.
    """

    probability: Floats
    mean: Floats
    covariance: Floats


def mode_states(
    aircraft: Aircraft, slots: NDArray[np.intp], bias: Floats, factor: Floats,
    groups: Groups | None = None,
) -> ModeStates:  # fmt: skip
    """Return the mode estimates of aircraft at the published biases.

    Parameters
    ----------
    aircraft : Aircraft
        Aircraft of a filter with motion modes.
    slots : (n,) int
        Their slots; the tracks have been initiated.
    bias : (c,) float64
        Published bias estimate.
    factor : (c, c) float64
        Upper triangular Lᵀ with L Lᵀ = its covariance.
    groups : iterable, optional
        The tracks in groups, if already known: see `groups_by_columns`.

    Returns
    -------
    ModeStates
        Before the second plot all modes have the state of the track, as in the filter.
    """
    count = aircraft.mode_probability.shape[1]
    rows = slots[:, None] * count + np.arange(count)
    probability = aircraft.mode_probability[slots]
    mean, covariance = aircraft.mode_mean[rows], aircraft.mode_covariance[rows]
    new = np.isnan(probability[:, 0])
    probability[new] = (1.0 - STRAIGHT_AT_FIRST) / (count - 1)
    probability[new, 0] = STRAIGHT_AT_FIRST
    mean[new] = aircraft.mean[slots[new], None]
    covariance[new] = aircraft.covariance[slots[new], None]
    spread = np.empty((len(slots), count, 4, 4))
    groups = groups_by_columns(aircraft.sensitivity[slots]) if groups is None else groups
    for some, columns in groups:
        sensitivity = _columns_of(aircraft.mode_sensitivity, rows[some], columns)
        sensitivity[new[some]] = aircraft.sensitivity[slots[some][new[some]], None][..., columns]
        mean[some] += sensitivity @ bias[columns]
        root = times(sensitivity, factor.T[columns])
        spread[some] = root @ root.swapaxes(-1, -2)
    upper = np.triu_indices(4)
    reporting = ~new & ~np.isnan(aircraft.slow[slots, 0])
    slow = aircraft.slow_sensitivity[rows[reporting]]
    spread[reporting] += (
        slow @ aircraft.slow_covariance[slots[reporting], None] @ slow.swapaxes(-1, -2)
    )
    return ModeStates(probability, mean, covariance + spread[..., upper[0], upper[1]])


def _columns_of(matrices: Floats, rows: NDArray[np.intp], columns: Indices) -> Floats:
    """Return some columns of matrices, (..., 4, a)."""
    if isinstance(columns, slice):
        return matrices[rows][..., columns]
    # Only these are read: of a hundred sensors, whole matrices would be ten times as large. Column
    # by column, as in `matrices[rows][..., columns]`: products depend on it to the last bit.
    height, width = matrices.shape[1:]
    begin = width * (height * rows[..., None] + np.arange(height)).ravel()
    chosen: Floats = matrices.ravel().take(columns[:, None] + begin)
    return chosen.T.reshape(*rows.shape, height, len(columns))


def times(matrices: Floats, other: Floats) -> Floats:
    """Return the products of matrices with another one, as a single product.

    Parameters
    ----------
    matrices : (..., k) float64
        The matrices, as rows.
    other : (k, l) float64
        The other one.

    Returns
    -------
    (..., l) float64
        The products.
    """
    before = matrices.shape[:-1]
    product: Floats = matrices.reshape(math.prod(before), len(other)) @ other
    return product.reshape(*before, other.shape[1])


def groups_by_columns(
    sensitivity: Floats,
) -> Iterator[tuple[Indices, Indices]]:
    """Yield tracks in groups, with the biases on which any of a group depends.

    Parameters
    ----------
    sensitivity : (n, 4, c) float64
        Derivatives of the states by the biases.

    Yields
    ------
    tracks : (k,) int or slice
        Tracks that depend on the biases of much the same sensors; each track is in one group.
    columns : (a,) int or slice
        The columns that are not zero for all of them; up to `DENSE_MAX` columns, all.
    """
    count, _, width = sensitivity.shape
    if width <= DENSE_MAX:
        yield slice(None), slice(None)
        return
    used = (sensitivity != 0.0).any(axis=1)
    order = np.argsort(used.argmax(axis=1), kind="stable")
    for begin in range(0, count, GROUP_TRACKS):
        tracks = order[begin : begin + GROUP_TRACKS]
        yield tracks, np.flatnonzero(used[tracks].any(axis=0))
