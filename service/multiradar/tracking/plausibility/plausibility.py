"""Whether what aircraft report of their own position is borne out by what others measure of them.

Reports (ADS-B) are compared with the plots of the same aircraft by interpolation between two
reports, sensor by sensor; the mean difference of each sensor is judged against its noise, the
uncertainty of the published biases and what latencies and heights may do. The majority of
independent places decides (`_plausibility_kernels`). All of it is a function of the rows so far,
never of how they were cut into batches.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.plausibility._plausibility_kernels import claim, judge
from multiradar.tracking.plausibility.trust import DISTRUSTED, SECTORS, TRUSTED, Watch
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import RowIdentities

Integers = NDArray[np.int64]

#: Turn taken for sensors whose turn is not known, s.
USUAL_TURN_S = 5.0
#: Time, s, over which an offset that crept in is taken to have changed the velocity.
CREEP_S = 20.0


class Told(NamedTuple):
    """Rows to judge.

    Attributes
    ----------
    rows : Rows
        The measurements; those set aside lose their aircraft (`IMPLAUSIBLE_SLOT`).
    identities : RowIdentities
        Whose they are.
    addresses : (n,) int64
        The Mode S addresses that they carry.
    flagged : (n,) int64
        Gets whether the reports of the aircraft are implausible, for rows of aircraft.
    first, last : int
        Which of them.
    """

    rows: Rows
    identities: RowIdentities
    addresses: Integers
    flagged: Integers
    first: int
    last: int


class Plausibility:
    """Judges the reports of aircraft; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; without one that relays reports of aircraft nothing is done.
    """

    def __init__(self, sensors: SensorTable) -> None:
        count = len(sensors)
        period = np.nan_to_num(sensors.rotation_period_s, nan=USUAL_TURN_S)
        own = sensors.self_reported
        longest = float(np.max(period[~own], initial=USUAL_TURN_S))
        self.active = bool(own.any())
        self._heard = False
        self._watch = Watch(
            own=own.astype(np.int64),
            kind=sensors.kinds.astype(np.int64),
            period=period,
            range_max=sensors.range_max_m.astype(np.float64),
            alive=np.full(count, -np.inf),
            farthest=np.zeros(count),
            lowest=np.full((count, SECTORS), np.inf),
            support_s=3.0 * longest,
            suspect_s=4.0 * longest,
        )

    def claim(self, told: Told, pool: AircraftPool) -> None:
        """Keep reports that an aircraft contradicts from beginning tracks under its address.

        Parameters
        ----------
        told : Told
            The rows; those marked to begin a track though others measure the aircraft of their
            address get that aircraft.
        pool : AircraftPool
            The aircraft.
        """
        if self.active:
            claim(
                told.first, told.last, told.rows, told.addresses, self._watch, pool.roster,
                pool.life, told.identities,
            )  # fmt: skip

    def steps(
        self, told: Told, model: Model, biases: BiasState, pool: AircraftPool
    ) -> Iterator[tuple[int, int]]:
        """Judge rows, and cut them where trust in an aircraft changes.

        Parameters
        ----------
        told : Told
            The rows.
        model : Model
            What all aircraft share.
        biases : BiasState
            As published.
        pool : AircraftPool
            The aircraft; trust in them is changed, and states into which an offset crept.

        Yields
        ------
        (int, int)
            First and last row to be taken by the filter before the next are judged.
        """
        if not self.active:
            yield told.first, told.last
            return
        begun, last, trust = told.first, told.last, pool.trust
        first = self._first_report(told)
        while first < last:
            row, slot, state, offset_m = judge(
                first, last, told.rows, told.identities.track_id, self._watch, model,
                biases.estimate, biases.covariance, trust, told.flagged,
            )  # fmt: skip
            if begun < row:
                yield begun, row
            if slot >= 0:
                if trust.state[slot] == TRUSTED and state == DISTRUSTED:
                    loosen(pool.aircraft, slot, offset_m, len(biases.estimate))
                trust.state[slot], trust.since[slot] = state, told.rows.time[row]
            begun, first = row, row + 1
        if begun < last:
            yield begun, last

    def _first_report(self, told: Told) -> int:
        # Until a report comes there is nothing to compare: rows cost nothing.
        if self._heard:
            return told.first
        own = np.flatnonzero(self._watch.own[told.rows.sensor[told.first : told.last]])
        self._heard = len(own) > 0
        return told.first + int(own[0]) if self._heard else told.last


def loosen(aircraft: Aircraft, slot: int, offset_m: float, bias_columns: int) -> None:
    """Let the state of an aircraft that followed wrong reports be as uncertain as they were wrong.

    Parameters
    ----------
    aircraft : Aircraft
        The states; that of one aircraft is changed.
    slot : int
        Which.
    offset_m : float
        How far the reports are from what others measure.
    bias_columns : int
        Number of bias parameters.
    """
    if not np.isfinite(aircraft.time[slot]):
        return
    place, rate = offset_m**2, (offset_m / CREEP_S) ** 2
    modes = aircraft.mode_probability.shape[1]
    mine = slice(slot * modes, (slot + 1) * modes)
    for upper in (aircraft.covariance[slot : slot + 1], aircraft.mode_covariance[mine]):
        upper[:, [0, 4]] += place
        upper[:, [7, 9]] += rate
    if len(aircraft.joint) > bias_columns:
        at = bias_columns + 4 * slot + np.arange(4)
        aircraft.joint[at, at] += [place, place, rate, rate]
