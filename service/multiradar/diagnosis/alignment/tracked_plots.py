"""The plots of tracks with the velocities of their aircraft, as an alignment uses them."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.plots import Floats, Integers, Rows
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.tracking.outputs import EngineOutput

#: Plots that are retained, at most: 90 octets each.
PLOTS_MAX = 400_000
# Multiplicative hash (Knuth, The Art of Computer Programming 3, 6.4) of the number of a track.
_HASH, _HASH_BITS = 2_654_435_761, 32
# Names of aircraft by address, by code, and by track do not overlap.
_BY_CODE, _BY_TRACK = 1 << 32, 1 << 33
# Velocities are swapped between updates 1, 2, 4 … apart.
_LAGS = (1, 2, 4, 8, 16, 32)


@dataclass(frozen=True, slots=True)
class TrackedPlots(Rows):
    """Plots by track and time.

    Attributes
    ----------
    track_id, aircraft : (n,) int64
        The track; its aircraft, by address, else by code, else by track: tracks of one aircraft
        have the same.
    sensor : (n,) int32
        Index into the sensor table.
    kind : (n,) int8
        `KIND_RADAR` or `KIND_POSITION`.
    time_s, range_m, azimuth_rad, latitude_rad, longitude_rad : (n,) float64
        As measured, without known biases; NaN where the kind has none.
    height_m : (n,) float64
        As measured, else that of the track; NaN where neither is known.
    track_latitude_rad, track_longitude_rad : (n,) float64
        Position of the track.
    velocity_mps : (n, 2) float64
        East and north.
    velocity_variance : (n,) float64
        Of each axis, m²/s².
    """

    track_id: Integers
    aircraft: Integers
    sensor: NDArray[np.int32]
    kind: NDArray[np.int8]
    time_s: Floats
    range_m: Floats
    azimuth_rad: Floats
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats
    track_latitude_rad: Floats
    track_longitude_rad: Floats
    velocity_mps: Floats
    velocity_variance: Floats


class PlotCollector:
    """Retains the plots of tracks; beyond `PLOTS_MAX`, those of a sample of whole tracks.

    Attributes
    ----------
    fraction : float
        Fraction of the tracks that are retained.
    """

    def __init__(self, plots_max: int = PLOTS_MAX) -> None:
        self.fraction = 1.0
        self._plots_max = plots_max
        self._parts: list[TrackedPlots] = []
        self._rows = 0

    def __len__(self) -> int:
        return self._rows

    def add(self, output: EngineOutput) -> None:
        """Add the updates of an output of the engine."""
        if not len(output.updates):
            return
        part = self._sampled(_plots_of(output))
        self._parts.append(part)
        self._rows += part.size
        while self._rows > self._plots_max:
            self.fraction /= 2.0
            self._parts = [self._sampled(one) for one in self._parts]
            self._rows = sum(one.size for one in self._parts)

    def plots(self, acceleration_density: float) -> TrackedPlots:
        """Return the plots by track and time.

        Parameters
        ----------
        acceleration_density : float
            Spectral density of an aircraft's acceleration, m²/s³: how a velocity ages.

        Raises
        ------
        ValueError
            No track was updated.
        """
        if not len(self):
            msg = "there are no tracks"
            raise ValueError(msg)
        names = [one.name for one in fields(TrackedPlots)]
        whole = TrackedPlots(
            **{name: np.concatenate([getattr(one, name) for one in self._parts]) for name in names}
        )
        ordered = whole.select(np.lexsort((whole.time_s, whole.track_id)))
        return _with_one_aircraft(_with_best_velocities(ordered, acceleration_density))

    def _sampled(self, part: TrackedPlots) -> TrackedPlots:
        if self.fraction == 1.0:
            return part
        mixed = (part.track_id * _HASH) % (1 << _HASH_BITS)
        return part.select(mixed < self.fraction * (1 << _HASH_BITS))


def _plots_of(output: EngineOutput) -> TrackedPlots:
    updates, measured = output.updates, output.plots.measured
    code = updates.mode_3a.astype(np.int64)
    named = np.where(code >= 0, _BY_CODE + code, _BY_TRACK + updates.track_id)
    direction = np.stack([np.sin(updates.heading_rad), np.cos(updates.heading_rad)], axis=1)
    known = np.isfinite(measured.height_m)
    part = TrackedPlots(
        track_id=updates.track_id,
        aircraft=np.where(updates.mode_s_address >= 0, updates.mode_s_address, named),
        sensor=measured.sensor,
        kind=measured.kind,
        time_s=measured.time_s,
        range_m=measured.range_m,
        azimuth_rad=measured.azimuth_rad,
        latitude_rad=measured.latitude_rad,
        longitude_rad=measured.longitude_rad,
        height_m=np.where(known, measured.height_m, updates.height_m),
        track_latitude_rad=updates.latitude_rad,
        track_longitude_rad=updates.longitude_rad,
        velocity_mps=updates.speed_mps[:, None] * direction,
        velocity_variance=updates.velocity_sigma_mps**2 / 2.0,
    )
    # Bearings have no position.
    return part.select(np.isin(part.kind, (KIND_RADAR, KIND_POSITION)))


def _with_best_velocities(plots: TrackedPlots, acceleration_density: float) -> TrackedPlots:
    """Give each plot the velocity of the update of its track that is most certain at its time.

    The variance of a velocity grows by the density times the time between them, so the first plots
    of a track have a velocity, too. Exchanges over 1, 2, 4 … updates reach each of the next 63.
    """
    velocity, variance = plots.velocity_mps.copy(), plots.velocity_variance.copy()
    for lag in _LAGS:
        same = plots.track_id[lag:] == plots.track_id[:-lag]
        aged = acceleration_density * (plots.time_s[lag:] - plots.time_s[:-lag])
        before, after = np.flatnonzero(same), np.flatnonzero(same) + lag
        aged = aged[same]
        for to, of in ((before, after), (after, before)):
            offered = variance[of] + aged
            better = offered < variance[to]
            velocity[to[better]] = velocity[of[better]]
            variance[to[better]] = offered[better]
    return replace(plots, velocity_mps=velocity, velocity_variance=variance)


def _with_one_aircraft(plots: TrackedPlots) -> TrackedPlots:
    """Give all plots of a track the aircraft of its last plot, which has its whole identity."""
    last = np.append(np.flatnonzero(np.diff(plots.track_id)), plots.size - 1)
    lengths = np.diff(np.append(-1, last))
    return replace(plots, aircraft=np.repeat(plots.aircraft[last], lengths))
