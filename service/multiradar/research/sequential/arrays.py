"""Arrays of the sequential form, in addition to `multiradar.estimation.filters.arrays`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Aircraft

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Store(NamedTuple):
    """State of the biases in addition to `Model.bias` and `Model.bias_covariance`.

    Attributes
    ----------
    scale : (c,) float64
        Standard deviations of the prior: scales of the parameters in `information`.
    drift : (c,) float64
        Random walk of each parameter: standard deviation after one second.
    information : (c, c) float64
        Inverse of the covariance, scaled, for the filters that sum information.
    """

    scale: Floats
    drift: Floats
    information: Floats


class Record(NamedTuple):
    """Estimates of a filter at given times, of every aircraft predicted to that time.

    Attributes
    ----------
    mean : (t, s, 4) float64
        States of the aircraft, NaN before initiation.
    covariance : (t, s, 4, 4) float64
        Their covariances, biases included.
    bias : (t, c) float64
        Estimates of the biases.
    bias_covariance : (t, c, c) float64
        Their covariance.
    outcomes : (o,) int64
        Number of plots by outcome, see `multiradar.estimation.filters.bank.Outcome`; zeros without
        plots.
    """

    mean: Floats
    covariance: Floats
    bias: Floats
    bias_covariance: Floats
    outcomes: Integers


class Epoch(NamedTuple):
    """Scratch for the linearised measurements of one epoch, and for the gain of a filter in it.

    Attributes
    ----------
    value : (r, 2) float64
        Measurements of the true state without noise and biases.
    probe : (r, 2) float64
        Test innovations for measuring the gain: a small fraction of the sigma of their noise.
    by_position : (r, 2, 2) float64
        H: derivative by east and north.
    by_bias : (r, 2, c) float64
        J: derivative by the biases.
    noise : (r, 3) float64
        W: upper triangles of the covariance of the noise.
    gain, spread, half : (2 r, 4 s + c) float64
        K, M and B of `_theory_kernels`, transposed.
    """

    value: Floats
    probe: Floats
    by_position: Floats
    by_bias: Floats
    noise: Floats
    gain: Floats
    spread: Floats
    half: Floats


class Saved(NamedTuple):
    """The bias arrays of a filter before an epoch.

    Attributes
    ----------
    bias_covariance, factor, information : (c, c) float64
        As in `Model` and `Store`.
    """

    bias_covariance: Floats
    factor: Floats
    information: Floats


class Truth(NamedTuple):
    """The true motion of a covariance analysis; the filter has its own density and drift.

    Attributes
    ----------
    states : (n, 4) float64
        East, north (m) and their rates (m/s) of the aircraft of each row at its time.
    density : float
        Density of the acceleration, m²/s³.
    drift : (c,) float64
        Random walk of each bias: standard deviation after one second.
    """

    states: Floats
    density: float
    drift: Floats


class TheoryScratch(NamedTuple):
    """Scratch of a covariance analysis.

    Attributes
    ----------
    twin : Aircraft
        Copy of the aircraft before an epoch.
    saved : Saved
        The same of the biases.
    epoch : Epoch
        The epoch being processed.
    """

    twin: Aircraft
    saved: Saved
    epoch: Epoch


class TheoryRecord(NamedTuple):
    """Output of a covariance analysis, at each of its times.

    Attributes
    ----------
    covariance : (t, n, n) float64
        True covariance of the error of the stacked state, aircraft first (n = 4 s + c).
    transition : (t, n, n) float64
        Contribution of the error at the time before to the error at this time.
    reported : Record
        Estimates of the filter.
    """

    covariance: Floats
    transition: Floats
    reported: Record
