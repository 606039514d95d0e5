"""Compiled ground status of aircraft: reported by them, and checked by speed and height.

A target on the ground has a model of its own: the range is used with the height of the surface
instead of the pressure altitude, and the motion is that of taxiing and standing aircraft. Reported
statuses are wrong at times: an aircraft faster than any take-off, or far above the surface, is
airborne; one that was on the ground, is slower than any flight and has not climbed still is.

References
----------
The project's own. Mode S transponders check their ground status by speed and radio height likewise
(ICAO Annex 10, volume IV).
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import HEIGHT_MAX, UPDATED, Triple
from multiradar.estimation.filters.height._height_kernels import (
    DOUBTED,
    KIND_SURFACE,
    P01,
    P11,
    RATE,
    RATE_SIGMA_MPS,
    SOURCE,
    SURFACE,
)
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar_compiled.kernels import in_loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Ground status of a row or an aircraft.
UNKNOWN = -1
AIRBORNE = 0
ON_GROUND = 1

# Above this ground speed no aircraft is on the ground, below the other none of fixed wing flies,
# m/s. Airliners lift off and land at 60 to 90 m/s.
GROUND_SPEED_MAX_MPS = 100.0
FLIGHT_SPEED_MIN_MPS = 25.0
# Standard deviations of the speed that count as doubt.
SPEED_SIGMAS = 2.0
# A pressure altitude this far from the height of the site is not of its surroundings, m: pressure
# differs by less than 400 m, the rest is terrain.
SURFACE_AWAY_MAX_M = 1000.0
# A change of the pressure altitude by this is a flight, m: the limit of an outlier in level flight.
LIFTED_M = 60.0
# Density of the acceleration on the ground, m²/s³: 0.5 m/s² for 2 s. Stops, sharp turns and
# take-off runs raise it, as manoeuvres do in flight.
GROUND_DENSITY = 1.0
# Below this speed an aircraft stands, m/s; they taxi at 5 to 15 m/s.
STANDING_SPEED_MAX_MPS = 2.0


@in_loop
def settle_ground(
    reported: int, measured: float, site_height: float, action: int, k: int, on_ground: Integers,
    means: Floats, covariances: Floats, heights: Floats, vertical: Floats,
) -> bool:  # fmt: skip
    """Return whether aircraft k is on the ground at a measurement; changes nothing.

    ``measured`` is the height as received, ``action`` that of the row: only an initiated aircraft
    has a speed.
    """
    before = on_ground[k] == ON_GROUND
    if reported != ON_GROUND and not before:
        return False
    speed, doubt = 0.0, 0.0
    if action == UPDATED:
        speed = np.sqrt(means[k, 2] * means[k, 2] + means[k, 3] * means[k, 3])
        doubt = SPEED_SIGMAS * np.sqrt(max(covariances[k, 7] + covariances[k, 9], 0.0))
    grounded = speed - doubt <= GROUND_SPEED_MAX_MPS
    if reported == ON_GROUND:
        grounded = grounded and reported_on_ground(reported, measured, site_height)
    else:
        last = vertical[k, DOUBTED] if vertical[k, SOURCE] == SURFACE else heights[k]
        grounded = grounded and not abs(measured - last) > LIFTED_M
    if reported == AIRBORNE:
        grounded = grounded and action == UPDATED and speed < FLIGHT_SPEED_MIN_MPS
    return grounded


@in_loop
def reported_on_ground(reported: int, measured: float, site_height: float) -> bool:
    """Return whether a row reports the status on the ground, at a possible height."""
    # False for NaN.
    high = abs(measured - site_height) > SURFACE_AWAY_MAX_M
    return reported == ON_GROUND and not high


@in_loop
def height_of_row(
    grounded: bool, kind: int, measured: float, site_height: float
) -> tuple[int, float]:
    """Return the kind of height for `check_height`, and the height.

    On the ground a slant range is used with the height of the radar's site, the known height that
    is nearest. A reported position does not depend on the height.
    """
    source, height = kind, measured
    if grounded and kind == KIND_RADAR and abs(site_height) < HEIGHT_MAX:
        source, height = KIND_SURFACE, site_height
    return source, height


@in_loop
def ground_density(factor: float) -> Triple:
    """Return the density of the acceleration on the ground; ``factor`` is `manoeuvre_factor`."""
    density = factor * GROUND_DENSITY
    return density, 0.0, density


@in_loop
def stands(grounded: bool, v0: float, v1: float, variance: float) -> bool:
    """Return whether an aircraft on the ground stands: then its plots do not inform about biases.

    What a radar or multilateration measures of a target on the ground depends on its extent and on
    reflections. While it stands these errors are the same at every plot; a thousand plots of a
    parked aircraft would count as one of a thousand aircraft. ``variance`` is the sum of those of
    both rates: an aircraft moves if its speed is not only noise.
    """
    doubt = SPEED_SIGMAS * SPEED_SIGMAS * variance
    least = STANDING_SPEED_MAX_MPS * STANDING_SPEED_MAX_MPS
    return grounded and not v0 * v0 + v1 * v1 > max(least, doubt)


@in_loop
def record_ground(
    grounded: bool, reported: int, measured: float, k: int, on_ground: Integers, vertical: Floats
) -> None:
    """Store the ground status of aircraft k after an accepted measurement.

    On the ground there is no rate of climb, and the last pressure altitude is kept beside the
    height of the surface.
    """
    before = on_ground[k] == ON_GROUND
    if grounded:
        on_ground[k] = ON_GROUND
        vertical[k, RATE] = 0.0
        vertical[k, P01] = 0.0
        vertical[k, P11] = 0.0
        if vertical[k, SOURCE] == SURFACE and (abs(measured) < HEIGHT_MAX or not before):
            vertical[k, DOUBTED] = measured
    elif before:
        on_ground[k] = AIRBORNE
        vertical[k, P11] = RATE_SIGMA_MPS * RATE_SIGMA_MPS
    elif reported != UNKNOWN:
        on_ground[k] = AIRBORNE
