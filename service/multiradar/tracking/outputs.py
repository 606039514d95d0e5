"""Output of the tracker: track updates, terminated tracks, and the biases of each epoch."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import joined_columns
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.duplicates import NO_DUPLICATES, Duplicates
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.lifecycle.transitions import TrackTransitions
from multiradar.tracking.mode_states import ModeStates

STATE_TENTATIVE = 0
STATE_CONFIRMED = 1
STATE_COASTING = 2

#: Names of the states on the wire, by number.
STATE_NAMES = ("tentative", "confirmed", "coasting")

#: Ground status in `TrackUpdates.on_ground`.
ON_GROUND = 1

#: Columns of `EngineOutput.spread`.
SPREAD_COUNT = 5

#: Columns of `EngineOutput.innovations`: those of `filters._kernels.INNOVATION_COUNT`, and the
#: variances of both components as configured or reported.
INNOVATIONS_COUNT = 10


@dataclass(frozen=True, slots=True)
class TrackUpdates:
    """One row for each measurement that updated a track, in canonical order.

    Attributes
    ----------
    sequence : (n,) int64
        Number of the update, 1, 2, 3, … over all tracks; depends on the measurements alone.
    time_s : (n,) float64
        Data time of the measurement.
    track_id : (n,) int64
        The track, numbered from 1 by first appearance.
    sensor : (n,) int32
        Sensor of the measurement.
    track_number, mode_s_address : (n,) int64
        Identity, −1 when unknown.
    mode_3a : (n,) int32
        Last Mode 3/A code, −1 for none.
    latitude_rad, longitude_rad : (n,) float64
        Estimated WGS 84 position.
    height_m : (n,) float64
        Height by received heights, or by several radars at different sites; NaN where it is not
        known to 1000 m.
    speed_mps, heading_rad : (n,) float64
        Ground speed, and track angle clockwise from true north at the aircraft.
    position_sigma_m, velocity_sigma_mps : (n,) float64
        Square root of the trace of the covariance of position and of velocity.
    state : (n,) int8
        Index into `STATE_NAMES`.
    turn_right_probability, turn_left_probability, speed_change_probability : (n,) float64
        Probabilities of manoeuvres, by the motion modes of the filter; the remainder is straight
        flight. NaN for filters without modes and before the second measurement.
    vertical_rate_mps : (n,) float64
        Rate of climb; NaN without a received height, or where the rate is not known to 5 m/s.
    height_sigma_m : (n,) float64
        Standard deviation of the height, NaN without one.
    adsb_implausible : (n,) bool
        Whether the ADS-B reports of the aircraft are contradicted by other sensors, or by radars
        that should detect it and do not.
    callsign : (n,) int64
        Last callsign, eight characters of six bits; −1 for none.
    measured_mode_s_address : (n,) int64
        Address in the measurement itself, −1 for none.
    on_ground : (n,) int8
        Ground status: 1 on the ground, 0 airborne, −1 never reported.
    """

    sequence: NDArray[np.int64]
    time_s: NDArray[np.float64]
    track_id: NDArray[np.int64]
    sensor: NDArray[np.int32]
    track_number: NDArray[np.int64]
    mode_s_address: NDArray[np.int64]
    mode_3a: NDArray[np.int32]
    latitude_rad: NDArray[np.float64]
    longitude_rad: NDArray[np.float64]
    height_m: NDArray[np.float64]
    speed_mps: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    position_sigma_m: NDArray[np.float64]
    velocity_sigma_mps: NDArray[np.float64]
    state: NDArray[np.int8]
    turn_right_probability: NDArray[np.float64]
    turn_left_probability: NDArray[np.float64]
    speed_change_probability: NDArray[np.float64]
    vertical_rate_mps: NDArray[np.float64]
    height_sigma_m: NDArray[np.float64]
    adsb_implausible: NDArray[np.bool_]
    callsign: NDArray[np.int64]
    measured_mode_s_address: NDArray[np.int64]
    on_ground: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.sequence)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackUpdates]") -> "TrackUpdates":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class TrackPlots:
    """The measurements that updated tracks, one for each row of `TrackUpdates`, in its order.

    Attributes
    ----------
    track_id : (n,) int64
        Track of each measurement.
    measured : MeasurementBatch
        The measurements, corrected for known biases, not for estimated ones.
    """

    track_id: NDArray[np.int64]
    measured: MeasurementBatch

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackPlots]") -> "TrackPlots":
        """Return the rows of all parts, one after the other."""
        if not parts:
            return cls(np.empty(0, np.int64), MeasurementBatch.empty())
        return cls(
            np.concatenate([part.track_id for part in parts]),
            MeasurementBatch.concatenate([part.measured for part in parts]),
        )


@dataclass(frozen=True, slots=True)
class BiasRecords:
    """One row for each bias parameter at the end of each epoch that had measurements.

    An epoch that was closed by a flush and then continued has rows for both closings.

    Attributes
    ----------
    epoch : (n,) int64
        Number of the epoch of data time.
    time_s : (n,) float64
        Data time of the end of the epoch.
    sensor : (n,) int32
        The sensor.
    parameter : (n,) int8
        Kind of the parameter, index into `PARAMETER_NAMES`.
    estimate, sigma : (n,) float64
        Estimate (measured minus true) and its standard deviation at `time_s`, including the random
        walk since the last measurements, in m, rad, 1 or s by kind.
    """

    epoch: NDArray[np.int64]
    time_s: NDArray[np.float64]
    sensor: NDArray[np.int32]
    parameter: NDArray[np.int8]
    estimate: NDArray[np.float64]
    sigma: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.epoch)

    @classmethod
    def concatenate(cls, parts: "Sequence[BiasRecords]") -> "BiasRecords":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class DelayRecords:
    """One row for each confirmed track, with the delay of its transponder.

    It is written when the track is terminated, and at the end of a stream.

    Attributes
    ----------
    time_s : (n,) float64
        Data time of the last update.
    track_id : (n,) int64
        The track.
    track_number, mode_s_address : (n,) int64
        Identity, −1 when unknown.
    delay_m, sigma_m : (n,) float64
        Range error by the delay, one way, at the published biases, and its standard deviation.
    """

    time_s: NDArray[np.float64]
    track_id: NDArray[np.int64]
    track_number: NDArray[np.int64]
    mode_s_address: NDArray[np.int64]
    delay_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[DelayRecords]") -> "DelayRecords":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class EndedTracks:
    """One row for each terminated track, with the data time of its termination.

    Attributes
    ----------
    track_id : (n,) int64
        The track.
    time_s : (n,) float64
        Data time of the start of the epoch or window in which it was terminated.
    reason : (n,) int8
        Reason, index into `transitions.REASON_NAMES`.
    into_track_id : (n,) int64
        Track into which it was merged, −1 for none.
    """

    track_id: NDArray[np.int64]
    time_s: NDArray[np.float64]
    reason: NDArray[np.int8]
    into_track_id: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[EndedTracks]") -> "EndedTracks":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class TrackStates:
    """States of the live tracks, one row each, by ascending identifier.

    Attributes
    ----------
    track_id : (n,) int64
        The track.
    time_s : (n,) float64
        Data time of the state: of the last measurement processed, accepted or rejected.
    mean : (n, 4) float64
        East and north in the system plane, m, and their rates, m/s.
    covariance : (n, 4, 4) float64
        Covariance of `mean`, including the uncertainty of the biases.
    height_m : (n,) float64
        Height by received heights, NaN without one.
    modes : ModeStates or None
        Motion modes, None for filters without.
    shared : (n, 4, c) float64 or None
        Effect on `mean` of one standard deviation of each bias, biases taken as independent: the
        errors common to tracks. None for filters that do not keep it.
    climbs : (n, CLIMB_COUNT) float64 or None
        Heights with their rates and covariance, as in `encounters.climbs`.
    """

    track_id: NDArray[np.int64]
    time_s: NDArray[np.float64]
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    height_m: NDArray[np.float64]
    modes: ModeStates | None = None
    shared: NDArray[np.float64] | None = None
    climbs: NDArray[np.float64] | None = None

    def __len__(self) -> int:
        return len(self.track_id)

    def at(self, indices: NDArray[np.intp]) -> "TrackStates":
        """Return the states of some tracks."""
        modes = self.modes
        if modes is not None:
            modes = ModeStates(
                modes.probability[indices], modes.mean[indices], modes.covariance[indices]
            )
        return TrackStates(
            self.track_id[indices], self.time_s[indices], self.mean[indices],
            self.covariance[indices], self.height_m[indices], modes,
            None if self.shared is None else self.shared[indices],
            None if self.climbs is None else self.climbs[indices],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class StateSample:
    """States of confirmed tracks at the end of an epoch, at the biases published then.

    Attributes
    ----------
    epoch : int
        Number of the epoch.
    time_s : float
        Data time of its end; earlier measurements are included in the states.
    states : TrackStates
        Tracks updated since the previous sample: all, or a random selection.
    """

    epoch: int
    time_s: float
    states: TrackStates


@dataclass(frozen=True, slots=True)
class Picture:
    """The live tracks at the end of an epoch.

    Attributes
    ----------
    time_s : float
        Data time of the last measurement before the end.
    states : TrackStates
        The tracks, at the biases of the end of the epoch.
    """

    time_s: float
    states: TrackStates


@dataclass(frozen=True, slots=True)
class EngineOutput:
    """Output of one call of the engine.

    Attributes
    ----------
    updates : TrackUpdates
        Track updates.
    biases : BiasRecords
        Biases of the closed epochs.
    ended : EndedTracks
        Terminated tracks.
    transitions : TrackTransitions
        Lifecycle transitions of tracks.
    duplicates : Duplicates
        Measurements left out as duplicates.
    health : HealthRecords
        Health of the radars in the closed epochs.
    plots : TrackPlots
        Measurements of the updates.
    spread : (n, 5) float64
        For each update: position in the system plane, east and north, m, and its covariance (east,
        east and north, north), m², including the uncertainty of the biases.
    innovations : (n, INNOVATIONS_COUNT) float64
        For each update: the innovation of its measurement with covariances, at the biases published
        then, and the variances of its noise; NaN in the first column for a measurement that
        initiated its track. Range and azimuth (m, rad); for a reported position east and north (m).
    pictures : tuple of Picture
        Live tracks at the end of each closed epoch, if requested.
    samples : tuple of StateSample
        States at ends of epochs, if requested.
    outcomes : (sensors, outcomes) int64
        Disposition of measurements in the filter, by sensor and `filters.bank.Outcome`; empty
        without any.
    delays : DelayRecords
        Delays of transponders of terminated tracks, where they are estimated.
    saturated : (sensors,) bool
        Sensors that have initiated as many tentative tracks as they may; empty without any.
    unused : MeasurementBatch
        Measurements that updated no track, by ascending time; without duplicates.
    """

    updates: TrackUpdates
    biases: BiasRecords
    ended: EndedTracks
    transitions: TrackTransitions = field(default_factory=lambda: TrackTransitions.concatenate([]))
    duplicates: Duplicates = field(default=NO_DUPLICATES)
    health: HealthRecords = field(default_factory=lambda: HealthRecords.concatenate([]))
    plots: TrackPlots = field(default_factory=lambda: TrackPlots.concatenate([]))
    spread: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, SPREAD_COUNT)))
    innovations: NDArray[np.float64] = field(
        default_factory=lambda: np.empty((0, INNOVATIONS_COUNT))
    )
    pictures: tuple[Picture, ...] = ()
    samples: tuple[StateSample, ...] = ()
    outcomes: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 0), np.int64))
    delays: DelayRecords = field(default_factory=lambda: DelayRecords.concatenate([]))
    saturated: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, np.bool_))
    unused: MeasurementBatch = field(default_factory=MeasurementBatch.empty)


#: Output of a call without measurements.
NO_OUTPUT = EngineOutput(
    updates=TrackUpdates.concatenate([]),
    biases=BiasRecords.concatenate([]),
    ended=EndedTracks.concatenate([]),
)
