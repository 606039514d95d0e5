"""Arrays that the kernels of a bundle work in."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks.settings import BundleSettings

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class FitScratch(NamedTuple):
    """What `settle` works in: a track, derivatives twice, and those of a segment."""

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
    """What `take_plot` works in beside that."""

    A: Floats
    B: Floats
    grid: Floats
    traces: Floats
    order: Integers
    kept: Integers


class Scratch(NamedTuple):
    """All that a bundle works in and need not keep from plot to plot."""

    settling: FitScratch
    bundle: BundleScratch


def scratch(settings: BundleSettings) -> Scratch:
    """Return memory for bundles of these settings that take their plots one after the other."""
    return Scratch(fit_scratch(), bundle_scratch(settings.window_s + settings.ahead_s))


def fit_scratch() -> FitScratch:
    """Return memory for one track at a time."""
    p = layout.PARAMETERS_MAX
    return FitScratch(
        np.zeros(layout.TRACK_COUNT), np.zeros((p, p)), np.zeros(p), np.zeros((p, p)), np.zeros(p),
        np.zeros((4, p)), np.zeros((5, p)), np.zeros((6, 6)), np.zeros(6),
    )  # fmt: skip


def bundle_scratch(grid_s: float) -> BundleScratch:
    """Return memory for a bundle whose tracks are compared over so many seconds."""
    points = int(np.ceil(grid_s))
    many = layout.CANDIDATES_MAX
    return BundleScratch(
        np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(points), np.zeros((many, points, 4)),
        np.zeros(many, np.int64), np.zeros(many, np.int64),
    )  # fmt: skip
