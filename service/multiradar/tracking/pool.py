"""The aircraft of a service: one slot each in shared arrays, grouped into fixed partitions.

Each aircraft owns its slot, processes its measurements in order, and shares only the published
biases with others. Slots are assigned to `PARTITIONS` partitions; a worker processes whole
partitions, and sums over aircraft are formed partition by partition, so that no result depends on
the number of workers.
"""

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import DELAY_BIASES, Aircraft, Work, partition_of
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.estimation.filters.height._height_kernels import GUESS, GUESS_VARIANCE
from multiradar.state import Fields, fitted
from multiradar.tracking._identity_kernels import assign, rebuild
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, CONFIRMED, Lifecycle
from multiradar.tracking.lifecycle.report_integrity import ReportIntegrity
from multiradar.tracking.lifecycle.transitions import NO_TRACK, TerminatedTracks
from multiradar.tracking.roster import MISSING, NewTracks, Roster, RowIdentities

#: Number of partitions. The output depends on it, so it is no setting.
PARTITIONS = 16
#: Initial number of slots, doubled whenever they are used up, and its maximum.
CAPACITY_FIRST = 256
CAPACITY_MAX = 131_072


class Start(NamedTuple):
    """State with which a track is initiated.

    Attributes
    ----------
    time_s : float
        Of the state.
    mean : (4,) float64
        East, north (m) and their rates (m/s), at bias zero.
    covariance : (4, 4) float64
        Its covariance for known biases.
    sensitivity : (4, c) float64
        Derivative of the mean with respect to the biases.
    height_m : float
        Assumed height.
    height_variance_m2 : float
        Its variance, m².
    measured_from : int
        Number of the site that measured it, `SEVERAL` for several.
    """

    time_s: float
    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    sensitivity: NDArray[np.float64]
    height_m: float
    height_variance_m2: float
    measured_from: int


class AircraftPool:
    """Slots, identities and states of all aircraft; owned by one thread at a time.

    Parameters
    ----------
    definition : FilterDefinition
        Defines the state arrays and the maximum number of aircraft.
    bias_columns : int
        Number of bias parameters, with that of the delay.
    sensors : int
        Number of sensors.
    modes : int
        Number of motion modes.
    compared : int
        Number of sensors compared with ADS-B reports, 0 for none.
    delays : bool
        Whether delays of transponders are estimated.
    tentative_max : (m,) array, optional
        Greatest number of tentative tracks that each sensor may initiate; unbounded by default.
    """

    STATE: ClassVar[Fields] = {
        "roster": Roster,
        "aircraft": Aircraft,
        "life": Lifecycle,
        "new_tracks": NewTracks,
        "integrity": ReportIntegrity,
    }

    def __init__(
        self, definition: FilterDefinition, bias_columns: int, sensors: int, modes: int = 1,
        compared: int = 0, *, delays: bool = False,
        tentative_max: NDArray[np.float64] | None = None,
    ) -> None:  # fmt: skip
        self._definition, self._sizes = definition, (bias_columns, sensors, modes, delays)
        self._capacity_max = definition.aircraft_max or CAPACITY_MAX
        self.roster = Roster.empty(CAPACITY_FIRST)
        self.aircraft = definition.aircraft(CAPACITY_FIRST, *self._sizes)
        self.life = Lifecycle.empty(CAPACITY_FIRST, sensors)
        most = np.full(sensors, CAPACITY_MAX) if tentative_max is None else tentative_max
        self.new_tracks = NewTracks.empty(CAPACITY_FIRST, most.astype(np.int64))
        self._compared = compared
        self.integrity = ReportIntegrity.empty(CAPACITY_FIRST, compared)

    def assign(
        self, batch: MeasurementBatch, codes: NDArray[np.int64], first: int, last: int,
        identities: RowIdentities,
    ) -> None:  # fmt: skip
        """Find or create the aircraft of the rows first…last, in order.

        Parameters
        ----------
        batch : MeasurementBatch
            The measurements.
        codes : (n,) int64
            Their Mode 3/A codes.
        first, last : int
            Which rows.
        identities : RowIdentities
            Filled for these rows.
        """
        while True:
            first = assign(
                first, last, self._full, batch.track_number, batch.mode_s_address, codes,
                batch.callsign, batch.kind, batch.sensor, self.roster, self.new_tracks,
                self.aircraft, self.life, identities,
            )  # fmt: skip
            if first == last:
                return
            self.grow()

    def initiate(self, slot: int, start: Start) -> None:
        """Initiate an aircraft that has a slot but no measurement, from its bearings.

        Parameters
        ----------
        slot : int
            Its slot.
        start : Start
            Its state.
        """
        aircraft = self.aircraft
        aircraft.mean[slot] = start.mean
        aircraft.covariance[slot] = start.covariance[np.triu_indices(4)]
        aircraft.sensitivity[slot] = 0.0
        aircraft.sensitivity[slot, :, : start.sensitivity.shape[1]] = start.sensitivity
        # It has its prior again.
        aircraft.delay[slot] = 0.0
        aircraft.time[slot] = start.time_s
        aircraft.fading_nis[slot] = 1.0
        aircraft.measured_from[slot] = start.measured_from
        aircraft.vertical[slot, GUESS] = start.height_m
        aircraft.vertical[slot, GUESS_VARIANCE] = start.height_variance_m2
        if self._definition.keeps_modes:
            aircraft.mode_probability[slot, 0] = np.nan

    def work(
        self, slots: NDArray[np.int64], rows: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], Work]:
        """Group rows by partition.

        Parameters
        ----------
        slots : (n,) int64
            Slot of each row, negative for none.
        rows : (n,) int64
            Their indices in the batch, ascending.

        Returns
        -------
        used : (w,) int64
            Partitions that have rows.
        work : Work
            The rows, grouped.

        Notes
        -----
        A filter that updates the biases with every row needs all rows in order: it has one
        partition.
        """
        if self._definition.corrects_biases:
            one = np.zeros(1, np.int64)
            bounds = np.array([0, len(slots)], np.int64)
            return one, Work(one, bounds, rows)
        partitions = partition_of(slots, PARTITIONS).astype(np.uint8)
        order = rows[np.argsort(partitions, kind="stable")]
        bounds = np.zeros(PARTITIONS + 1, np.int64)
        np.cumsum(np.bincount(partitions, minlength=PARTITIONS), out=bounds[1:])
        used = np.flatnonzero(np.diff(bounds))
        return used, Work(used, bounds, order)

    @property
    def _full(self) -> bool:
        return len(self.roster.track_id) >= self._capacity_max

    def used(self) -> NDArray[np.intp]:
        """Return the slots that hold an aircraft, ascending."""
        return np.flatnonzero(self.roster.track_id != MISSING)

    def confirmed(self, slots: NDArray[np.intp], updates_min: int) -> NDArray[np.bool_]:
        """Return whether tracks are confirmed.

        Parameters
        ----------
        slots : (n,) int
            Of the tracks.
        updates_min : int
            Updates of a track that is initiated by the identity of its aircraft.
        """
        stage = self.life.stage[slots]
        named = self.aircraft.updates[slots] >= updates_min
        return np.asarray(np.where(stage == BY_IDENTITY, named, stage == CONFIRMED))

    def bias_excluded(self, slots: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return whether measurements of slots (negative: none) are excluded from the biases."""
        bias_excluded: NDArray[np.bool_] = (
            self.life.bias_excluded[slots] != 0
        ) | self.integrity.bias_excluded(slots)
        return bias_excluded & (slots >= 0)

    def bias_contributors(self) -> NDArray[np.intp]:
        """Return the slots of aircraft that contribute to the bias estimate, ascending."""
        used = self.used()
        bias_contributors: NDArray[np.intp] = used[~self.bias_excluded(used)]
        return bias_contributors

    def silent(self, before_s: float) -> NDArray[np.intp]:
        """Return the slots of aircraft without an update since a data time, s, ascending."""
        used = self.used()
        return used[~(self.aircraft.updated[used] >= before_s)]

    def terminate(
        self,
        old: NDArray[np.int64],
        reason: NDArray[np.int64],
        into: NDArray[np.int64] | None = None,
    ) -> TerminatedTracks:
        """Terminate tracks and free their slots.

        Parameters
        ----------
        old : (n,) int64
            Slots that hold an aircraft, ascending.
        reason : (n,) int64
            Reason of each.
        into : (n,) int64, optional
            Slots of the tracks into which they are merged.

        Returns
        -------
        TerminatedTracks
            The terminated tracks, by ascending identifier. An aircraft that was never initiated
            (its first measurement gave no position) is freed without a track.
        """
        if len(old) == 0:
            return TerminatedTracks.empty()
        ids, updated = self.roster.track_id[old], self.aircraft.updated[old]
        other = np.full(len(old), NO_TRACK) if into is None else self.roster.track_id[into]
        started = np.flatnonzero(~np.isnan(updated))
        chosen = started[np.argsort(ids[started])]
        ends = TerminatedTracks(
            old[chosen].astype(np.int64), ids[chosen], updated[chosen], reason[chosen],
            other[chosen],
        )  # fmt: skip
        self._free(old)
        return ends

    def release_confirmed(self, confirmed: NDArray[np.intp]) -> None:
        """No longer count confirmed tracks, by slot, among the tentative ones of their sensors."""
        new = self.new_tracks
        counted = new.sensor[confirmed]
        new.initiated[:] -= np.bincount(counted[counted != MISSING], minlength=len(new.initiated))
        new.sensor[confirmed] = MISSING

    def grow(self) -> None:
        """Double the number of slots; states and identities stay in place."""
        capacity = len(self.roster.track_id)
        roster = Roster.empty(2 * capacity)
        aircraft = self._definition.aircraft(2 * capacity, *self._sizes)
        life = Lifecycle.empty(2 * capacity, self._sizes[1])
        integrity = ReportIntegrity.empty(2 * capacity, self._compared)
        grown, kept = (*aircraft, *life, *integrity), (*self.aircraft, *self.life, *self.integrity)
        for new, old in zip(grown, kept, strict=True):
            new[tuple(slice(size) for size in old.shape)] = old
        for name in ("track_id", "track_number", "mode_s_address", "mode_3a", "callsign"):
            getattr(roster, name)[:capacity] = getattr(self.roster, name)
        # The pool grows only when no slot is free: the free slots are the new ones.
        roster.free[:capacity] = np.arange(2 * capacity - 1, capacity - 1, -1)
        roster.counters[:] = self.roster.counters[0], capacity
        rebuild(roster)
        initiated = np.full(2 * capacity, MISSING, np.int64)
        initiated[:capacity] = self.new_tracks.sensor
        self.new_tracks = self.new_tracks._replace(sensor=initiated)
        self.roster, self.aircraft, self.life, self.integrity = roster, aircraft, life, integrity

    def carry(self, old: "AircraftPool", _change: object) -> None:
        """Continue the aircraft of a pool that has fewer sensors and columns, or as many."""
        while len(self.roster.track_id) < len(old.roster.track_id):
            self.grow()
        most = self.new_tracks.most
        self.roster = old.roster
        self.life = fitted(old.life, self.life)
        self.integrity = fitted(old.integrity, self.integrity)
        self.new_tracks = fitted(old.new_tracks, self.new_tracks)._replace(most=most)
        self._carry_aircraft(old)

    def renumber_sites(self, numbers: NDArray[np.int64]) -> None:
        """Set the sites that measured the aircraft to their present numbers, by the former ones."""
        measured_from = self.aircraft.measured_from
        # Moving sensors have numbers beyond those of the sensors.
        single = (measured_from >= 0) & (measured_from < len(numbers))
        measured_from[single] = numbers[measured_from[single]]

    def _carry_aircraft(self, old: "AircraftPool") -> None:
        before, now = old.aircraft, self.aircraft
        (columns, *_), (wider, _, _, delays) = old._sizes, self._sizes
        # New columns come before that of the delay.
        own = np.arange(columns)
        own[columns - delays :] += wider - columns
        special = {
            "sensitivity": (..., own),
            "mode_sensitivity": (..., own),
            "delay": (..., np.append(np.arange(DELAY_BIASES), DELAY_BIASES + own)),
            "joint": np.ix_(*2 * (np.append(own, wider + np.arange(len(before.joint) - columns)),)),
        }
        for name, array in before._asdict().items():
            place = special.get(name) if array.size else None
            if place is None:
                fitted(array, getattr(now, name))
            else:
                getattr(now, name)[place] = array

    def _free(self, old: NDArray[np.int64]) -> None:
        self.roster.track_id[old] = MISSING
        self.aircraft.time[old] = np.nan
        self.integrity.release(old)
        self.release_confirmed(old)
        count = self.roster.counters[1]
        self.roster.free[count : count + len(old)] = old[::-1]
        self.roster.counters[1] += len(old)
        known = (self.roster.track_number[old] >= 0) | (self.roster.mode_s_address[old] >= 0)
        if known.any():
            rebuild(self.roster)
