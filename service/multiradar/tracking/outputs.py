"""What the tracker says: updates of tracks, ends of tracks, and the biases of each epoch."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import joined_columns
from multiradar.tracking.health.health_records import HealthRecords
from multiradar.tracking.input.duplicates import NO_DUPLICATES, Duplicates
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.plots import TrackPlots

STATE_TENTATIVE = 0
STATE_CONFIRMED = 1
STATE_COASTING = 2

#: Names of the states on the wire, by number.
STATE_NAMES = ("tentative", "confirmed", "coasting")

#: Columns of `EngineOutput.spread`.
SPREAD_COUNT = 5


@dataclass(frozen=True, slots=True)
class TrackUpdates:
    """One row for each measurement that updated a track, in canonical order.

    Attributes
    ----------
    sequence : (n,) int64
        Number of the update, 1, 2, 3, … over all tracks; a function of the measurements alone.
    time_s : (n,) float64
        Data time of the measurement.
    track_id : (n,) int64
        The track, numbered from 1 by first appearance.
    sensor : (n,) int32
        The sensor that measured.
    track_number, mode_s_address : (n,) int64
        Identity, −1 when unknown.
    mode_3a : (n,) int32
        Last code heard, −1 when none was.
    latitude_rad, longitude_rad : (n,) float64
        Estimated WGS 84 position.
    height_m : (n,) float64
        Height by those that were heard; by what several radars see where none was, and NaN where
        that is not known to 1000 m.
    speed_mps, heading_rad : (n,) float64
        Ground speed, and its direction clockwise from true north at the aircraft.
    position_sigma_m, velocity_sigma_mps : (n,) float64
        Square root of the trace of the covariance of position and of velocity.
    state : (n,) int8
        Index into `STATE_NAMES`.
    turn_right_probability, turn_left_probability, speed_change_probability : (n,) float64
        How likely the aircraft manoeuvres, by the filter's modes of motion; what is left to one is
        straight flight. NaN when the filter has no modes, and before the second measurement.
    vertical_rate_mps : (n,) float64
        Rate of climb; NaN when no height was heard, or the rate is not known to 5 m/s.
    height_sigma_m : (n,) float64
        Standard deviation of the height, NaN where there is none.
    adsb_implausible : (n,) bool
        Whether what the aircraft reports of itself is contradicted by what others measure, or by
        radars that should see it and do not.
    callsign : (n,) int64
        Last callsign heard, eight letters of six bits; −1 when none was.
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

    def __len__(self) -> int:
        return len(self.sequence)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackUpdates]") -> "TrackUpdates":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class BiasRecords:
    """One row for each bias parameter at the end of each epoch that had measurements.

    An epoch that was closed by the end of a stream and then went on has rows for both ends.

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
        Estimate (measured minus true) and its standard deviation at `time_s`, the walk since the
        last measurements included, in m, rad, 1 or s by kind.
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
class EndedTracks:
    """One row for each track that ended, with the data time at which its end was noticed.

    Attributes
    ----------
    track_id : (n,) int64
        The track.
    time_s : (n,) float64
        Data time of the beginning of the epoch or window in which it ended.
    reason : (n,) int8
        Why, index into `transitions.REASON_NAMES`.
    into_track_id : (n,) int64
        The track that stands for one that was merged, −1 for none.
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
class TrackTransitions:
    """One row for each step in the life of a track, in the order of the measurements.

    Attributes
    ----------
    time_s : (n,) float64
        Data time at which it was noticed: of a measurement, or of the beginning of an epoch or
        window; never going back.
    track_id : (n,) int64
        The track.
    transition, reason : (n,) int8
        What it did and why, indices into `transitions.TRANSITION_NAMES` and `REASON_NAMES`.
    into_track_id : (n,) int64
        The track that stands for one that was merged, −1 for none.
    last_update_s : (n,) float64
        Data time of the update of the track before this, NaN when there was none.
    """

    time_s: NDArray[np.float64]
    track_id: NDArray[np.int64]
    transition: NDArray[np.int8]
    reason: NDArray[np.int8]
    into_track_id: NDArray[np.int64]
    last_update_s: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.track_id)

    @classmethod
    def concatenate(cls, parts: "Sequence[TrackTransitions]") -> "TrackTransitions":
        """Return the rows of all parts, one after the other."""
        if len(parts) == 1:
            return parts[0]
        return cls(**joined_columns(cls, parts))


@dataclass(frozen=True, slots=True)
class TrackStates:
    """The live tracks as the filter knows them, one row each, by ascending identifier.

    Attributes
    ----------
    track_id : (n,) int64
        The track.
    time_s : (n,) float64
        Data time of the state: of the last measurement that moved it, taken or refused.
    mean : (n, 4) float64
        East and north in the system plane, m, and their rates, m/s.
    covariance : (n, 4, 4) float64
        Covariance of `mean`, the uncertainty of the biases included.
    height_m : (n,) float64
        Height by those that were heard, NaN when none was.
    modes : ModeStates or None
        The modes of motion, None for filters without.
    shared : (n, 4, c) float64 or None
        What a standard deviation of each of the biases, taken for independent, does to `mean`: what
        tracks err by alike. None for filters that do not keep it.
    climbs : (n, CLIMB_COUNT) float64 or None
        Heights with their rates and covariance, as in `tracking.climbs`.
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

    def at(self, places: NDArray[np.intp]) -> "TrackStates":
        """Return the states of some tracks."""
        modes = self.modes
        if modes is not None:
            modes = ModeStates(
                modes.probability[places], modes.mean[places], modes.covariance[places]
            )
        return TrackStates(
            self.track_id[places], self.time_s[places], self.mean[places],
            self.covariance[places], self.height_m[places], modes,
            None if self.shared is None else self.shared[places],
            None if self.climbs is None else self.climbs[places],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class StateSample:
    """States of confirmed tracks when an epoch has ended, biases as published then.

    Attributes
    ----------
    epoch : int
        Number of the epoch.
    time_s : float
        Data time of its end; the measurements before it are in the states.
    states : TrackStates
        Tracks that were updated since the sample before: all, or those that are drawn.
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
        Data time of the last measurement before.
    states : TrackStates
        The tracks, with the biases that the epoch ends with.
    """

    time_s: float
    states: TrackStates


@dataclass(frozen=True, slots=True)
class EngineOutput:
    """What came out of one call of the engine.

    Attributes
    ----------
    updates : TrackUpdates
        Updates of tracks.
    biases : BiasRecords
        Biases of the epochs that closed.
    ended : EndedTracks
        Tracks that ended.
    transitions : TrackTransitions
        Steps in the lives of tracks.
    duplicates : Duplicates
        Measurements that were left out because another one says the same.
    health : HealthRecords
        Health of the radars in the epochs that closed.
    plots : TrackPlots
        The measurements behind the updates.
    spread : (n, 5) float64
        Of each update: where the track lies in the system plane, east and north, m, and the
        covariance of that (east, east and north, north), m², the uncertainty of the biases
        included.
    pictures : tuple of Picture
        The live tracks at the end of each epoch that closed, if they are asked for.
    samples : tuple of StateSample
        States at ends of epochs, where the engine was asked for them.
    outcomes : (sensors, outcomes) int64
        What became of the measurements in the filter, by sensor and `filters.bank.Outcome`; empty
        without any.
    """

    updates: TrackUpdates
    biases: BiasRecords
    ended: EndedTracks
    transitions: TrackTransitions = field(default_factory=lambda: TrackTransitions.concatenate([]))
    duplicates: Duplicates = field(default=NO_DUPLICATES)
    health: HealthRecords = field(default_factory=lambda: HealthRecords.concatenate([]))
    plots: TrackPlots = field(default_factory=lambda: TrackPlots.concatenate([]))
    spread: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, SPREAD_COUNT)))
    pictures: tuple[Picture, ...] = ()
    samples: tuple[StateSample, ...] = ()
    outcomes: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 0), np.int64))
