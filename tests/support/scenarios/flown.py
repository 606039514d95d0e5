"""Flights of piecewise constant accelerations with noisy plots, for the restoration."""

from collections.abc import Sequence
from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks.tracks import (
    ControlTrack,
    MeasurementTrack,
    measurement_track,
)

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


def state_by_series(start: Floats, u: float, w: float, t: float) -> Floats:
    """The state of (2.1) after a time, forwards, by Taylor series in forty digits.

    It uses the right-hand sides as published: x' = v cos φ, z' = v sin φ, φ' = u / v, v' = w.
    """
    with localcontext() as context:
        context.prec = 40
        east, north, v = (Decimal(float(part)) for part in start[:3])
        # Sine and cosine of the heading at the beginning are given to the digits of a float.
        cosine, sine = Decimal(float(np.cos(start[3]))), Decimal(float(np.sin(start[3])))
        side, along, turned = Decimal(u), Decimal(w), Decimal(float(start[3]))
        left = Decimal(t)
        while left > 0:
            # Far within the circle of convergence: a term is a quarter of the one before it.
            step = min(left, v / (4 * max(abs(along), abs(side), Decimal("1e-3"))))
            north, east, cosine, sine, more = _series(
                (north, east, cosine, sine), v, side, along, step
            )
            turned, v, left = turned + more, v + along * step, left - step
        return np.array([float(part) for part in (east, north, v, turned)])


# North, east, cosine and sine of the heading after a step, and by how much it turned.
def _series(
    at: tuple[Decimal, Decimal, Decimal, Decimal], v: Decimal, u: Decimal, w: Decimal, h: Decimal
) -> tuple[Decimal, ...]:
    cosines, sines = [at[2]], [at[3]]
    # φ' = u / (v + w τ) as a power series in τ.
    rates = [u / v]
    norths, easts, turns = [at[0]], [at[1]], [Decimal(0)]
    for k in range(30):
        before = k - 1
        c = v * cosines[k] + (w * cosines[before] if k else 0)
        s = v * sines[k] + (w * sines[before] if k else 0)
        norths.append(c / (k + 1))
        easts.append(s / (k + 1))
        turns.append(rates[k] / (k + 1))
        bend = [
            sum((many[j] * rates[k - j] for j in range(k + 1)), Decimal(0))
            for many in (sines, cosines)
        ]
        cosines.append(-bend[0] / (k + 1))
        sines.append(bend[1] / (k + 1))
        rates.append(-rates[k] * w / v)
    found = []
    for terms in (norths, easts, cosines, sines, turns):
        total = Decimal(0)
        for term in reversed(terms):
            total = total * h + term
        found.append(total)
    return tuple(found)
