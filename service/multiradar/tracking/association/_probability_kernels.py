"""Compiled joint association probabilities of the plots and tracks of one scan.

An event assigns every plot to one track at most, or to two that the sensor does not resolve, and
every track one plot at most. Its weight is the product of the likelihood ratios of its pairs,
relative to a false plot and a missed track. The probability of a pair is the weight of the events
that contain it over the weight of all events.

Symbols: w = likelihood ratios, β = probabilities of pairs (rows: plots; columns: tracks), γ =
probabilities that a plot is unresolved between this track and another, Z, T = sets of plots and of
tracks, as bits.

References
----------
Bar-Shalom, Y., Fortmann, T. E., "Tracking and Data Association" (1988), section 9.3 (JPDA);
Blom, H. A. P., Bloem, E. A., "Probabilistic data association avoiding track coalescence", IEEE
Transactions on Automatic Control 45 (2000), 247-259 (JPDA*: of the events that hold the same plots
and the same tracks only the likeliest counts). Cutting clusters by what a pair costs at best is the
project's own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.tracking.association._assignment_kernels import least_cost, root_of
from multiradar_compiled.kernels import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Maximum number of plots, and of tracks, of a cluster whose events are enumerated.
EXACT_MAX = 8
# Larger clusters are split at the first of these thresholds that makes them small enough: a pair is
# removed when the best event with it is less likely than the best event of all by more than this,
# as a logarithm.
CUTS = (12.0, 9.0, 6.0, 4.0, 2.5)
# A cluster with more plots keeps its hard assignment.
CUT_ROWS_MAX = 64
# Bound of scores: a larger likelihood ratio is certain, and products of eight must not overflow.
SCORE_MAX = 60.0


@kernel
def joint_probabilities(w: Floats, merged: Floats, best: bool, beta: Floats, gamma: Floats) -> None:
    """Fill β with probabilities of pairs: of all events, or of the ``best`` for each Z and T.

    ``w`` has `EXACT_MAX` rows and columns at most; 0 for an impossible pair. ``merged[i, k, l]``
    with k < l is the weight of plot i being unresolved between both tracks. γ receives the
    probability that plot i is unresolved between track k and another.
    """
    rows, columns = w.shape
    value = np.zeros((1 << rows, 1 << columns))
    choice = np.full((1 << rows, 1 << columns), NONE, np.int64)
    value[0, 0] = 1.0
    total = 1.0
    for Z in range(1, 1 << rows):
        i = 0
        while not Z >> i & 1:
            i += 1
        rest = Z & ~(1 << i)
        for T in range(1, 1 << columns):
            most = 0.0
            for k in range(columns):
                if not T >> k & 1:
                    continue
                # Track k alone (m = k), or with a later one.
                for m in range(k, columns):
                    if not T >> m & 1:
                        continue
                    weight = w[i, k] if m == k else merged[i, k, m]
                    one = weight * value[rest, T & ~(1 << k | 1 << m)]
                    if best:
                        if one > most:
                            most = one
                            choice[Z, T] = k * columns + m
                    else:
                        most += one
            value[Z, T] = most
            total += most
    beta[:] = 0.0
    gamma[:] = 0.0
    if best:
        add_likeliest(value, choice, columns, beta, gamma)
    else:
        add_all(w, merged, value, beta, gamma)
    beta /= total
    gamma /= total


@kernel
def add_likeliest(
    value: Floats, choice: Integers, columns: int, beta: Floats, gamma: Floats
) -> None:
    """Add the weight of the likeliest event of each Z and T to its pairs."""
    for Z in range(value.shape[0]):
        for T in range(value.shape[1]):
            plots, tracks, i = Z, T, 0
            while plots and choice[Z, T] != NONE:
                if plots >> i & 1:
                    k, m = divmod(choice[plots, tracks], columns)
                    if k == m:
                        beta[i, k] += value[Z, T]
                    else:
                        gamma[i, k] += value[Z, T]
                        gamma[i, m] += value[Z, T]
                    plots &= ~(1 << i)
                    tracks &= ~(1 << k | 1 << m)
                i += 1


@kernel
def add_all(w: Floats, merged: Floats, value: Floats, beta: Floats, gamma: Floats) -> None:
    """Add the weights of all events to their pairs: pair weight times that of the other pairs."""
    rows, columns = w.shape
    for i in range(rows):
        for k in range(columns):
            beta[i, k] = w[i, k] * weight_of_others(value, 1 << i, 1 << k)
            for m in range(k + 1, columns):
                if merged[i, k, m] > 0.0:
                    one = merged[i, k, m] * weight_of_others(value, 1 << i, 1 << k | 1 << m)
                    gamma[i, k] += one
                    gamma[i, m] += one


@kernel
def weight_of_others(value: Floats, plots: int, tracks: int) -> float:
    """Return the weight of all events without these plots and tracks."""
    total = 0.0
    for Z in range(value.shape[0]):
        for T in range(value.shape[1]):
            if not (Z & plots or T & tracks):
                total += value[Z, T]
    return total


@kernel
def losses(scores: Floats) -> Floats:
    """Return by how much the best event with each pair is less likely than the best of all.

    The best assignment has the least cost. Forcing a pair into it moves others along chains of
    pairs, whose cheapest ones Floyd and Warshall find: plots that lose their track, and plots that
    gain a free one. The result never exceeds the true loss.
    """
    rows, columns = scores.shape
    C = np.zeros((rows, columns + rows))
    C[:, :columns] = np.where(scores > -np.inf, -scores, 1e9)
    assigned = np.empty(rows, np.int64)
    least_cost(C, assigned)
    owner = np.full(columns + rows, NONE, np.int64)
    chain = np.empty((rows, rows))
    end = np.zeros(rows)
    for i in range(rows):
        owner[assigned[i]] = i
    for i in range(rows):
        own = C[i, assigned[i]]
        for j in range(rows):
            chain[i, j] = C[i, assigned[j]] - own
        end[i] = -own
        for k in range(columns):
            if owner[k] == NONE:
                end[i] = min(end[i], C[i, k] - own)
    for j in range(rows):
        for i in range(rows):
            for m in range(rows):
                chain[i, m] = min(chain[i, m], chain[i, j] + chain[j, m])
    loss = np.full((rows, columns), np.inf)
    for i in range(rows):
        gain = min(0.0, np.min(chain[:, i]))
        for k in range(columns):
            if scores[i, k] > -np.inf:
                moved = 0.0 if owner[k] == i else gain
                if owner[k] not in (NONE, i):
                    moved = min(chain[owner[k], i], gain + np.min(chain[owner[k]] + end))
                loss[i, k] = max(0.0, C[i, k] - C[i, assigned[i]] + moved)
    return loss


@kernel
def label_clusters(linked: NDArray[np.bool_], labels: Integers) -> int:
    """Assign cluster numbers to rows (first) and columns; return the largest side of a cluster."""
    rows, columns = linked.shape
    parents = np.arange(rows + columns)
    for i in range(rows):
        for k in range(columns):
            if linked[i, k]:
                a, b = root_of(parents, i), root_of(parents, rows + k)
                parents[max(a, b)] = min(a, b)
    sides = np.zeros((rows + columns, 2), np.int64)
    for one in range(rows + columns):
        labels[one] = root_of(parents, one)
        sides[labels[one], int(one >= rows)] += 1
    return int(sides.max())


@kernel
def pair_probabilities(
    scores: Floats, merged: Floats, best: bool, beta: Floats, gamma: Floats
) -> bool:
    """Fill β and γ of a component of plots and tracks; return whether that was possible.

    ``scores`` and ``merged`` are logarithms of weights, −∞ for impossible pairs.
    """
    rows, columns = scores.shape
    linked = scores > -np.inf
    labels = np.empty(rows + columns, np.int64)
    side = label_clusters(linked, labels)
    if side > EXACT_MAX:
        if rows > CUT_ROWS_MAX:
            return False
        loss = losses(scores)
        for cut in CUTS:
            linked = loss <= cut
            side = label_clusters(linked, labels)
            if side <= EXACT_MAX:
                break
    if side > EXACT_MAX:
        return False
    for label in range(rows + columns):
        mine = np.flatnonzero(labels == label)
        plots, tracks = mine[mine < rows], mine[mine >= rows] - rows
        if len(plots) == 0 or len(tracks) == 0:
            continue
        fill_cluster(scores, merged, linked, plots, tracks, best, beta, gamma)
    return True


@kernel
def fill_cluster(
    scores: Floats,
    merged: Floats,
    linked: NDArray[np.bool_],
    plots: Integers,
    tracks: Integers,
    best: bool,
    beta: Floats,
    gamma: Floats,
) -> None:
    """Fill β and γ of the plots and tracks of one cluster."""
    rows, columns = len(plots), len(tracks)
    w = np.zeros((rows, columns))
    both = np.zeros((rows, columns, columns))
    for a in range(rows):
        for b in range(columns):
            if linked[plots[a], tracks[b]]:
                w[a, b] = math.exp(min(scores[plots[a], tracks[b]], SCORE_MAX))
            for c in range(b + 1, columns):
                first, second = min(tracks[b], tracks[c]), max(tracks[b], tracks[c])
                both[a, b, c] = math.exp(min(merged[plots[a], first, second], SCORE_MAX))
    of_one = np.empty((rows, columns))
    of_two = np.empty((rows, columns))
    joint_probabilities(w, both, best, of_one, of_two)
    for a in range(rows):
        for b in range(columns):
            beta[plots[a], tracks[b]] = of_one[a, b]
            gamma[plots[a], tracks[b]] = of_two[a, b]
