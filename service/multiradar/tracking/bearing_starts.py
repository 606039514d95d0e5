"""Tracks that begin by bearings: of an aircraft that is known by identity and was never located.

The last bearings of such an aircraft wait. When they come from two places and cross beyond their
errors, and one more comes, the track begins at them; that one then corrects it as any other. All of
it follows the rows in their order, so that no cut between them matters.
"""

from collections import OrderedDict
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import BearingsError
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters._kernels import ASSUMED_HEIGHT, ASSUMED_HEIGHT_SIGMA
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bearings_only import DISTANCE_SHARE_MAX, begin
from multiradar.estimation.gaussian import symmetric_part
from multiradar.estimation.measurement._kernels import KIND_BEARING
from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET, SensorTable
from multiradar.estimation.measurement.sights import Sight
from multiradar.geodesy import _kernels as geodesy
from multiradar.tracking._kernels import identify
from multiradar.tracking.association import Window
from multiradar.tracking.measurements import KIND_RADAR, MeasurementBatch
from multiradar.tracking.pool import AircraftPool, Start
from multiradar.tracking.roster import Roster, RowIdentities

Floats = NDArray[np.float64]

#: Bearings that a track begins at, at least and at most, and how old they may be, s.
BEARINGS_MIN = 4
BEARINGS_MAX = 16
AGE_MAX_S = 30.0
#: Aircraft whose bearings wait; the one that was not heard for longest goes.
WAITING_MAX = 10_000

# Rounds on the ellipsoid, from a start that is metres to a kilometre off.
_ROUNDS = 4


class _Seen(NamedTuple):
    time_s: float
    sensor: int
    azimuth_rad: float


class BearingStarts:
    """Finds bearings at which tracks begin; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    speed_sigma_mps : float
        What is known beforehand of each component of a velocity, m/s.
    active : bool
        Whether tracks begin by bearings at all.
    """

    def __init__(self, sensors: SensorTable, speed_sigma_mps: float, *, active: bool) -> None:
        self._sigmas = sensors.azimuth_sigma_rad
        self._speed_sigma_mps = speed_sigma_mps
        self._active = active
        self._waiting: OrderedDict[tuple[int, int], list[_Seen]] = OrderedDict()

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
            start = self._take(key, batch, row, model, biases)
            if start is not None:
                found[row] = start
        return found

    def _take(
        self,
        key: tuple[int, int],
        batch: MeasurementBatch,
        row: int,
        model: Model,
        biases: BiasState,
    ) -> Start | None:
        time_s = float(batch.time_s[row])
        before = [one for one in self._waiting.pop(key, []) if time_s - one.time_s <= AGE_MAX_S]
        seen = _Seen(time_s, int(batch.sensor[row]), float(batch.azimuth_rad[row]))
        self._waiting[key] = [*before, seen][-BEARINGS_MAX:]
        if len(self._waiting) > WAITING_MAX:
            self._waiting.popitem(last=False)
        if len(before) < BEARINGS_MIN:
            return None
        try:
            start = self._located(before, model, biases)
        except (BearingsError, np.linalg.LinAlgError):
            # They do not cross, or the search runs away from where they nearly do.
            start = None
        if start is not None:
            self._waiting.pop(key, None)
        return start

    # Flat first, for a place to linearise at, then on the ellipsoid.
    def _located(self, seen: list[_Seen], model: Model, biases: BiasState) -> Start | None:
        azimuth = np.array([one.azimuth_rad for one in seen])
        by_bias = np.zeros((len(seen), len(biases.estimate)))
        for place, one in enumerate(seen):
            own = slice(model.starts[one.sensor], model.starts[one.sensor + 1])
            by_bias[place, own] = model.parameters[own] == PARAMETER_AZIMUTH_OFFSET
        corrected = azimuth - by_bias @ biases.estimate
        times = np.array([one.time_s for one in seen])
        sights = [
            _flat(model.sites[one.sensor], angle, float(self._sigmas[one.sensor]))
            for one, angle in zip(seen, corrected.tolist(), strict=True)
        ]
        mean, _ = begin(sights, times, self._speed_sigma_mps).estimate()
        sigmas = self._sigmas[[one.sensor for one in seen]]
        prior = np.diag([0.0, 0.0, *2 * [self._speed_sigma_mps**-2]])
        height_m = float(model.options[ASSUMED_HEIGHT])
        slopes = np.empty((len(seen), 4))
        residual = np.empty(len(seen))
        for _ in range(_ROUNDS):
            for place, one in enumerate(seen):
                ago = one.time_s - times[-1]
                east, north = mean[:2] + ago * mean[2:]
                seen_at = geodesy.predict_polar(
                    model.plane, model.sites[one.sensor], east, north, height_m
                )
                slopes[place] = seen_at[4], seen_at[5], ago * seen_at[4], ago * seen_at[5]
                residual[place] = wrapped(corrected[place] - seen_at[1])
            weighted = slopes.T / sigmas**2
            covariance = np.linalg.inv(weighted @ slopes + prior)
            mean = covariance @ (weighted @ (residual + slopes @ mean))
        covariance = symmetric_part(np.asarray(covariance, np.float64))
        # A bias turns the lines: χ = a + V ς.
        sensitivity = -covariance @ weighted @ by_bias
        spread = covariance + sensitivity @ biases.covariance @ sensitivity.T
        nearest = min(float(np.hypot(*(mean[:2] - sight.source_m))) for sight in sights)
        worst = float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))
        if not worst <= DISTANCE_SHARE_MAX * nearest:
            return None
        bare = mean - sensitivity @ biases.estimate
        height_variance_m2 = float(model.options[ASSUMED_HEIGHT_SIGMA]) ** 2
        return Start(float(times[-1]), bare, covariance, sensitivity, height_m, height_variance_m2)


# A bearing as if the plane were flat: the azimuth at the site, turned to the plane's north.
def _flat(site: Floats, azimuth_rad: float, sigma_rad: float) -> Sight:
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    east = sine * site[geodesy.EE] + cosine * site[geodesy.NE]
    north = sine * site[geodesy.EN] + cosine * site[geodesy.NN]
    source = np.array([site[geodesy.PE], site[geodesy.PN]])
    return Sight(source, np.asarray(np.arctan2(east, north)), sigma_rad)
