"""The usual scheme that the paper compares with: angles are made places first, and these tracked.

References
----------
Nenartovich, Isakov, the section on the simulation, which does not tell how. Least squares over the
lines of sight of a turn and a Kalman filter over the places are the project's own reading of it.
"""

import numpy as np

from multiradar.estimation.filters.bearings_only import BearingsState, initiate, predict
from multiradar.estimation.measurement.sights import Sight
from multiradar.research.studies.bearing_only.runs import (
    AZIMUTH_SIGMA_RAD,
    DENSITY,
    ELEVATION_SIGMA_RAD,
    SPEED_SIGMA_MPS,
    Filtered,
    Looks,
    collected,
)


def triangulated(looks: Looks, *, led_on: bool) -> Filtered:
    """Make a place of the angles of each turn first, and track with the places.

    Parameters
    ----------
    looks : Looks
        Sights without ranges.
    led_on : bool
        Whether the angles of a turn are led on to the moment of its last one, by the rate between
        the last two of each source; else they are taken as if of one moment.

    Returns
    -------
    Filtered
        At the last sight of each turn, from the second turn on; a turn with one angle makes no
        place.

    References
    ----------
    Nenartovich, Isakov, the section on the simulation: the usual scheme.
    """
    found: list[tuple[int, BearingsState]] = []
    state: BearingsState | None = None
    for number in range(1, int(looks.turn[-1]) + 1):
        of_turn = np.flatnonzero(looks.turn == number).tolist()
        if not of_turn:
            continue
        time_s = float(looks.times_s[of_turn[-1]])
        spot = _place(looks, of_turn, time_s, led_on=led_on) if len(of_turn) > 1 else None
        state = spot if state is None else _with_place(predict(state, time_s, DENSITY), spot)
        if state is not None:
            found.append((of_turn[-1], state))
    return collected(looks, found)


# Of one moment: the velocity has no part in the place.
def _place(looks: Looks, of_turn: list[int], time_s: float, *, led_on: bool) -> BearingsState:
    sights = [_led_on(looks, place, time_s) if led_on else looks.sights[place] for place in of_turn]
    return initiate(sights, np.full(len(sights), time_s), SPEED_SIGMA_MPS)


def _with_place(state: BearingsState, spot: BearingsState | None) -> BearingsState:
    if spot is None:
        return state
    d = state.vector.shape[-1] // 2
    information, vector = state.information.copy(), state.vector.copy()
    information[..., :d, :d] += spot.information[..., :d, :d]
    vector[..., :d] += spot.vector[..., :d]
    return BearingsState(state.time_s, information, vector, state.crossing)


# A sight at a later moment, by the rate since the one before of the same source.
def _led_on(looks: Looks, place: int, time_s: float) -> Sight:
    earlier = np.flatnonzero(looks.source[:place] == looks.source[place])
    now, before = looks.sights[place], looks.sights[earlier[-1]]
    apart_s = float(looks.times_s[place] - looks.times_s[earlier[-1]])
    ahead = (time_s - float(looks.times_s[place])) / apart_s
    noise = float(np.hypot(1.0 + ahead, ahead))
    elevation = elevation_sigma = None
    if now.elevation_rad is not None and before.elevation_rad is not None:
        elevation = now.elevation_rad + ahead * (now.elevation_rad - before.elevation_rad)
        elevation_sigma = noise * ELEVATION_SIGMA_RAD
    return Sight(
        now.source_m, now.azimuth_rad + ahead * (now.azimuth_rad - before.azimuth_rad),
        noise * AZIMUTH_SIGMA_RAD, elevation, elevation_sigma,
    )  # fmt: skip
