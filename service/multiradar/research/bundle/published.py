"""The bundle as published in the report: arcs to every plot, groups, Hooke–Jeeves search.

For comparison with `Bundle`. A track is defined by its segments and the state at the anchor, which
changes in the initial window only. Its weight is the likelihood of the plots of the window alone,
and so longer chains of segments always fit better.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import RestorationError
from multiradar.research.bundle._hooke_jeeves_kernels import search
from multiradar.research.bundle.search_rules import SEGMENT_MIN_S, SearchRules
from multiradar.restoration.bundle._window_kernels import write_information
from multiradar.restoration.bundle.initial_arcs import arcs_through_triples
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._arc_kernels import branch_by_arc, misfit, state_at
from multiradar.restoration.control_tracks._fit_kernels import fit_track
from multiradar.restoration.control_tracks._scratch import fit_scratch
from multiradar.restoration.control_tracks._thinning_kernels import thin, trace
from multiradar.restoration.control_tracks.plot_rows import plot_rows
from multiradar.restoration.control_tracks.reading import control_track_of
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import ControlTrack, MeasurementTrack

Floats = NDArray[np.float64]

# Standard deviations of free and of fixed parameters, in any unit, and maximum iterations.
_UNKNOWN, _HELD, _ROUNDS = 1e3, 1e-4, 50


class PublishedBundle:
    """A bundle over the plots of one window, with the procedures of the report as separate steps.

    Parameters
    ----------
    plots : MeasurementTrack
        All plots; each procedure gets the number of known plots.
    settings : BundleSettings
        Limits, the initial window, the number of tracks, the distance of groups, outliers.

    References
    ----------
    IMM UrO RAN report (2016), sections 2.2 to 2.5.
    """

    def __init__(self, plots: MeasurementTrack, settings: BundleSettings) -> None:
        self._rows = plot_rows(plots, settings)
        self._settings, self._rules = settings, settings.rules()
        self._rules[layout.SEGMENT_MIN_S] = SEGMENT_MIN_S
        self._tracks = np.zeros((0, layout.TRACK_COUNT))
        self._first, self._anchor_s = 0, float(self._rows[0, layout.TIME])

    def __len__(self) -> int:
        """Return the number of tracks."""
        return len(self._tracks)

    def start(self, count: int) -> None:
        """Make the tracks of the initial window, one for each triple of plots with an arc.

        Parameters
        ----------
        count : int
            Number of known plots.

        Raises
        ------
        RestorationError
            If no triple has an arc.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.1.
        """
        known = self._rows[:count]
        arcs = arcs_through_triples(known[:, layout.TIME], known[:, layout.TIME + 1 :][:, :2])
        tracks = np.zeros((len(arcs), layout.TRACK_COUNT))
        states = np.empty((1, 4))
        for arc, track in zip(arcs, tracks, strict=True):
            track[layout.COUNT] = 1.0
            state = (arc.east_m, arc.north_m, arc.speed_mps, arc.heading_rad)
            track[layout.EAST : layout.HEADING + 1] = state
            track[layout.SEGMENTS + layout.LATERAL] = arc.lateral_mps2
            trace(track, arc.time_s, np.array([self._anchor_s]), states)
            track[layout.EAST : layout.HEADING + 1] = states[0]
        allowed = np.abs(tracks[:, layout.SEGMENTS + layout.LATERAL]) <= self._rules[
            layout.LATERAL_MAX
        ]  # fmt: skip
        if not allowed.any():
            raise RestorationError(
                f"no three of the {count} plots can be joined by an arc within the lateral "
                "acceleration limit"
            )
        # Sorted by deviation: the best are enough for thinning.
        self._tracks = tracks[allowed][: layout.CANDIDATES_MAX]

    def branch(self, count: int) -> None:
        """Add to each track its best branch to the newest plot.

        Parameters
        ----------
        count : int
            Number of known plots; the newest is the last of them.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.2 and figure 2.1.
        """
        self._slide(count)
        spare, a, b = np.empty(layout.TRACK_COUNT), np.empty(4), np.empty(4)
        branches = []
        for track in self._tracks:
            best = track.copy()
            found = branch_by_arc(
                track,
                best,
                spare,
                self._anchor_s,
                self._rows,
                self._first,
                count,
                self._rules,
                a,
                b,
            )
            if np.isfinite(found):
                branches.append(best)
        self._tracks = np.array([*self._tracks, *branches])

    def thin(self, count: int, *, grouped: bool = True) -> None:
        """Keep the best track of each group of close tracks, and of these the best.

        Parameters
        ----------
        count : int
            Number of known plots.
        grouped : bool
            False keeps the best by weight alone, which the report rejects.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.3.
        """
        self._weigh(count)
        last_s = float(self._rows[count - 1, layout.TIME])
        grid = np.arange(np.ceil(self._anchor_s), np.floor(last_s) + 1.0)
        traces = np.zeros((len(self), len(grid), 4))
        for track, states in zip(self._tracks, traces, strict=True):
            trace(track, self._anchor_s, grid, states)
        kept = np.zeros(len(self), np.int64)
        stay = thin(
            self._tracks, len(self), self._settings.tracks_max, traces, len(grid),
            self._settings.apart_m if grouped else 0.0, np.zeros(len(self), np.int64), kept,
            -1,
        )  # fmt: skip
        self._tracks = self._tracks[kept[:stay]].copy()

    def optimise(self, count: int, rules: SearchRules | None = None) -> int:
        """Improve each track by the Hooke–Jeeves search.

        Parameters
        ----------
        count : int
            Number of known plots.
        rules : SearchRules, optional
            Those of the report if not given.

        Returns
        -------
        int
            Number of evaluations of the functional.

        References
        ----------
        IMM UrO RAN report (2016), section 2.5.
        """
        chosen = rules or SearchRules()
        rows = self._rows[:count].copy()
        rows[-1, layout.EAST_EAST : layout.NORTH_NORTH + 1] *= chosen.last_plot
        if chosen.dimples:
            # −ln(e^(−ρ²/2) + 1): an outlier is as likely as a good plot at best.
            rows[:, layout.FLOOR] = 0.0
        limits = np.array(
            [
                self._settings.lateral_max_mps2, self._settings.longitudinal_max_mps2,
                SEGMENT_MIN_S, chosen.last_segment_s,
            ]
        )  # fmt: skip
        evaluations, total = np.zeros(1), 0
        for track in self._tracks:
            search(
                track, track.copy(), track.copy(), self._anchor_s, rows, self._first, count,
                limits, evaluations,
            )  # fmt: skip
            total += int(evaluations[0])
        return total

    def fit_least_squares(self, count: int) -> None:
        """Improve each track by bounded least squares, with the same functional and parameters.

        Parameters
        ----------
        count : int
            Number of known plots.

        References
        ----------
        IMM UrO RAN report (2016), section 2.5, for the parameters; the method is the project's own.
        """
        memory = fit_scratch()
        kinds = np.zeros((layout.KINDS, layout.KIND_COUNT))
        kinds[:, [layout.LATERAL_SIGMA, layout.LONGITUDINAL_SIGMA]] = _UNKNOWN
        kinds[:, layout.ENDING] = 1.0
        rules = self._rules.copy()
        rules[layout.CELL_SIGMA_S] = _UNKNOWN
        # The state at the anchor is fixed by its prior.
        sigmas = np.array([_HELD] * 4 + [_UNKNOWN] * 2)
        now_s = float(self._rows[count - 1, layout.TIME])
        for track in self._tracks:
            track[layout.PRIOR_MEAN : layout.PRIOR_MEAN + 4] = track[layout.EAST :][:4]
            covariance = np.diag(sigmas**2).ravel()
            track[layout.PRIOR_COVARIANCE : layout.PRIOR_COVARIANCE + 36] = covariance
            write_information(track, memory.H, memory.H2)
            fit_track(
                track, self._anchor_s, self._rows, self._first, count, now_s, kinds, rules, _ROUNDS,
                memory,
            )  # fmt: skip

    def misfits(self, count: int) -> Floats:
        """Return the functional of each track: −ln of the likelihood of the plots.

        Parameters
        ----------
        count : int
            Number of known plots.

        Returns
        -------
        (k,) ndarray
            Without terms that do not depend on the track.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.4.
        """
        return np.array(
            [
                misfit(track, self._anchor_s, self._rows, self._first, count)
                for track in self._tracks
            ]
        )

    def controls(self) -> tuple[ControlTrack, ...]:
        """Return the tracks.

        Returns
        -------
        tuple of ControlTrack
            One per track.

        References
        ----------
        IMM UrO RAN report (2016), section 2.4.
        """
        return tuple(control_track_of(track, self._anchor_s) for track in self._tracks)

    def ends(self, count: int) -> Floats:
        """Return the positions of the tracks at the newest plot.

        Parameters
        ----------
        count : int
            Number of known plots.

        Returns
        -------
        (k, 2) ndarray
            East and north, m.

        References
        ----------
        IMM UrO RAN report (2016), section 2.7.2: the ends of the tracks after the search.
        """
        now_s, state = float(self._rows[count - 1, layout.TIME]), np.empty(4)
        found = np.empty((len(self), 2))
        for track, end in zip(self._tracks, found, strict=True):
            state_at(track, self._anchor_s, now_s, state)
            end[:] = state[:2]
        return found

    # The window starts with its first plot; tracks are re-anchored there.
    def _slide(self, count: int) -> None:
        times = self._rows[:count, layout.TIME]
        self._first = int(np.searchsorted(times, times[-1] - self._settings.window_s))
        begin_s, state = float(times[self._first]), np.empty(4)
        for track in self._tracks:
            segment = state_at(track, self._anchor_s, begin_s, state)
            track[layout.EAST : layout.HEADING + 1] = state
            gone = layout.SEGMENT_COUNT * segment
            kept = track[layout.SEGMENTS + gone : layout.PRIOR_MEAN].copy()
            track[layout.SEGMENTS : layout.SEGMENTS + len(kept)] = kept
            track[layout.COUNT] -= segment
        self._anchor_s = begin_s

    def _weigh(self, count: int) -> None:
        self._tracks[:, layout.MERGED_WEIGHT] = 0.0
        self._tracks[:, layout.WEIGHT] = -self.misfits(count)
