"""The health of each radar, from what the tracker sees: judged at the ends of epochs.

Detection from the looks between two updates of a track; noise and a wrong site from innovations; a
jump of a bias by a cumulated likelihood ratio; silence from the tracks that a radar saw before. A
function of the measurements in data time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import Result, Rows
from multiradar.estimation.measurement._kernels import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.association.association import USUAL_TURN_S
from multiradar.tracking.health._health_kernels import gather, look_around
from multiradar.tracking.health.bias_trends import BiasTrends
from multiradar.tracking.health.health_records import (
    ALARM_BIAS_JUMP,
    ALARM_NOISE,
    ALARM_SILENT,
    ALARM_SITE,
    HealthRecords,
)
from multiradar.tracking.health.health_sums import HealthSums
from multiradar.tracking.health.health_tests import noise_ratio, scale_after, shift_of_site
from multiradar.tracking.health.jump_tests import JumpTests
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import RowIdentities
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

#: Looks, and patterns of innovations, count for so long, s.
DETECTION_MEMORY_S = 900.0
PATTERN_MEMORY_S = 3600.0
#: So many innovations say what the noise is, and so many are the least that do; the noise as told
#: counts as so many at first.
NOISE_MEMORY, NOISE_MIN, NOISE_BEGIN = 4000.0, 200.0, 50.0
#: Noise is more than told when it is so surely above this multiple of it, in standard deviations.
NOISE_HIGH, NOISE_SIGMAS = 2.0, 5.0
#: It is less than configured when it is so surely below this multiple: a sigma in a wrong unit.
NOISE_LOW = 0.25
#: A site is elsewhere when its shift is so sure, in standard deviations, and so many times the
#: noise of range.
SITE_SIGMAS, SITE_NOISES = 8.0, 3.0
#: Sites are looked at once in so long, s.
SITE_STEP_S = 30.0
#: A radar is silent after so many turns, and when its tracks make that so unlikely (a millionth).
SILENT_TURNS, SILENT_EVIDENCE = 5.0, 13.8
#: Bounds of the detection probability that a silence is judged by, and what it is before it shows.
DETECTION_LOW, DETECTION_HIGH, DETECTION_USUAL = 0.5, 0.95, 0.7
#: A track is as fresh as needed to count for the cover of a radar, s.
FRESH_S = 15.0


class Health(NamedTuple):
    """What an epoch's end says.

    Attributes
    ----------
    records : HealthRecords
        Of every radar.
    jumped : int
        The sensor whose bias was just found to have jumped, −1 for none.
    """

    records: HealthRecords
    jumped: int


class SensorHealth:
    """The health of the radars of an engine; owned by it.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; only radars are judged.
    settings : TrackingSettings
        The settings of the tracker.
    plane : SystemPlane
        The system plane.
    trusts_biases : bool
        Whether the filter knows how uncertain its biases are: else its innovations are off without
        anything wrong with the radar, and no alarm is raised by them.
    """

    def __init__(
        self,
        sensors: SensorTable,
        settings: TrackingSettings,
        plane: SystemPlane,
        *,
        trusts_biases: bool = True,
    ) -> None:
        self._sensors, self._settings = sensors, settings
        self._radars = np.flatnonzero(sensors.kinds == KIND_RADAR)
        self._periods = np.nan_to_num(sensors.rotation_period_s, nan=USUAL_TURN_S)
        self._sites = _sites(sensors, plane)
        self._noises = np.column_stack([sensors.range_sigma_m**2, sensors.azimuth_sigma_rad**2])
        count = len(sensors)
        self._sums = HealthSums.empty(0, count)
        self._weight = np.full((count, 2), NOISE_BEGIN)
        self._told = np.full((count, 2), np.nan)
        self._silent = np.zeros(count, np.bool_)
        self._trusts_biases = trusts_biases
        self._jumps = JumpTests(self._radars, self._periods, tests=trusts_biases)
        self._trends = BiasTrends(sensors)
        self._end_s = np.nan
        self._site_step = np.nan
        self._site: tuple[Floats, Floats, NDArray[np.bool_]] | None = None

    def gather(
        self,
        rows: Rows,
        result: Result,
        identities: RowIdentities,
        pool: AircraftPool,
        *,
        first: int,
        last: int,
    ) -> None:
        """Take what became of the rows first…last, which must come in canonical order."""
        capacity = len(pool.roster.track_id)
        if len(self._sums.owner) < capacity:
            self._sums = self._sums.grown(capacity)
        gather(
            first, last, rows, result, identities, pool.life, self._noises, self._periods,
            self._settings.confirm_updates, self._sums,
        )  # fmt: skip

    def close(self, epoch: int, end_s: float, biases: BiasState, pool: AircraftPool) -> Health:
        """Judge at the end of an epoch.

        Parameters
        ----------
        epoch : int
            Its number.
        end_s : float
            Data time of its end.
        biases : BiasState
            The biases with what this epoch said of them.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        Health
            What is said of every radar, and which of them has jumped.
        """
        self._fade(end_s)
        self._learn_noise()
        jumped = self._jumps.find(end_s, self._sums)
        if jumped >= 0:
            self._trends.forget(jumped)
        cover, evidence = self._look_around(end_s, pool)
        self._judge_silence(end_s, evidence)
        self._trends.add(end_s, biases)
        return Health(self._records(epoch, end_s, cover), jumped)

    # ---------------------------------------------------------------- inside

    def _fade(self, end_s: float) -> None:
        passed_s = end_s - self._end_s
        self._end_s = end_s
        if not passed_s > 0.0:
            return
        sums = self._sums
        for array in (sums.hits, sums.looks):
            array *= np.exp(-passed_s / DETECTION_MEMORY_S)
        for array in (sums.pattern, sums.pattern_vector):
            array *= np.exp(-passed_s / PATTERN_MEMORY_S)

    def _learn_noise(self) -> None:
        sums = self._sums
        for s, i in zip(*np.nonzero(sums.noises), strict=True):
            count = float(sums.noises[s, i])
            weight = min(self._weight[s, i] + count, NOISE_MEMORY)
            sums.scale[s, i] = scale_after(sums.scale[s, i], sums.clipped[s, i], count, weight)
            told = sums.told[s, i] / count
            known = self._told[s, i]
            step = min(count / weight, 1.0)
            self._told[s, i] = told if np.isnan(known) else known + step * (told - known)
            self._weight[s, i] = weight
        for array in (sums.noises, sums.clipped, sums.told):
            array[:] = 0.0

    def _look_around(self, end_s: float, pool: AircraftPool) -> tuple[NDArray[np.int64], Floats]:
        cover = np.zeros((len(self._sensors), 2), np.int64)
        evidence = np.zeros(len(self._sensors))
        found = np.clip(self._detection(DETECTION_USUAL), DETECTION_LOW, DETECTION_HIGH)
        look_around(
            end_s, pool.aircraft, pool.roster.track_id, pool.life, self._settings.confirm_updates,
            FRESH_S, self._sites, self._sensors.range_max_m, self._periods,
            self._settings.cone_ratio, -np.log(1.0 - found), self._sums, cover, evidence,
        )  # fmt: skip
        return cover, evidence

    def _detection(self, unknown: float) -> Floats:
        sums = self._sums
        found = np.full(len(sums.looks), unknown)
        np.divide(sums.hits, sums.looks, out=found, where=sums.looks > 0.0)
        return found

    def _judge_silence(self, end_s: float, evidence: Floats) -> None:
        turns = (end_s - self._sums.last_plot) / self._periods
        heard = np.isfinite(self._sums.last_plot)
        begins = heard & (turns >= SILENT_TURNS) & (evidence >= SILENT_EVIDENCE)
        self._silent = (self._silent | begins) & (turns >= SILENT_TURNS)

    def _ratios(self) -> tuple[Floats, NDArray[np.bool_]]:
        """Return measured over configured noise, and where it is surely far from 1."""
        ratios = np.full((len(self._sensors), 2), np.nan)
        surely = np.zeros(len(self._sensors), np.bool_)
        for s, i in zip(*np.nonzero(self._weight >= NOISE_MIN), strict=True):
            told, scale = self._told[s, i], self._sums.scale[s, i]
            ratio = noise_ratio(scale, told)
            ratios[s, i] = ratio
            # Of a variance from n numbers the standard deviation is √(2 / n) of it.
            sigma = NOISE_SIGMAS * scale * np.sqrt(2.0 / self._weight[s, i])
            much = noise_ratio(scale - sigma, told) > NOISE_HIGH
            little = noise_ratio(scale + sigma, told) < NOISE_LOW
            surely[s] |= (much or little) and self._trusts_biases
        return ratios, surely

    def _shifts_now(self, end_s: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        step = np.floor(end_s / SITE_STEP_S)
        if self._site is None or step != self._site_step:
            self._site_step, self._site = step, self._shifts()
        return self._site

    def _shifts(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return where sites seem to lie, how surely, and which of them surely elsewhere."""
        count = len(self._sensors)
        shifts, sigmas = np.full((count, 2), np.nan), np.full(count, np.nan)
        sure = np.zeros(count)
        if not self._trusts_biases:
            return shifts, sigmas, sure > 0.0
        for s in self._radars[self._sums.pattern[self._radars, 0] > 0.0].tolist():
            scale = float(self._sums.scale[s].max())
            shift, covariance = shift_of_site(
                self._sums.pattern[s], self._sums.pattern_vector[s], scale
            )
            shifts[s] = shift
            sigmas[s] = np.sqrt(np.linalg.eigvalsh(covariance)[-1])
            far = np.hypot(*shift) > SITE_NOISES * self._sensors.range_sigma_m[s]
            sure[s] = far * np.sqrt(shift @ np.linalg.solve(covariance, shift))
        # Tracks that one radar pulls aside make the others seem aside the other way.
        elsewhere = (sure >= SITE_SIGMAS) & (sure >= sure.max(initial=0.0))
        return shifts, sigmas, elsewhere

    def _records(self, epoch: int, end_s: float, cover: NDArray[np.int64]) -> HealthRecords:
        radars, sums = self._radars, self._sums
        ratios, noisy = self._ratios()
        shifts, sigmas, elsewhere = self._shifts_now(end_s)
        jumped = self._jumps.recent(end_s)
        alarms = (
            (self._silent.astype(np.int64) << ALARM_SILENT)
            | (jumped.astype(np.int64) << ALARM_BIAS_JUMP)
            | (noisy.astype(np.int64) << ALARM_NOISE)
            | (elsewhere.astype(np.int64) << ALARM_SITE)
        )
        heard = np.isfinite(sums.last_plot)
        ranges, azimuths = (
            self._trends.trend(kind) for kind in (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET)
        )
        return HealthRecords(
            epoch=np.full(len(radars), epoch, np.int64),
            time_s=np.full(len(radars), end_s),
            sensor=radars.astype(np.int32),
            detection_probability=self._detection(np.nan)[radars],
            looks=sums.looks[radars],
            range_sigma_ratio=ratios[radars, 0],
            azimuth_sigma_ratio=ratios[radars, 1],
            range_trend_mps=ranges[radars, 0],
            range_trend_sigma_mps=ranges[radars, 1],
            azimuth_trend_rad_per_s=azimuths[radars, 0],
            azimuth_trend_sigma_rad_per_s=azimuths[radars, 1],
            site_east_m=shifts[radars, 0],
            site_north_m=shifts[radars, 1],
            site_sigma_m=sigmas[radars],
            silence_s=np.where(heard, end_s - sums.last_plot, np.nan)[radars],
            tracks_in_cover=cover[radars, 0],
            tracks_heard=cover[radars, 1],
            jumps=self._jumps.counts[radars],
            last_jump_s=self._jumps.last_s[radars],
            alarms=alarms[radars],
        )


def _sites(sensors: SensorTable, plane: SystemPlane) -> Floats:
    """Return (m, 3) the sites of radars on the system plane and their heights, NaN of others."""
    sites = np.full((len(sensors), 3), np.nan)
    for s in np.flatnonzero(sensors.kinds == KIND_RADAR).tolist():
        east, north = plane.to_plane(sensors.latitude_rad[s], sensors.longitude_rad[s])
        sites[s] = float(east), float(north), sensors.height_m[s]
    return sites
