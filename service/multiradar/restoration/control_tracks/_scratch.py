"""Scratch arrays of the kernels of a bundle."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class FitScratch(NamedTuple):
    """Arrays that `fit_track` writes; only H and g are read after it.

    Attributes
    ----------
    spare : (TRACK_COUNT,) float64
        The track of an attempt.
    H, g : (p, p), (p,) float64
        Derivatives of the functional by the parameters; after the fit H is its Cholesky factor at
        the parameters found.
    H2, g2 : (p, p), (p,) float64
        Those of an attempt.
    S, T : (4, p), (5, p) float64
        Derivatives of the state at the start of a segment, and products with them.
    M, r : (6, 6), (6,) float64
        Derivatives of the functional by state and controls of a segment.
    """

    spare: Floats
    H: Floats
    g: Floats
    H2: Floats
    g2: Floats
    S: Floats
    T: Floats
    M: Floats
    r: Floats


class BundleScratch(NamedTuple):
    """Further scratch arrays of `push_plot`."""

    A: Floats
    B: Floats
    grid: Floats
    traces: Floats
    order: Integers
    kept: Integers


class Scratch(NamedTuple):
    """All scratch arrays of a bundle; not preserved from plot to plot."""

    settling: FitScratch
    bundle: BundleScratch


def scratch(settings: BundleSettings) -> Scratch:
    """Return scratch arrays for bundles of these settings that do not work concurrently."""
    return Scratch(fit_scratch(), bundle_scratch(settings.window_s + settings.ahead_s))


def fit_scratch() -> FitScratch:
    """Return scratch arrays for one track at a time."""
    p = layout.PARAMETERS_MAX
    return FitScratch(
        np.zeros(layout.TRACK_COUNT), np.zeros((p, p)), np.zeros(p), np.zeros((p, p)), np.zeros(p),
        np.zeros((4, p)), np.zeros((5, p)), np.zeros((6, 6)), np.zeros(6),
    )  # fmt: skip


def bundle_scratch(grid_s: float) -> BundleScratch:
    """Return scratch arrays for a bundle whose tracks are compared over a time, s."""
    points = int(np.ceil(grid_s))
    many = layout.CANDIDATES_MAX
    return BundleScratch(
        np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(points), np.zeros((many, points, 4)),
        np.zeros(many, np.int64), np.zeros(many, np.int64),
    )  # fmt: skip
