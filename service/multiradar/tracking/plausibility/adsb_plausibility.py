"""Plausibility of ADS-B reports, by comparison with other sensors.

ADS-B reports are compared with the plots of the same aircraft by interpolation between two reports,
sensor by sensor. The mean difference of each sensor is tested against its noise, the uncertainty of
the published biases, latencies and height errors. The majority of independent sites decides
(`_plausibility_kernels`). The result is a function of the rows so far, independent of batches.
"""

from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Aircraft, Model, Rows
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields, fitted
from multiradar.tracking.lifecycle.report_integrity import IMPLAUSIBLE, PLAUSIBLE, SECTORS, Watch
from multiradar.tracking.plausibility._plausibility_kernels import check_rows, reassign_reports
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import RowIdentities
from multiradar.tracking.settings import DEFAULT_PERIOD_S

Integers = NDArray[np.int64]

#: Time, s, over which an undetected offset is assumed to have changed the velocity.
CREEP_S = 20.0


class PlausibilityWindow(NamedTuple):
    """Rows to check.

    Attributes
    ----------
    rows : Rows
        The measurements; rejected ones lose their aircraft (`IMPLAUSIBLE_SLOT`).
    identities : RowIdentities
        Aircraft of the rows.
    addresses : (n,) int64
        Their Mode S addresses.
    flagged : (n,) int64
        Receives whether the reports of the aircraft are implausible, for rows of aircraft.
    first, last : int
        Rows to check.
    """

    rows: Rows
    identities: RowIdentities
    addresses: Integers
    flagged: Integers
    first: int
    last: int


class Plausibility:
    """Checks the reports of aircraft; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; without one that relays ADS-B reports nothing is done.
    """

    STATE: ClassVar[Fields] = {
        "_heard": bool,
        "_watch": Watch,
    }

    def __init__(self, sensors: SensorTable) -> None:
        count = len(sensors)
        period = np.nan_to_num(sensors.rotation_period_s, nan=DEFAULT_PERIOD_S)
        self_reported = sensors.self_reported
        longest = float(np.max(period[~self_reported], initial=DEFAULT_PERIOD_S))
        self.active = bool(self_reported.any())
        self._heard = False
        self._watch = Watch(
            self_reported=self_reported.astype(np.int64),
            kind=sensors.kinds.astype(np.int64),
            period=period,
            range_max=sensors.range_max_m.astype(np.float64),
            alive=np.full(count, -np.inf),
            farthest=np.zeros(count),
            lowest=np.full((count, SECTORS), np.inf),
            support_s=3.0 * longest,
            suspect_s=4.0 * longest,
        )

    def carry(self, old: "Plausibility", _change: object) -> None:
        """Continue with other sensors."""
        self._heard = old._heard
        for name in ("alive", "farthest", "lowest"):
            fitted(getattr(old._watch, name), getattr(self._watch, name))

    def reassign_reports(self, window: PlausibilityWindow, pool: AircraftPool) -> None:
        """Keep contradicted reports from initiating tracks under their address.

        Parameters
        ----------
        window : PlausibilityWindow
            The rows; those marked to initiate a track although other sensors see the aircraft with
            their address are assigned to it.
        pool : AircraftPool
            The aircraft.
        """
        if self.active:
            reassign_reports(
                window.first, window.last, window.rows, window.addresses, self._watch, pool.roster,
                pool.life, window.identities,
            )  # fmt: skip

    def steps(
        self, window: PlausibilityWindow, model: Model, biases: BiasState, pool: AircraftPool
    ) -> Iterator[tuple[int, int]]:
        """Check rows, and divide them where the integrity state of an aircraft changes.

        Parameters
        ----------
        window : PlausibilityWindow
            The rows.
        model : Model
            Model common to all aircraft.
        biases : BiasState
            Published biases.
        pool : AircraftPool
            The aircraft; integrity states are updated, and covariances after undetected offsets.

        Yields
        ------
        (int, int)
            First and last row to be processed by the filter before the next are checked.
        """
        if not self.active:
            yield window.first, window.last
            return
        start, last, integrity = window.first, window.last, pool.integrity
        first = self._first_report(window)
        while first < last:
            row, slot, state, offset_m = check_rows(
                first, last, window.rows, window.identities.track_id, self._watch, model,
                biases.estimate, biases.covariance, integrity, window.flagged,
            )  # fmt: skip
            if start < row:
                yield start, row
            if slot >= 0:
                if integrity.state[slot] == PLAUSIBLE and state == IMPLAUSIBLE:
                    inflate_covariance(pool.aircraft, slot, offset_m, len(biases.estimate))
                integrity.state[slot], integrity.since[slot] = state, window.rows.time[row]
            start, first = row, row + 1
        if start < last:
            yield start, last

    def _first_report(self, window: PlausibilityWindow) -> int:
        # Before the first report there is nothing to compare: rows cost nothing.
        if self._heard:
            return window.first
        self_reported = np.flatnonzero(
            self._watch.self_reported[window.rows.sensor[window.first : window.last]]
        )
        self._heard = len(self_reported) > 0
        return window.first + int(self_reported[0]) if self._heard else window.last


def inflate_covariance(aircraft: Aircraft, slot: int, offset_m: float, bias_columns: int) -> None:
    """Inflate the covariance of an aircraft that followed wrong reports.

    Parameters
    ----------
    aircraft : Aircraft
        The states; that of one aircraft is changed.
    slot : int
        Its slot.
    offset_m : float
        Distance of the reports from the measurements of other sensors.
    bias_columns : int
        Number of bias parameters.
    """
    if not np.isfinite(aircraft.time[slot]):
        return
    position, rate = offset_m**2, (offset_m / CREEP_S) ** 2
    modes = aircraft.mode_probability.shape[1]
    mine = slice(slot * modes, (slot + 1) * modes)
    for upper in (aircraft.covariance[slot : slot + 1], aircraft.mode_covariance[mine]):
        upper[:, [0, 4]] += position
        upper[:, [7, 9]] += rate
    if len(aircraft.joint) > bias_columns:
        at = bias_columns + 4 * slot + np.arange(4)
        aircraft.joint[at, at] += [position, position, rate, rate]
