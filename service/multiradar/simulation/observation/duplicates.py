"""Duplicate plots received through a second network with its own rounding."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.observation.detections import wrapped
from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.scenario.model import SecondFeed

Floats = NDArray[np.float64]


def duplicated(rows: Measurements, feed: SecondFeed, rng: np.random.Generator) -> Measurements:
    """Return the measurements received a second time.

    Parameters
    ----------
    rows : Measurements
        The measurements of one radar.
    feed : SecondFeed
        The fraction received, and their rounding.
    rng : Generator
        Draws the duplicates.

    Returns
    -------
    Measurements
        Duplicates; their truth is that of the originals.

    References
    ----------
    The project's own: values rounded to the nearest step.
    """
    chosen = rng.uniform(size=len(rows)) < feed.share
    picked = {field.name: getattr(rows, field.name)[chosen] for field in fields(rows)}
    copies = Measurements(**picked)
    return replace(
        copies,
        time_s=_rounded(copies.time_s, feed.time_step_s),
        range_m=_rounded(copies.range_m, feed.range_step_m),
        azimuth_rad=wrapped(_rounded(copies.azimuth_rad, feed.azimuth_step_rad)),
    )


def _rounded(values: Floats, step: float) -> Floats:
    return step * np.round(values / step) if step > 0.0 else values
