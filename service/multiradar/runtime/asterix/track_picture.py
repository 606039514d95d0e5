"""All live tracks extrapolated to a common time, with their last plots and ages."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.geodesic import PositionAndHeading, direct_geodesic
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.asterix.numbers import NO_NUMBER, TrackNumbers
from multiradar.runtime.asterix.sensor_picture import NO_CODES, SensorPicture
from multiradar.runtime.asterix.track_items import (
    MEASURED_DTYPE,
    PRIMARY,
    SECONDARY_SOURCES,
    ages,
    climbing,
    measured_rows,
    movement,
    plot_types,
    sources,
)
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.tracking.columns import rows_of
from multiradar.tracking.forecast.coasting import coasted_variances
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    ON_GROUND,
    SPREAD_COUNT,
    STATE_CONFIRMED,
    STATE_TENTATIVE,
    TrackUpdates,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar_converters.asterix.writing.track_reports import SOURCES, TrackReports

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Rows = NDArray[np.void]
Array = TypeVar("Array", Rows, Floats)

#: State of a track beside its last update.
_LIFE_DTYPE = np.dtype(
    [
        ("number", np.int64),
        ("first_s", np.float64),
        ("height_m", np.float64),
        ("height_s", np.float64),
        ("code_s", np.float64),
        ("ended", np.bool_),
        # When its end was first reported; infinite for a live track.
        ("last_s", np.float64),
    ]
)


class _Plots(NamedTuple):
    # The last plots of tracks: SAC/SIC of the radar, and the bias-corrected plot.
    sensor: Integers
    range_m: Floats
    azimuth_deg: Floats
    kind: Integers


class _Shown(NamedTuple):
    # The last updates of tracks, their slots, and which of them are terminated.
    rows: Rows
    slots: NDArray[np.int32]
    ended: NDArray[np.bool_]


class TrackPicture:
    """Live tracks as reported, updated in place by one owner.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    sensor_picture : SensorPicture
        Their codes and biases.
    tracking : TrackingSettings
        Coasting and drop times, and process noise.
    """

    def __init__(
        self, sensors: SensorTable, sensor_picture: SensorPicture, tracking: TrackingSettings
    ) -> None:
        self._sensors = sensors
        self._sensor_picture = sensor_picture
        self._tracking = tracking
        # Later than the tracker drops them, so that a dropped track does not reappear.
        self._silent_after_s = tracking.drop_after_s + tracking.epoch_s
        self._plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
        #: Numbers of the tracks, the same for all users.
        self.numbers = TrackNumbers()
        self._live = LiveTracks()
        self._life = np.zeros(0, _LIFE_DTYPE)
        self._measured = np.zeros(0, MEASURED_DTYPE)
        self._spread = np.zeros((0, SPREAD_COUNT))
        self._source_s = np.zeros((0, len(SOURCES)))
        self._sensor_s = np.zeros((0, len(sensors)))

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        more = max(len(sensors) - self._sensor_s.shape[1], 0)
        self._sensor_s = np.pad(self._sensor_s, ((0, 0), (0, more)), constant_values=-np.inf)
        self._sensors = sensors

    def __len__(self) -> int:
        return len(self._live)

    def update(self, updates: TrackUpdates, measured: MeasurementBatch, spread: Floats) -> None:
        """Add updates in order, with their measurements and `EngineOutput.spread`."""
        if not len(updates):
            return
        rows, plots = rows_of(updates), measured_rows(measured)
        tracks, first = np.unique(rows["track_id"], return_index=True)
        new = self._live.slots(tracks) < 0
        self._live.update(rows)
        self._grow()
        initiated = self._live.slots(tracks[new])
        self._life[initiated] = (NO_NUMBER, 0.0, np.nan, -np.inf, -np.inf, False, np.inf)
        self._life["first_s"][initiated] = rows["time_s"][first[new]]
        self._source_s[initiated] = -np.inf
        self._sensor_s[initiated] = -np.inf
        self._record(rows, plots)
        # NumPy assigns in order: the last row of each track is kept.
        self._spread[self._live.slots(rows["track_id"])] = spread

    def terminate(self, track_ids: Integers) -> None:
        """Mark tracks as terminated: they are reported once more."""
        slots = self._live.slots(track_ids)
        self._life["ended"][slots[slots >= 0]] = True

    def reports(self, time_s: float, reported_s: float | None = None) -> TrackReports:
        """Return the tracks with a number, by identifier, and discard terminated ones.

        Parameters
        ----------
        time_s : float
            Data time, not before that of any update.
        reported_s : float, optional
            Data time of the earliest last report among the users, s. Tracks terminated later are
            kept until all users have received it. `time_s` by default.

        Returns
        -------
        TrackReports
            Extrapolated to the time; each channel sets `first`, `code_changed` and the Cartesian
            plane.
        """
        shown = self._numbered(time_s)
        reports = self._reported(time_s, shown)
        self._discard(shown, time_s, time_s if reported_s is None else reported_s)
        return reports

    def discard_terminated(self, time_s: float) -> None:
        """Assign numbers to the tracks and discard terminated ones, without reports."""
        self._discard(self._numbered(time_s), time_s, time_s)

    def retain(self, track_ids: Integers) -> None:
        """Terminate all tracks but these."""
        held = self._live.all()["track_id"]
        self.terminate(held[~np.isin(held, track_ids)])

    # ---------------------------------------------------------------- inside

    def _grow(self) -> None:
        size, held = self._live.capacity, len(self._life)
        if size > held:
            self._life = _grown(self._life, size)
            self._measured = _grown(self._measured, size)
            self._spread = _grown(self._spread, size)
            self._source_s = _grown(self._source_s, size)
            self._sensor_s = _grown(self._sensor_s, size)

    def _record(self, rows: Rows, plots: Rows) -> None:
        slots = self._live.slots(rows["track_id"])
        time_s, sensor = rows["time_s"], rows["sensor"]
        from_source = sources(plots, self._sensors.self_reported[sensor])
        row, source = np.nonzero(from_source)
        np.maximum.at(self._source_s, (slots[row], source), time_s[row])
        np.maximum.at(self._sensor_s, (slots, sensor), time_s)
        self._measured[slots] = plots
        has_height = ~np.isnan(plots["height_m"])
        self._life["height_m"][slots[has_height]] = plots["height_m"][has_height]
        self._life["height_s"][slots[has_height]] = time_s[has_height]
        coded = plots["mode_3a"] >= 0
        self._life["code_s"][slots[coded]] = time_s[coded]
        radar = plots["kind"] == KIND_RADAR
        primary = from_source[:, PRIMARY]
        secondary = radar & (~primary | from_source[:, SECONDARY_SOURCES].any(axis=1))
        self._sensor_picture.record_plots(
            sensor, time_s, secondary=secondary, primary=radar & primary
        )

    def _numbered(self, time_s: float) -> "_Shown":
        rows = self._live.all()
        slots = self._live.slots(rows["track_id"])
        silent = time_s - rows["time_s"] > self._silent_after_s
        ended = self._life["ended"][slots] | silent
        last_s = np.minimum(self._life["last_s"][slots], time_s)
        self._life["last_s"][slots] = np.where(ended, last_s, np.inf)
        new = (self._life["number"][slots] == NO_NUMBER) & ~ended
        self._life["number"][slots[new]] = self.numbers.give(rows["track_id"][new], time_s)
        return _Shown(rows, slots, ended)

    def _discard(self, shown: "_Shown", time_s: float, reported_s: float) -> None:
        gone = shown.ended & (self._life["last_s"][shown.slots] <= reported_s)
        self.numbers.free(self._life["number"][shown.slots[gone]], time_s)
        self._live.remove(shown.rows["track_id"][gone])

    def _reported(self, time_s: float, shown: "_Shown") -> TrackReports:
        numbered = self._life["number"][shown.slots] != NO_NUMBER
        rows, slots, ended = (column[numbered] for column in shown)
        life, measured = self._life[slots], self._measured[slots]
        age_s = np.maximum(time_s - rows["time_s"], 0.0)
        here = _moved(rows, age_s)
        has_height = ~np.isnan(life["height_m"])
        climb = rows["vertical_rate_mps"]
        height_m = rows["height_m"] + np.nan_to_num(climb) * age_s
        none = np.full(len(rows), np.nan)
        variances = self._variances(rows, self._spread[slots], age_s)
        recent = rows["time_s"] - self._tracking.coast_after_s
        turning, speeding = movement(rows)
        plots = self._plots(rows, measured)
        return TrackReports(
            time_s=time_s,
            number=life["number"],
            latitude_deg=np.degrees(here.latitude_rad),
            longitude_deg=np.degrees(here.longitude_rad),
            x_m=none,
            y_m=none,
            velocity_east_mps=rows["speed_mps"] * np.sin(here.heading_rad),
            velocity_north_mps=rows["speed_mps"] * np.cos(here.heading_rad),
            mode_3a=rows["mode_3a"].astype(np.int64),
            mode_s_address=rows["mode_s_address"],
            callsign=rows["callsign"],
            code_changed=np.zeros(len(rows), np.bool_),
            measured_height_m=life["height_m"],
            barometric_m=np.where(has_height, height_m, np.nan),
            geometric_m=np.where(has_height, np.nan, height_m),
            climb_mps=climb,
            turning=turning,
            speeding=speeding,
            climbing=climbing(climb),
            monosensor=(self._sensor_s[slots] >= recent[:, None]).sum(axis=1) <= 1,
            tentative=rows["state"] == STATE_TENTATIVE,
            first=np.zeros(len(rows), np.bool_),
            last=ended,
            implausible=rows["adsb_implausible"],
            coasting=(age_s > self._tracking.coast_after_s) & (rows["state"] == STATE_CONFIRMED),
            on_ground=rows["on_ground"] == ON_GROUND,
            track_age_s=time_s - life["first_s"],
            age_s=ages(time_s, self._source_s[slots]),
            height_age_s=ages(time_s, life["height_s"]),
            code_age_s=ages(time_s, life["code_s"]),
            old_s=self._tracking.coast_after_s,
            sensor=plots.sensor,
            range_m=plots.range_m,
            azimuth_deg=plots.azimuth_deg,
            plot_height_m=measured["height_m"],
            plot_mode_3a=measured["mode_3a"].astype(np.int64),
            plot_type=plots.kind,
            variance_east_m2=variances[:, 0],
            variance_north_m2=variances[:, 1],
            covariance_m2=variances[:, 2],
            variance_x_m2=none,
            variance_y_m2=none,
            covariance_xy_m2=none,
            velocity_sigma_mps=rows["velocity_sigma_mps"] / np.sqrt(2.0),
            height_sigma_m=rows["height_sigma_m"],
        )

    def _plots(self, rows: Rows, measured: Rows) -> "_Plots":
        codes = self._sensor_picture.codes[rows["sensor"]]
        range_m, azimuth_rad = self._sensor_picture.without_biases(
            rows["sensor"], measured["range_m"], measured["azimuth_rad"]
        )
        sensor = np.where(measured["kind"] == KIND_RADAR, codes, NO_CODES)
        return _Plots(sensor, range_m, np.degrees(azimuth_rad), plot_types(measured))

    def _variances(self, rows: Rows, spread: Floats, age_s: Floats) -> Floats:
        """Return variances of east and north, and their covariance, at the age, (n, 3)."""
        height_m = np.nan_to_num(rows["height_m"])
        matrix = self._plane.local_matrix(spread[:, 0], spread[:, 1], height_m)
        plane = spread[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
        true = matrix @ plane @ matrix.swapaxes(-1, -2)
        sigma = np.sqrt(np.stack([true[:, 0, 0], true[:, 1, 1]], axis=1))
        density = self._tracking.acceleration_density
        grown = coasted_variances(sigma, rows["velocity_sigma_mps"], density, age_s)
        # The correlation of east and north is kept.
        ratio = np.sqrt(grown[:, 0] * grown[:, 1]) / (sigma[:, 0] * sigma[:, 1])
        return np.concatenate([grown, (true[:, 0, 1] * ratio)[:, None]], axis=1)


def _moved(rows: Rows, age_s: Floats) -> PositionAndHeading:
    distance_m = rows["speed_mps"] * age_s
    return direct_geodesic(
        rows["latitude_rad"], rows["longitude_rad"], rows["heading_rad"], distance_m
    )


def _grown(array: Array, size: int) -> Array:
    more = np.zeros((size - len(array), *array.shape[1:]), array.dtype)
    whole: Array = np.concatenate([array, more])
    return whole
