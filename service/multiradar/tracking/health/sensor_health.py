"""Sensor health of each radar, evaluated at the ends of epochs.

Probability of detection from the scans between two updates of a track; noise and site errors from
innovations; bias jumps by a cumulative likelihood ratio; silence from the tracks that a radar
detected before. A function of the measurements in data time.
"""

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters._kernels import RESTARTED
from multiradar.estimation.filters.arrays import Result, Rows
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.state import Fields, carry_state
from multiradar.tracking.health._health_kernels import count_coverage, gather
from multiradar.tracking.health.bias_trends import BiasTrends
from multiradar.tracking.health.health_records import (
    ALARM_ADDRESS,
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
from multiradar.tracking.settings import DEFAULT_PERIOD_S, TrackingSettings

Floats = NDArray[np.float64]

#: Time constants of scan counts and of innovation patterns, s.
DETECTION_MEMORY_S = 900.0
PATTERN_MEMORY_S = 3600.0
#: Maximum and minimum number of innovations of a noise estimate, and the initial weight of the
#: configured noise.
NOISE_MEMORY, NOISE_MIN, NOISE_BEGIN = 4000.0, 200.0, 50.0
#: Ratio above which noise is too large, and the significance required, in standard deviations.
NOISE_HIGH, NOISE_SIGMAS = 2.0, 5.0
#: Ratio below which noise is too small: a sigma in a wrong unit.
NOISE_LOW = 0.25
#: Significance of a site error, in standard deviations, and its minimum in terms of the range
#: noise.
SITE_SIGMAS, SITE_NOISES = 8.0, 3.0
#: Interval of site estimates, s.
SITE_STEP_S = 30.0
#: Minimum number of scans of a silence, and log odds required (one in a million).
SILENT_SCANS, SILENT_EVIDENCE = 5.0, 13.8
#: Bounds of the probability of detection used for silences, and its default.
DETECTION_LOW, DETECTION_HIGH, DETECTION_DEFAULT = 0.5, 0.95, 0.7
#: Maximum age of tracks for the coverage count, s.
FRESH_S = 15.0


class Health(NamedTuple):
    """Health at the end of an epoch.

    Attributes
    ----------
    records : HealthRecords
        Records of every radar.
    jumped : int
        Sensor whose bias was just found to have jumped, −1 for none.
    """

    records: HealthRecords
    jumped: int


class SensorHealth:
    """Health of the radars of an engine; owned by it.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; only radars are evaluated.
    settings : TrackingSettings
        The settings of the tracker.
    plane : SystemPlane
        The system plane.
    bounds_bias_errors : bool
        Whether the filter estimates the uncertainty of its biases. Otherwise its innovations may be
        off without any fault of the radar, and raise no alarms.
    """

    STATE: ClassVar[Fields] = {
        "_sums": HealthSums,
        "_weight": np.ndarray,
        "_noise_share": np.ndarray,
        "_silent": np.ndarray,
        "_confused": np.ndarray,
        "_jumps": JumpTests,
        "_trends": BiasTrends,
        "_end_s": float,
        "_site_step": float,
        "_site": tuple[np.ndarray, np.ndarray, np.ndarray] | None,
    }

    def __init__(
        self,
        sensors: SensorTable,
        settings: TrackingSettings,
        plane: SystemPlane,
        *,
        bounds_bias_errors: bool,
    ) -> None:
        self._sensors, self._settings = sensors, settings
        self._radars = np.flatnonzero(sensors.kinds == KIND_RADAR)
        self._periods = np.nan_to_num(sensors.rotation_period_s, nan=DEFAULT_PERIOD_S)
        self._sites = _sites(sensors, plane)
        self._noises = np.column_stack([sensors.range_sigma_m**2, sensors.azimuth_sigma_rad**2])
        count = len(sensors)
        self._sums = HealthSums.empty(0, count)
        self._weight = np.full((count, 2), NOISE_BEGIN)
        self._noise_share = np.full((count, 2), np.nan)
        self._silent = np.zeros(count, np.bool_)
        self._confused = np.zeros(count, np.bool_)
        self._bounds_bias_errors = bounds_bias_errors
        self._jumps = JumpTests(self._radars, self._periods, tests=bounds_bias_errors)
        self._trends = BiasTrends(sensors)
        self._end_s = np.nan
        self._site_step = np.nan
        self._site: tuple[Floats, Floats, NDArray[np.bool_]] | None = None

    def carry(self, old: "SensorHealth", change: SensorChange) -> None:
        """Continue with other sensors; the health of those that changed starts again."""
        before = old._sums
        self._sums = self._sums.grown(len(before.owner))
        self._end_s, self._jumps.held_s = old._end_s, old._jumps.held_s
        carry_state(old._trends, self._trends, change)
        kept = np.flatnonzero(~change.relearnt)
        for was, now in ((old, self), (old._jumps, self._jumps)):
            for name, kind in type(now).STATE.items():
                if kind is np.ndarray:
                    getattr(now, name)[kept] = getattr(was, name)[kept]
        for name in before._fields:
            # Of aircraft, of aircraft and sensors, of sensors.
            place = {"owner": slice(None), "updates": slice(None), "seen": (slice(None), kept)}
            at = place.get(name, kept)
            getattr(self._sums, name)[at] = getattr(before, name)[at]

    def gather(
        self,
        rows: Rows,
        result: Result,
        identities: RowIdentities,
        addresses: NDArray[np.int64],
        pool: AircraftPool,
        *,
        first: int,
        last: int,
    ) -> None:
        """Add the outcomes of the rows first…last, in canonical order.

        ``addresses`` are the Mode S addresses in them. One that differs from that of the track
        raises an alarm for good: association excludes it.
        """
        chosen = slice(first, last)
        known, received = identities.mode_s_address[chosen], addresses[chosen]
        confused = (known >= 0) & (received >= 0) & (known != received)
        confused &= result.outcome[chosen] <= RESTARTED
        self._confused[rows.sensor[chosen][confused]] = True
        capacity = len(pool.roster.track_id)
        if len(self._sums.owner) < capacity:
            self._sums = self._sums.grown(capacity)
        gather(
            first, last, rows, result, identities, pool.life, self._noises, self._periods,
            self._settings.confirm_updates, self._sums,
        )  # fmt: skip

    def close(self, epoch: int, end_s: float, biases: BiasState, pool: AircraftPool) -> Health:
        """Evaluate the health at the end of an epoch.

        Parameters
        ----------
        epoch : int
            Number of the epoch.
        end_s : float
            Data time of its end.
        biases : BiasState
            The biases, including the information of this epoch.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        Health
            Records of every radar, and the sensor that jumped.
        """
        self._fade(end_s)
        self._learn_noise()
        jumped = self._jumps.find(end_s, self._sums)
        if jumped >= 0:
            self._trends.reset(jumped)
        cover, evidence = self._count_coverage(end_s, pool)
        self._update_silence(end_s, evidence)
        self._trends.add(end_s, biases)
        return Health(self._records(epoch, end_s, cover), jumped)

    def _fade(self, end_s: float) -> None:
        passed_s = end_s - self._end_s
        self._end_s = end_s
        if not passed_s > 0.0:
            return
        sums = self._sums
        for array in (sums.hits, sums.scans):
            array *= np.exp(-passed_s / DETECTION_MEMORY_S)
        for array in (sums.pattern, sums.pattern_vector):
            array *= np.exp(-passed_s / PATTERN_MEMORY_S)

    def _learn_noise(self) -> None:
        sums = self._sums
        for s, i in zip(*np.nonzero(sums.noises), strict=True):
            count = float(sums.noises[s, i])
            weight = min(self._weight[s, i] + count, NOISE_MEMORY)
            sums.scale[s, i] = scale_after(sums.scale[s, i], sums.clipped[s, i], count, weight)
            noise_share = sums.noise_share[s, i] / count
            known = self._noise_share[s, i]
            step = min(count / weight, 1.0)
            self._noise_share[s, i] = (
                noise_share if np.isnan(known) else known + step * (noise_share - known)
            )
            self._weight[s, i] = weight
        for array in (sums.noises, sums.clipped, sums.noise_share):
            array[:] = 0.0

    def _count_coverage(self, end_s: float, pool: AircraftPool) -> tuple[NDArray[np.int64], Floats]:
        cover = np.zeros((len(self._sensors), 2), np.int64)
        evidence = np.zeros(len(self._sensors))
        found = np.clip(self._detection(DETECTION_DEFAULT), DETECTION_LOW, DETECTION_HIGH)
        count_coverage(
            end_s, pool.aircraft, pool.roster.track_id, pool.life, self._settings.confirm_updates,
            FRESH_S, self._sites, self._sensors.range_max_m, self._periods,
            self._settings.cone_ratio, -np.log(1.0 - found), self._sums, cover, evidence,
        )  # fmt: skip
        return cover, evidence

    def _detection(self, unknown: float) -> Floats:
        sums = self._sums
        found = np.full(len(sums.scans), unknown)
        np.divide(sums.hits, sums.scans, out=found, where=sums.scans > 0.0)
        return found

    def _update_silence(self, end_s: float, evidence: Floats) -> None:
        scans = (end_s - self._sums.last_plot) / self._periods
        heard = np.isfinite(self._sums.last_plot) & ~self._sensors.disabled
        begins = heard & (scans >= SILENT_SCANS) & (evidence >= SILENT_EVIDENCE)
        self._silent = (self._silent & heard | begins) & (scans >= SILENT_SCANS)

    def _ratios(self) -> tuple[Floats, NDArray[np.bool_]]:
        """Return measured over configured noise, and where it is significantly wrong."""
        ratios = np.full((len(self._sensors), 2), np.nan)
        surely = np.zeros(len(self._sensors), np.bool_)
        for s, i in zip(*np.nonzero(self._weight >= NOISE_MIN), strict=True):
            noise_share, scale = self._noise_share[s, i], self._sums.scale[s, i]
            ratio = noise_ratio(scale, noise_share)
            ratios[s, i] = ratio
            # The relative standard deviation of a variance of n numbers is √(2 / n).
            sigma = NOISE_SIGMAS * scale * np.sqrt(2.0 / self._weight[s, i])
            much = noise_ratio(scale - sigma, noise_share) > NOISE_HIGH
            little = noise_ratio(scale + sigma, noise_share) < NOISE_LOW
            surely[s] |= (much or little) and self._bounds_bias_errors
        return ratios, surely

    def _shifts_now(self, end_s: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        step = np.floor(end_s / SITE_STEP_S)
        if self._site is None or step != self._site_step:
            self._site_step, self._site = step, self._shifts()
        return self._site

    def _shifts(self) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Return site errors, their standard deviations, and which are significant."""
        count = len(self._sensors)
        shifts, sigmas = np.full((count, 2), np.nan), np.full(count, np.nan)
        sure = np.zeros(count)
        if not self._bounds_bias_errors:
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
        # Tracks pulled aside by one radar make the others seem displaced the other way.
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
            | (self._confused.astype(np.int64) << ALARM_ADDRESS)
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
            looks=sums.scans[radars],
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
    """Return (m, 3) the sites of radars on the system plane and their heights, NaN for others."""
    sites = np.full((len(sensors), 3), np.nan)
    for s in np.flatnonzero(sensors.kinds == KIND_RADAR).tolist():
        east, north = plane.to_plane(sensors.latitude_rad[s], sensors.longitude_rad[s])
        sites[s] = float(east), float(north), sensors.height_m[s]
    return sites
