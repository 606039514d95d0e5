"""The arrays of the sequential form, beside those of `multiradar.estimation.filters.arrays`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Store(NamedTuple):
    """What is kept of the biases beside `Model.bias` and `Model.bias_covariance`.

    Attributes
    ----------
    scale : (c,) float64
        Standard deviations of the prior: what the parameters are divided by in `information`.
    drift : (c,) float64
        Random walk of each parameter: standard deviation after one second.
    information : (c, c) float64
        Inverse of the covariance, scaled, for the filters that sum information.
    """

    scale: Floats
    drift: Floats
    information: Floats


class Record(NamedTuple):
    """What a filter says at chosen times, of every aircraft moved on to that time.

    Attributes
    ----------
    mean : (t, s, 4) float64
        States of the aircraft, NaN for one that has not started.
    covariance : (t, s, 4, 4) float64
        Their covariances, biases included.
    bias : (t, c) float64
        Estimates of the biases.
    bias_covariance : (t, c, c) float64
        Their covariance.
    outcomes : (o,) int64
        How many plots became what, by the number of `multiradar.estimation.filters.bank.Outcome`;
        zeros where no plots were played.
    """

    mean: Floats
    covariance: Floats
    bias: Floats
    bias_covariance: Floats
    outcomes: Integers


class Epoch(NamedTuple):
    """Room for the linearised measurements of one epoch, and for the gain of a filter in it.

    Attributes
    ----------
    value : (r, 2) float64
        Measurements of the true state without noise and biases.
    probe : (r, 2) float64
        Innovations that the gain is read off with: a small part of the sigma of their noise.
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
    """A filter's biases as they were before an epoch.

    Attributes
    ----------
    bias_covariance, factor, information : (c, c) float64
        As in `Model` and `Store`.
    """

    bias_covariance: Floats
    factor: Floats
    information: Floats
