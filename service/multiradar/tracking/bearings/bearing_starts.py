"""Tracks that begin by bearings: of an aircraft that is known by identity and was never located.

The last bearings of such an aircraft wait. When they come from two places and cross beyond their
errors, and one more comes, the track begins at them; that one then corrects it as any other. A
source that moves is at two places by itself, and an elevation with a height is a distance: one
direction finder may do then. Who looks often enough finds a crossing among errors alone: the more
often it was looked in vain, the better the lines have to cross. All of it follows the rows in their
order, so that no cut between them matters.
"""

from collections import OrderedDict
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import BearingsError
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bearings_only import DISTANCE_SHARE_MAX
from multiradar.estimation.measurement._kernels import KIND_BEARING
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking._kernels import identify
from multiradar.tracking.association.association import Window
from multiradar.tracking.bearings.bearing_fits import Bounds, locate
from multiradar.tracking.bearings.bearings_seen import Seen, seen_in
from multiradar.tracking.input.measurements import KIND_RADAR
from multiradar.tracking.pool import AircraftPool, Start
from multiradar.tracking.roster import Roster, RowIdentities
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: Bearings that a track begins at, at least and at most, and how old they may be, s.
BEARINGS_MIN = 4
BEARINGS_MAX = 16
AGE_MAX_S = 30.0
#: Aircraft whose bearings wait; the one that was not heard for longest goes.
WAITING_MAX = 10_000


# A source that moves needs time to tell a distance: its bearings wait longer, and of more of them
# than this every other one goes.
_MOVING_AGE_MAX_S = 300.0
_MOVING_MAX = 128
# A search that found nothing is not worth another one before so much more time has passed.
_MORE_TIME = 1.12
# A look has little in common with one a quarter of the time before.
_LOOKS_OF_MOVING = 0.5


class _Waiting(NamedTuple):
    seen: list[Seen]
    # When a moving source is asked again, s.
    again_s: float = -np.inf
    # How often it was looked in vain, in looks that have little in common.
    looks: float = 0.0


class BearingStarts:
    """Finds bearings at which tracks begin; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        What is known of speeds beforehand.
    active : bool
        Whether tracks begin by bearings at all.
    """

    def __init__(self, sensors: SensorTable, settings: TrackingSettings, *, active: bool) -> None:
        self._sensors = sensors
        self._speeds_mps = settings.speed_sigma_mps, settings.speed_max_mps
        self._active = active
        self._waiting: OrderedDict[tuple[int, int], _Waiting] = OrderedDict()

    def assign(self, window: Window, model: Model, biases: BiasState, pool: AircraftPool) -> None:
        """Find or make the aircraft of rows, also of bearings at which a track can begin.

        Parameters
        ----------
        window : Window
            The rows, in the order of their time; their slots are filled.
        model : Model
            The sensors on the plane.
        biases : BiasState
            As published.
        pool : AircraftPool
            The aircraft; it gets the tracks that begin, as they are before the rows.
        """
        batch, codes, _, identities, first, last = window
        starts = self._find(window, model, biases, pool.roster) if self._active else {}
        if starts:
            # They make an aircraft, as plots do.
            kind = batch.kind.copy()
            kind[list(starts)] = KIND_RADAR
            batch = replace(batch, kind=kind)
        pool.assign(batch, codes, first, last, identities)
        for row, start in starts.items():
            slot = int(identities.slot[row])
            if slot >= 0:
                pool.begin(slot, start)

    def _find(
        self, window: Window, model: Model, biases: BiasState, roster: Roster
    ) -> dict[int, Start]:
        batch, first, last = window.batch, window.first, window.last
        named = (batch.track_number[first:last] >= 0) | (batch.mode_s_address[first:last] >= 0)
        of_kind = batch.kind[first:last] == KIND_BEARING
        if not (named & of_kind).any():
            return {}
        known = RowIdentities.empty(last)
        identify(first, last, batch.track_number, batch.mode_s_address, roster, known)
        found: dict[int, Start] = {}
        for row in (first + np.flatnonzero(named & (known.slot[first:] < 0))).tolist():
            key = int(batch.track_number[row]), int(batch.mode_s_address[row])
            if batch.kind[row] != KIND_BEARING:
                # Whatever else is measured of it begins its track.
                self._waiting.pop(key, None)
                continue
            start = self._take(key, seen_in(window, row, model), model, biases)
            if start is not None:
                found[row] = start
        return found

    def _take(
        self, key: tuple[int, int], seen: Seen, model: Model, biases: BiasState
    ) -> Start | None:
        time_s = seen.time_s
        waiting = self._waiting.pop(key, _Waiting([]))
        moving = seen.moving or any(one.moving for one in waiting.seen)
        age_max_s = _MOVING_AGE_MAX_S if moving else AGE_MAX_S
        before = [one for one in waiting.seen if time_s - one.time_s <= age_max_s]
        if not before:
            waiting = _Waiting([])
        waiting = waiting._replace(seen=_kept([*before, seen], moving=moving))
        self._waiting[key] = waiting
        if len(self._waiting) > WAITING_MAX:
            self._waiting.popitem(last=False)
        if len(before) < BEARINGS_MIN or (moving and time_s < waiting.again_s):
            return None
        bounds = Bounds(*self._speeds_mps, share_max(waiting.looks))
        try:
            start = locate(before, self._sensors, bounds, model, biases)
        except (BearingsError, np.linalg.LinAlgError):
            # They do not cross, or the search runs away from where they nearly do.
            start = None
        if start is not None:
            self._waiting.pop(key, None)
            return start
        # All but one of the bearings of the next look are those of this one, where nothing moves.
        looks, again_s = waiting.looks + 1.0 / BEARINGS_MAX, waiting.again_s
        if moving:
            looks = waiting.looks + _LOOKS_OF_MOVING
            again_s = before[0].time_s + _MORE_TIME * (time_s - before[0].time_s)
        self._waiting[key] = waiting._replace(again_s=again_s, looks=looks)
        return None


def share_max(looks: float) -> float:
    """Return how well a distance has to be told after so many looks in vain.

    Parameters
    ----------
    looks : float
        How many looks there were, not negative.

    Returns
    -------
    float
        Largest sigma of a distance over the distance.

    Notes
    -----
    A share s says that lines cross by z = 1 / s sigmas, which errors alone reach with a chance of
    about exp(-z² / 2). With z² = z₀² + 2 ln k the chance of look k is that of the first one over
    k, so that all looks of an hour together have less than five times the chance of the first.
    """
    return float((DISTANCE_SHARE_MAX**-2 + 2.0 * np.log1p(looks)) ** -0.5)


# The last of them; of moving sources all of the time, with fewer in it.
def _kept(seen: list[Seen], *, moving: bool) -> list[Seen]:
    if not moving:
        return seen[-BEARINGS_MAX:]
    return seen if len(seen) <= _MOVING_MAX else seen[::2]
