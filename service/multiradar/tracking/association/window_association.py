"""Association of plots without identity: windows, assignment, track lifecycles.

Rows are processed in windows of data time shorter than half a scan of any radar, so that a window
contains at most one plot of an aircraft by each sensor. Rows with a known identity keep their
aircraft. The others of each sensor are assigned to the tracks, predicted to the start of the
window, so that the total likelihood is greatest; unassigned rows initiate tracks. The result
depends on the rows of the window and earlier ones alone.
"""

import math
from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NO_ROOM_SLOT
from multiradar.estimation.filters.arrays import Model, Result, Rows
from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields
from multiradar.tracking._identity_kernels import identify
from multiradar.tracking.association import track_grid
from multiradar.tracking.association._association_kernels import find_candidates
from multiradar.tracking.association._bearing_kernels import assign_bearings
from multiradar.tracking.association._grid_kernels import fill_grid, release_distant
from multiradar.tracking.association._initiation_kernels import assign_or_initiate
from multiradar.tracking.association._lifecycle_kernels import (
    SHADOW_HITS,
    find_dropped,
    update_lifecycles,
)
from multiradar.tracking.association._merging_kernels import find_merges
from multiradar.tracking.association._revolution_kernels import (
    drop_second_azimuths,
    reject_second_azimuths,
)
from multiradar.tracking.association._sharing_kernels import SHARE_COLUMNS, share_plots
from multiradar.tracking.association.clutter import ClutterMap
from multiradar.tracking.association.shared_plots import Shares, sharing_rules
from multiradar.tracking.association.track_grid import Candidates, Gating, RowScores, TrackGrid
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.input.order import RELEASE_STEP_S
from multiradar.tracking.lifecycle.transitions import MERGED, TerminatedTracks
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import MISSING, ReportedIdentities, RowIdentities
from multiradar.tracking.settings import (
    BY_IDENTITY,
    BY_PROBABILITY,
    DEFAULT_PERIOD_S,
    TrackingSettings,
)

#: Length of a window, s: a power of two, so that its bounds are exact; short beside a scan. The
#: reorder buffer releases rows in steps of it, so that every window is complete.
WINDOW_S = RELEASE_STEP_S
#: Data time between two searches for duplicate tracks, s.
MERGE_STEP_S = 2.0
#: Additional tests before merging for tracks that were two aircraft, with probabilistic
#: association.
PATIENCE_TESTS = 26
#: Hits needed to confirm a track whose first plot may belong to another, with probabilistic
#: association.
SHADOW_HITS_SHARED = 3
#: Standard deviation of a wrong or changed velocity, m/s.
VELOCITY_ERROR_MPS = 60.0
#: Score of a plot assigned by address and close to its track.
KNOWN_SCORE = 6.0

Integers = NDArray[np.int64]


class AssociationWindow(NamedTuple):
    """Rows associated together.

    Attributes
    ----------
    batch : MeasurementBatch
        The measurements.
    codes : (n,) int64
        Their Mode 3/A codes.
    rows : Rows
        The same in the form of the filters.
    identities : RowIdentities
        Aircraft of the rows.
    first, last : int
        Rows of the window.
    """

    batch: MeasurementBatch
    codes: Integers
    rows: Rows
    identities: RowIdentities
    first: int
    last: int


class Association:
    """Assigns rows without identity; owned by the engine.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        The settings of the tracker.
    """

    STATE: ClassVar[Fields] = {
        "_clutter": ClutterMap,
        "_merge_step": int,
        "_anonymous": bool,
    }

    def __init__(self, sensors: SensorTable, settings: TrackingSettings) -> None:
        self._sensors = len(sensors)
        self._associates = settings.association != BY_IDENTITY
        self._shares = settings.association == BY_PROBABILITY
        self._patience = PATIENCE_TESTS if self._shares else 0
        self._shadow_hits = SHADOW_HITS_SHARED if self._shares else SHADOW_HITS
        self._sharing = sharing_rules(sensors, settings)
        self._periods = np.nan_to_num(sensors.rotation_period_s, nan=DEFAULT_PERIOD_S)
        self._apart = np.nan_to_num(sensors.rotation_period_s, nan=0.0)
        rules = np.empty(track_grid.RULE_COUNT)
        rules[track_grid.SPEED_MAX] = settings.speed_max_mps
        rules[track_grid.MANOEUVRE] = settings.manoeuvre_sigma_mps2
        rules[track_grid.VELOCITY_ERROR] = VELOCITY_ERROR_MPS
        rules[track_grid.HITS_MIN] = settings.confirm_updates
        rules[track_grid.SCORE_MIN] = settings.confirm_score
        rules[track_grid.DROP_AFTER] = settings.drop_after_s
        self._rules = rules
        self._speed_variance = settings.speed_sigma_mps**2
        self._clutter = ClutterMap(self._periods, settings.clutter_density_per_km2 * 1e-6)
        self._grid: TrackGrid | None = None
        self._merge_step = 0
        self._anonymous = False
        self._scores = RowScores.of(0, KNOWN_SCORE)

    def windows(
        self, batch: MeasurementBatch, first: int, last: int
    ) -> Iterator[tuple[int, int, bool]]:
        """Divide rows into windows; those with track numbers throughout stay together.

        Parameters
        ----------
        batch : MeasurementBatch
            The measurements, in the order of their time.
        first, last : int
            Rows to divide.

        Yields
        ------
        tuple
            First and last row, and whether some of them must be associated. This depends on the
            previous windows, so the next item is valid only after they were processed.
        """
        if not self._associates:
            yield first, last, False
            return
        window = np.floor(batch.time_s[first:last] / WINDOW_S)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(window)) + 1])
        nameless = np.logical_or.reduceat(batch.track_number[first:last] < 0, starts)
        ends = [*(first + starts[1:]).tolist(), last]
        waiting = first
        for start, end, without in zip(
            (first + starts).tolist(), ends, nameless.tolist(), strict=True
        ):
            if not (without or self._anonymous):
                continue
            if waiting < start:
                yield waiting, start, False
            yield start, end, True
            waiting = end
        if waiting < last:
            yield waiting, last, False

    def drop_tracks(self, time_s: float, model: Model, pool: AircraftPool) -> TerminatedTracks:
        """Terminate tracks before a window: those not updated for too long, and duplicates.

        Parameters
        ----------
        time_s : float
            Start of the window.
        model : Model
            Model common to all aircraft.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        TerminatedTracks
            The terminated tracks, by ascending identifier, with reasons.
        """
        self._clutter.fade(time_s)
        ended, reasons = np.empty((2, len(pool.roster.track_id)), np.int64)
        count, alive = find_dropped(
            time_s, pool.aircraft, pool.roster, pool.life, self._periods, self._rules, ended,
            reasons,
        )  # fmt: skip
        self._anonymous = alive > 0
        gone = pool.terminate(ended[:count], reasons[:count])
        if math.floor(time_s / MERGE_STEP_S) == self._merge_step:
            return gone
        self._merge_step = math.floor(time_s / MERGE_STEP_S)
        grid, longest = self._fill(time_s, model, pool)
        into = np.empty(len(ended), np.int64)
        count = find_merges(
            time_s, longest, model, pool.aircraft, pool.roster, pool.life, self._periods, grid,
            self._patience, ended, into,
        )  # fmt: skip
        why = np.full(count, MERGED)
        return gone.and_also(pool.terminate(ended[:count], why, into[:count]))

    def _fill(self, time_s: float, model: Model, pool: AircraftPool) -> tuple[TrackGrid, float]:
        capacity = len(pool.roster.track_id)
        if self._grid is None or len(self._grid.reach) != capacity:
            self._grid = TrackGrid.empty(capacity)
        longest = fill_grid(
            time_s, model, pool.aircraft, pool.roster, pool.life, self._rules, self._grid
        )
        return self._grid, longest

    def associate(
        self, window: AssociationWindow, model: Model, pool: AircraftPool
    ) -> Shares | None:
        """Assign the rows of a window to aircraft, or mark that they initiate one.

        Parameters
        ----------
        window : AssociationWindow
            The rows; their slots are filled.
        model : Model
            Model common to all aircraft.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        Shares or None
            Shares of plots between tracks, where requested and ambiguous.
        """
        batch, codes, rows, identities, first, last = window
        unknown = identify(
            first, last, batch.track_number, batch.mode_s_address, pool.roster, identities
        )
        n = last - first
        self._scores = RowScores.of(n, KNOWN_SCORE)
        addressed = batch.track_number[first:last] < 0
        if unknown == 0 and not addressed.any():
            return None
        unknown -= _leave_out(window, pool)
        window_time = math.floor(rows.time[first] / WINDOW_S) * WINDOW_S
        grid, _ = self._fill(window_time, model, pool)
        if unknown < n:
            unknown += release_distant(
                first, last, window_time, batch.track_number, rows, model, pool.aircraft, grid,
                identities, self._scores.released,
            )  # fmt: skip
            # Of the rows near the track that their address names.
            reject_second_azimuths(
                first, last, window_time, batch.track_number, rows, model, self._apart, grid,
                pool.life, identities,
            )  # fmt: skip
        if unknown == 0:
            return None
        candidates = Candidates.empty(last - first)
        reported = ReportedIdentities(batch.track_number, batch.mode_s_address, codes)
        find_candidates(
            first, last, window_time, reported, rows, model, pool.aircraft, pool.roster, pool.life,
            Gating(self._apart, self._rules, self._clutter.log_densities), grid, identities,
            candidates,
        )  # fmt: skip
        if unknown < n:
            drop_second_azimuths(first, rows, self._apart, grid, identities, candidates)
        assign_or_initiate(
            first, last, self._sensors, reported, rows, self._clutter.log_densities,
            self._speed_variance, pool.aircraft, pool.life, candidates, grid, identities,
            self._scores,
        )  # fmt: skip
        if bool((batch.kind[first:last] == KIND_BEARING).any()):
            assign_bearings(
                first, last, window_time, reported, rows, model, pool.aircraft, pool.roster,
                pool.life, self._rules, grid, identities,
            )  # fmt: skip
        return self._share(window, model, candidates, pool) if self._shares else None

    def _share(
        self, window: AssociationWindow, model: Model, candidates: Candidates, pool: AircraftPool
    ) -> Shares | None:
        grid, rows, first = self._grid, window.rows, window.first
        assert grid is not None
        window_time = math.floor(rows.time[first] / WINDOW_S) * WINDOW_S
        pairs = int(np.maximum(candidates.number, 0).sum())
        table = np.empty((3 * pairs, SHARE_COLUMNS))
        count = share_plots(
            first, self._sensors, window_time, self._sharing, self._rules,
            self._clutter.log_densities, rows, model, candidates, grid, window.identities.slot,
            pool.life, pool.aircraft, table,
        )  # fmt: skip
        return Shares.of(table[:count]) if count else None

    def update_lifecycles(
        self, window: AssociationWindow, result: Result, pool: AircraftPool, confirmed: Integers
    ) -> None:
        """Update the lifecycles of tracks with the outcomes of a window.

        Parameters
        ----------
        window : AssociationWindow
            The rows, their slots filled.
        result : Result
            Outcomes of the filter.
        pool : AircraftPool
            The aircraft.
        confirmed : (n,) int64
            Receives whether the track is confirmed, for rows of tracks without identity.
        """
        _, _, rows, identities, first, last = window
        update_lifecycles(
            first, last, rows, result,
            Gating(self._periods, self._rules, self._clutter.log_densities),
            self._clutter.log_usual, self._shadow_hits, self._clutter.counts, pool.life,
            identities, self._scores, confirmed,
        )  # fmt: skip
        self._anonymous = True


def _leave_out(window: AssociationWindow, pool: AircraftPool) -> int:
    """Mark the rows of unknown aircraft by sensors that may initiate no track; return how many.

    A storm of new identities would otherwise be compared with all tracks.
    """
    saturated = pool.new_tracks.saturated
    if not saturated.any():
        return 0
    rows = slice(window.first, window.last)
    batch, slot = window.batch, window.identities.slot[rows]
    named = (batch.track_number[rows] >= 0) | (batch.mode_s_address[rows] >= 0)
    left_out = (slot == MISSING) & named & saturated[batch.sensor[rows]]
    slot[left_out] = NO_ROOM_SLOT
    return int(np.count_nonzero(left_out))
