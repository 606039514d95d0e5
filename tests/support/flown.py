"""Flights of piecewise constant accelerations with noisy plots, for the restoration."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.tracks import ControlTrack, MeasurementTrack, measurement_track

Floats = NDArray[np.float64]

#: A straight leg, a turn to the left, one to the right, a straight leg: begin (s), u (m/s²).
S_SHAPE = ((0.0, 0.0), (60.0, -2.0), (100.0, 2.0), (140.0, 0.0))


def flight(
    segments: Sequence[tuple[float, float]], speed_mps: float = 180.0, along_mps2: float = 0.0
) -> ControlTrack:
    """A flight to the east."""
    begins, lateral = (np.array(part) for part in zip(*segments, strict=True))
    start = np.array([0.0, 0.0, speed_mps, np.pi / 2.0])
    return ControlTrack(start, begins, lateral, np.full(len(begins), along_mps2))


def plots_of(
    flown: ControlTrack,
    until_s: float,
    rng: np.random.Generator,
    *,
    interval_s: float = 1.5,
    sigma_m: float = 50.0,
    wrong: float = 0.0,
) -> MeasurementTrack:
    """Plots with noise, a share of them moved by 0.3 to 3 km."""
    times = np.arange(0.0, until_s, interval_s)
    places = flown.geometric(times).position_m + sigma_m * rng.normal(size=(len(times), 2))
    moved = rng.uniform(size=len(times)) < wrong
    far, way = rng.uniform(300.0, 3000.0, len(times)), rng.uniform(0.0, 2.0 * np.pi, len(times))
    places[moved] += (far * np.array([np.sin(way), np.cos(way)])).T[moved]
    noise = np.broadcast_to(sigma_m**2 * np.eye(2), (len(times), 2, 2))
    return measurement_track(times, places, noise, np.zeros(len(times)))
