"""Plots that come a second time, through another network that rounds them in its own way."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.observation.looks import wrapped
from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.scenario.scene import SecondFeed

Floats = NDArray[np.float64]


def copied(rows: Measurements, feed: SecondFeed, rng: np.random.Generator) -> Measurements:
    """Return what comes of measurements a second time.

    Parameters
    ----------
    rows : Measurements
        The measurements of one radar.
    feed : SecondFeed
        Which part of them comes, and how it is rounded.
    rng : Generator
        Draws which they are.

    Returns
    -------
    Measurements
        Copies; their truth is that of what they are copies of.

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
