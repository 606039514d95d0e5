"""Which plot is of which aircraft, where no identity says so: windows, assignment, lives of tracks.

Rows come in windows of data time that are shorter than half a turn of any radar, so that a scan of
a sensor in a window holds an aircraft once. Rows that are known by identity keep their aircraft;
the others of each sensor are assigned to the tracks as they stand when the window begins, so that
the likelihood of the whole is greatest; what is left begins tracks. All of it is a function of the
rows of the window and of those before.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Model, Result, Rows
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking._kernels import identify
from multiradar.tracking.association import sky as skies
from multiradar.tracking.association._association_kernels import find_candidates
from multiradar.tracking.association._sharing_kernels import SHARE_COLUMNS, share_plots
from multiradar.tracking.association._sky_kernels import doubt, fill_sky
from multiradar.tracking.association.clutter import ClutterMap
from multiradar.tracking.association.shared_plots import Shares, sharing_rules
from multiradar.tracking.association.sky import Candidates, Sky
from multiradar.tracking.bearings._bearing_kernels import give_bearings
from multiradar.tracking.input.measurements import KIND_BEARING, MeasurementBatch
from multiradar.tracking.input.order import RELEASE_STEP_S
from multiradar.tracking.lifecycle._lifecycle_kernels import (
    MERGED,
    SHADOW_HITS,
    TRANSITION_COUNT,
    choose_tracks,
    find_ended,
    settle,
)
from multiradar.tracking.lifecycle._merging_kernels import find_merges
from multiradar.tracking.lifecycle.transitions import MERGED as REASON_MERGED
from multiradar.tracking.lifecycle.transitions import Ends
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.roster import RowIdentities
from multiradar.tracking.settings import (
    BY_IDENTITY,
    BY_PROBABILITY,
    TrackingSettings,
)

#: Length of a window, s: a power of two, so that its bounds are exact; short beside a turn. The
#: reorder buffer releases rows by it, so that a window is complete when it comes.
WINDOW_S = RELEASE_STEP_S
#: Turn taken for sensors whose turn is not known, s.
USUAL_TURN_S = 5.0
#: Tracks are compared with each other once in so long, s of data time.
MERGE_STEP_S = 2.0
#: Where plots are shared, so many more such tests two tracks that are two aircraft are left alone.
PATIENCE_TESTS = 26
#: Where plots are shared, hits that a track needs whose first plot could have been of another.
SHADOW_HITS_SHARED = 3
#: Standard deviation of a velocity that was wrong, or jumped, m/s.
ASTRAY_SIGMA_MPS = 60.0
#: What a plot that an address names, not far from its track, adds to the score of the track.
KNOWN_SCORE = 6.0

#: Names of the transitions that are counted, by their place.
TRANSITIONS = ("started", "confirmed", "ended_unconfirmed", "ended_silent", "merged")

Integers = NDArray[np.int64]


class Window(NamedTuple):
    """Rows that are associated together.

    Attributes
    ----------
    batch : MeasurementBatch
        The measurements.
    codes : (n,) int64
        Their Mode 3/A codes.
    rows : Rows
        The same as the filters take them.
    identities : RowIdentities
        Whose they are.
    first, last : int
        Which of them are in the window.
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

    def __init__(self, sensors: SensorTable, settings: TrackingSettings) -> None:
        self._sensors = len(sensors)
        self._associates = settings.association != BY_IDENTITY
        self._shares = settings.association == BY_PROBABILITY
        self._patience = PATIENCE_TESTS if self._shares else 0
        self._shadow_hits = SHADOW_HITS_SHARED if self._shares else SHADOW_HITS
        self._sharing = sharing_rules(sensors, settings)
        self._periods = np.nan_to_num(sensors.rotation_period_s, nan=USUAL_TURN_S)
        self._apart = np.nan_to_num(sensors.rotation_period_s, nan=0.0)
        rules = np.empty(skies.RULE_COUNT)
        rules[skies.SPEED_MAX] = settings.speed_max_mps
        rules[skies.MANOEUVRE] = settings.manoeuvre_sigma_mps2
        rules[skies.ASTRAY] = ASTRAY_SIGMA_MPS
        rules[skies.HITS_MIN] = settings.confirm_updates
        rules[skies.SCORE_MIN] = settings.confirm_score
        rules[skies.DROP_AFTER] = settings.drop_after_s
        self._rules = rules
        self._speed_variance = settings.speed_sigma_mps**2
        self._clutter = ClutterMap(self._periods, settings.clutter_density_per_km2 * 1e-6)
        self._transitions = np.zeros(TRANSITION_COUNT, np.int64)
        self._sky: Sky | None = None
        self._merge_step = 0
        self._anonymous = False
        self._scores = np.empty(0)
        self._shadows = np.empty(0, np.int64)

    @property
    def transitions(self) -> dict[str, int]:
        """How often tracks went from one stage of their lives to another, by reason."""
        return dict(zip(TRANSITIONS, self._transitions.tolist(), strict=True))

    def windows(
        self, batch: MeasurementBatch, first: int, last: int
    ) -> Iterator[tuple[int, int, bool]]:
        """Cut rows into windows; those whose rows are all known by track number stay together.

        Parameters
        ----------
        batch : MeasurementBatch
            The measurements, in the order of their time.
        first, last : int
            Rows to cut.

        Yields
        ------
        tuple
            First and last row, and whether some of them must be associated: a function of the
            rows of the window and of those before, so that it must be asked when they are done.
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

    def end_tracks(self, time_s: float, model: Model, pool: AircraftPool) -> Ends:
        """End tracks before a window: those that are too old, and those that are twice there.

        Parameters
        ----------
        time_s : float
            Begin of the window.
        model : Model
            What all aircraft share.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        Ends
            The tracks that ended, by ascending identifier, and why.
        """
        self._clutter.fade(time_s)
        ended, reasons = np.empty((2, len(pool.roster.track_id)), np.int64)
        count, alive = find_ended(
            time_s, pool.aircraft, pool.roster, pool.life, self._periods, self._rules, ended,
            reasons, self._transitions,
        )  # fmt: skip
        self._anonymous = alive > 0
        gone = pool.end(ended[:count], reasons[:count])
        if math.floor(time_s / MERGE_STEP_S) == self._merge_step:
            return gone
        self._merge_step = math.floor(time_s / MERGE_STEP_S)
        sky, longest = self._fill(time_s, model, pool)
        into = np.empty(len(ended), np.int64)
        count = find_merges(
            time_s, longest, model, pool.aircraft, pool.roster, pool.life, self._periods, sky,
            self._patience, ended, into,
        )  # fmt: skip
        self._transitions[MERGED] += count
        why = np.full(count, REASON_MERGED)
        return gone.and_also(pool.end(ended[:count], why, into[:count]))

    def _fill(self, time_s: float, model: Model, pool: AircraftPool) -> tuple[Sky, float]:
        capacity = len(pool.roster.track_id)
        if self._sky is None or len(self._sky.reach) != capacity:
            self._sky = Sky.empty(capacity)
        longest = fill_sky(
            time_s, model, pool.aircraft, pool.roster, pool.life, self._rules, self._sky
        )
        return self._sky, longest

    def choose(self, window: Window, model: Model, pool: AircraftPool) -> Shares | None:
        """Find the aircraft of the rows of a window, or mark that they begin one.

        Parameters
        ----------
        window : Window
            The rows; their slots are filled.
        model : Model
            What all aircraft share.
        pool : AircraftPool
            The aircraft.

        Returns
        -------
        Shares or None
            Who else may have them, where that is asked for and in doubt.
        """
        batch, codes, rows, identities, first, last = window
        unknown = identify(
            first, last, batch.track_number, batch.mode_s_address, pool.roster, identities
        )
        n = last - first
        self._scores, self._shadows = np.full(n, KNOWN_SCORE), np.zeros(n, np.int64)
        addressed = batch.track_number[first:last] < 0
        if unknown == 0 and not addressed.any():
            return None
        window_time = math.floor(rows.time[first] / WINDOW_S) * WINDOW_S
        sky, _ = self._fill(window_time, model, pool)
        doubted = np.zeros(n, np.int64)
        if unknown < n:
            unknown += doubt(
                first, last, window_time, batch.track_number, rows, model, pool.aircraft, sky,
                identities, doubted,
            )  # fmt: skip
        if unknown == 0:
            return None
        candidates = Candidates.empty(last - first)
        find_candidates(
            first, last, window_time, batch.track_number, batch.mode_s_address, codes, rows, model,
            pool.aircraft, pool.roster, pool.life, self._apart, self._rules,
            self._clutter.log_densities, sky, identities, candidates,
        )  # fmt: skip
        choose_tracks(
            first, last, self._sensors, batch.track_number, batch.mode_s_address, codes, rows,
            self._clutter.log_densities, self._speed_variance, pool.aircraft, pool.life,
            candidates, sky, identities, doubted, self._scores, self._shadows,
        )  # fmt: skip
        if bool((batch.kind[first:last] == KIND_BEARING).any()):
            give_bearings(
                first, last, window_time, batch.track_number, batch.mode_s_address, codes, rows,
                model, pool.aircraft, pool.roster, pool.life, self._rules, sky, identities,
            )  # fmt: skip
        return self._share(window, model, candidates, pool) if self._shares else None

    def _share(
        self, window: Window, model: Model, candidates: Candidates, pool: AircraftPool
    ) -> Shares | None:
        sky, rows, first = self._sky, window.rows, window.first
        assert sky is not None
        window_time = math.floor(rows.time[first] / WINDOW_S) * WINDOW_S
        pairs = int(np.maximum(candidates.number, 0).sum())
        table = np.empty((3 * pairs, SHARE_COLUMNS))
        count = share_plots(
            first, self._sensors, window_time, self._sharing, self._rules,
            self._clutter.log_densities, rows, model, candidates, sky, window.identities.slot,
            pool.life, pool.aircraft, table,
        )  # fmt: skip
        return Shares.of(table[:count]) if count else None

    def settle(
        self, window: Window, result: Result, pool: AircraftPool, confirmed: Integers
    ) -> None:
        """Let the tracks live on with what became of the rows of a window.

        Parameters
        ----------
        window : Window
            The rows, their slots filled.
        result : Result
            What the filter made of them.
        pool : AircraftPool
            The aircraft.
        confirmed : (n,) int64
            Gets whether the track is confirmed, for rows of tracks that are not known by identity.
        """
        _, _, rows, identities, first, last = window
        settle(
            first, last, rows, result, self._periods, self._rules, self._clutter.log_densities,
            self._clutter.log_usual, self._shadow_hits, self._clutter.counts, pool.life,
            identities, self._scores, self._shadows, confirmed, self._transitions,
        )  # fmt: skip
        self._anonymous = True
