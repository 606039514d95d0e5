"""Track initiation by bearings of aircraft known by identity but without a position.

The last bearings of such an aircraft are buffered. A track is initiated when bearings from two
sites intersect significantly and one more bearing arrives, which then updates the track. One
direction finder is enough if it moves, or measures elevations of a known height. Repeated attempts
would find an intersection of errors alone: the required significance increases with every failed
attempt. The result depends on the order of the rows alone, not on batches.
"""

from collections import OrderedDict
from dataclasses import replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import BearingsError
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bearings_only import DISTANCE_SHARE_MAX
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields
from multiradar.tracking._identity_kernels import identify
from multiradar.tracking.association.window_association import AssociationWindow
from multiradar.tracking.bearings.bearing_positions import Bounds, locate
from multiradar.tracking.bearings.waiting_bearings import WaitingBearing, bearing_of_row
from multiradar.tracking.pool import AircraftPool, Start
from multiradar.tracking.roster import Roster, RowIdentities
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: Minimum and maximum number of bearings for initiation, and their maximum age, s.
BEARINGS_MIN = 4
BEARINGS_MAX = 16
AGE_MAX_S = 30.0
#: Maximum number of aircraft with buffered bearings; the least recent is dropped.
WAITING_MAX = 10_000


# A moving source needs time to observe the distance: its bearings are kept longer. Beyond this
# number every other one is dropped.
_MOVING_AGE_MAX_S = 300.0
_MOVING_MAX = 128
# Growth of the time span after a failed attempt before the next one.
_RETRY_FACTOR = 1.12
# Increase of the number of attempts by one: attempts that differ by a quarter of the time span are
# nearly independent.
_ATTEMPTS_OF_MOVING = 0.5


class _Waiting(NamedTuple):
    seen: list[WaitingBearing]
    # Time of the next attempt for a moving source, s.
    retry_s: float = -np.inf
    # Number of failed attempts, counted as independent ones.
    attempts: float = 0.0


class BearingStarts:
    """Initiates tracks by bearings; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        Prior speeds.
    active : bool
        Whether tracks are initiated by bearings at all.
    """

    STATE: ClassVar[Fields] = {
        "_waiting": OrderedDict[tuple[int, int], _Waiting],
    }

    def __init__(self, sensors: SensorTable, settings: TrackingSettings, *, active: bool) -> None:
        self._sensors = sensors
        self._speeds_mps = settings.speed_sigma_mps, settings.speed_max_mps
        self._active = active
        self._waiting: OrderedDict[tuple[int, int], _Waiting] = OrderedDict()

    def assign(
        self, window: AssociationWindow, model: Model, biases: BiasState, pool: AircraftPool
    ) -> None:
        """Find or create the aircraft of rows, also of bearings that initiate a track.

        Parameters
        ----------
        window : AssociationWindow
            The rows, by ascending time; their slots are filled.
        model : Model
            The sensors on the plane.
        biases : BiasState
            Published biases.
        pool : AircraftPool
            The aircraft; new tracks are added with their state before the rows.
        """
        batch, codes, _, identities, first, last = window
        starts = self._find(window, model, biases, pool.roster) if self._active else {}
        if starts:
            # They create an aircraft, as plots do.
            kind = batch.kind.copy()
            kind[list(starts)] = KIND_RADAR
            batch = replace(batch, kind=kind)
        pool.assign(batch, codes, first, last, identities)
        for row, start in starts.items():
            slot = int(identities.slot[row])
            if slot >= 0:
                pool.initiate(slot, start)

    def _find(
        self, window: AssociationWindow, model: Model, biases: BiasState, roster: Roster
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
                # Any other measurement initiates its track.
                self._waiting.pop(key, None)
                continue
            start = self._push(key, bearing_of_row(window, row, model), model, biases)
            if start is not None:
                found[row] = start
        return found

    def _push(
        self, key: tuple[int, int], seen: WaitingBearing, model: Model, biases: BiasState
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
        if len(before) < BEARINGS_MIN or (moving and time_s < waiting.retry_s):
            return None
        bounds = Bounds(*self._speeds_mps, share_max(waiting.attempts))
        try:
            start = locate(before, self._sensors, bounds, model, biases)
        except (BearingsError, np.linalg.LinAlgError):
            # The bearings do not intersect, or the fit diverges.
            start = None
        if start is not None:
            self._waiting.pop(key, None)
            return start
        # Without motion all but one of the bearings are used again in the next attempt.
        attempts, retry_s = waiting.attempts + 1.0 / BEARINGS_MAX, waiting.retry_s
        if moving:
            attempts = waiting.attempts + _ATTEMPTS_OF_MOVING
            retry_s = before[0].time_s + _RETRY_FACTOR * (time_s - before[0].time_s)
        self._waiting[key] = waiting._replace(retry_s=retry_s, attempts=attempts)
        return None


def share_max(attempts: float) -> float:
    """Return the accuracy of distance required after a number of failed attempts.

    Parameters
    ----------
    attempts : float
        Number of failed attempts, not negative.

    Returns
    -------
    float
        Largest ratio of the standard deviation of a distance to the distance.

    Notes
    -----
    A ratio s means that bearings intersect by z = 1 / s standard deviations, which errors alone
    reach with a probability of about exp(-z² / 2). With z² = z₀² + 2 ln k the probability at
    attempt k is that of the first one over k: all attempts of an hour have less than five times the
    probability of the first.
    """
    return float((DISTANCE_SHARE_MAX**-2 + 2.0 * np.log1p(attempts)) ** -0.5)


# The last ones; of moving sources the whole time span, thinned out.
def _kept(seen: list[WaitingBearing], *, moving: bool) -> list[WaitingBearing]:
    if not moving:
        return seen[-BEARINGS_MAX:]
    return seen if len(seen) <= _MOVING_MAX else seen[::2]
