"""A bundle of trajectories of one aircraft: a multiple-hypothesis trajectory set, plot by plot.

Each track is a motion of piecewise constant accelerations whose parameters, including the switching
times, fit plots and priors best; its weight is the probability of the plots given the track. See
docs/howto/restoration.md.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import RestorationError, TimeOrderError
from multiradar.estimation.array_checks import finite_array
from multiradar.restoration.bundle._bundle_kernels import push_plot
from multiradar.restoration.bundle.arguments import checked_settings
from multiradar.restoration.bundle.estimate import (
    BEST,
    WEIGHTED,
    Estimate,
    Trajectory,
    velocity_states,
)
from multiradar.restoration.bundle.final_states import FinalStates, final_states_of
from multiradar.restoration.bundle.initial_arcs import TRIPLE_APART_M, TRIPLE_APART_S
from multiradar.restoration.bundle.initial_tracks import first_tracks
from multiradar.restoration.bundle.manoeuvre_history import (
    DECIDED_AFTER_S,
    RECORDED_EVERY_S,
    ManoeuvreHistory,
)
from multiradar.restoration.bundle.path import FitWindow, Path, path_of
from multiradar.restoration.bundle.track_loss import LossTest, fits_none, is_likelier, lost_since
from multiradar.restoration.control_tracks import _layout as layout
from multiradar.restoration.control_tracks._scratch import Scratch, scratch
from multiradar.restoration.control_tracks._thinning_kernels import trace
from multiradar.restoration.control_tracks.plot_rows import plot_row
from multiradar.restoration.control_tracks.reading import control_track_of, kinds_at, segments_of
from multiradar.restoration.control_tracks.settings import KIND_NAMES, BundleSettings
from multiradar.restoration.control_tracks.tracks import GeometricTrack, MeasurementTrack

Floats = NDArray[np.float64]

#: Multiples of the initial window, tried until it contains an arc: for slow aircraft and radars
#: with long scan periods.
_WIDER = (1.0, 1.5, 2.0, 3.0)
#: Time between attempts to re-initialise, s.
_PATIENCE_S = 8.0


class Bundle:
    """Weighted trajectories of one aircraft; plots are pushed one at a time, in order.

    Parameters
    ----------
    settings : BundleSettings, optional
        Parameters of the bundle; by default those of `BundleSettings()`.
    memory : Scratch, optional
        Scratch arrays, as for `use`; its own by default.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2. The project's own: priors, the weight by Laplace's
    method, least squares in place of the search of section 2.5.
    """

    def __init__(
        self, settings: BundleSettings | None = None, memory: Scratch | None = None
    ) -> None:
        self._settings = settings = checked_settings(settings)
        self._kinds, self._rules = settings.kinds(), settings.rules()
        self._tracks = np.zeros((layout.CANDIDATES_MAX, layout.TRACK_COUNT))
        self._plots = np.zeros((2 * layout.INITIAL_PLOTS_MAX, layout.PLOT_COUNT))
        self.use(memory or scratch(settings))
        # The window is the rows first … last − 1; the anchor of the tracks is the time of the last
        # plot that left it, or of the first plot.
        self._first = self._last = self._live = 0
        self._anchor_s = np.nan
        self._restarts = 0
        self._tried_s = -np.inf
        self._manoeuvre_history = ManoeuvreHistory()

    def __len__(self) -> int:
        """Return the number of tracks: 0 before the first triple of plots that forms an arc."""
        return self._live

    @property
    def restarts(self) -> int:
        """Number of re-initialisations after a track loss."""
        return self._restarts

    @property
    def manoeuvre_history(self) -> ManoeuvreHistory:
        """Times of straight flight and of manoeuvres so far."""
        return self._manoeuvre_history

    @property
    def plots(self) -> int:
        """Number of plots in the window."""
        return self._last - self._first

    @property
    def window_s(self) -> tuple[float, float]:
        """Start of the reconstructed path, and time of the last plot.

        Raises
        ------
        RestorationError
            If there are no tracks.

        References
        ----------
        IMM UrO RAN report (2016), section 2.1: a sliding window.
        """
        self._require_tracks()
        now_s = self._now_s()
        return max(self._anchor_s, now_s - self._settings.window_s), now_s

    @property
    def plots_s(self) -> Floats:
        """Times of the plots in the window, (n,), ascending."""
        return self._plots[self._first : self._last, layout.TIME].copy()

    def use(self, memory: Scratch) -> None:
        """Use other scratch arrays from now on; the numbers do not depend on them.

        Parameters
        ----------
        memory : Scratch
            Scratch arrays, of `_scratch.scratch(settings)`; bundles that never work concurrently
            may share them, which saves three quarters of the memory.
        """
        self._fit_scratch, self._memory = memory

    def push(
        self,
        time_s: float,
        position_m: ArrayLike,
        covariance_m2: ArrayLike,
        shared_m2: ArrayLike | None = None,
    ) -> None:
        """Process a plot.

        Parameters
        ----------
        time_s : float
            Time of the plot, not before the last one.
        position_m : (2,) array_like
            East and north, corrected for the biases of the radar.
        covariance_m2 : (2, 2) array_like
            Covariance of its errors: noise of the radar, and uncertainty of its biases.
        shared_m2 : (2, 2) array_like, optional
            The part common with other plots, such as that of biases. It does not enter the weights
            of tracks; it is added to the covariance of estimates.

        Raises
        ------
        TimeOrderError
            If it is earlier than the last plot.
        ShapeError
            If a number is not finite.
        CovarianceError
            If a covariance is not valid.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.
        """
        self._append(time_s, position_m, covariance_m2, shared_m2)
        if self._has_gap():
            self._live, self._first = 0, self._last - 1
            self._restarts += 1
        if self._live:
            self._step(float(self._plots[self._last - 2, layout.TIME]))
            self._check_track_loss()
            if self._live:
                self._record_manoeuvres()
        else:
            self._initiate()

    def push_all(self, plots: MeasurementTrack) -> None:
        """Process plots one after the other.

        Parameters
        ----------
        plots : MeasurementTrack
            Not before the last plot.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.
        """
        for row in range(len(plots)):
            self.push(float(plots.time_s[row]), plots.position_m[row], plots.covariance_m2[row])

    def weights(self) -> Floats:
        """Return the probabilities of the tracks.

        Returns
        -------
        (m,) float64
            Probabilities with sum one, the best first.

        Raises
        ------
        RestorationError
            If there are no tracks.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.4.
        """
        self._require_tracks()
        logarithm = self._tracks[: self._live, layout.WEIGHT]
        weight: Floats = np.exp(logarithm - logarithm.max())
        return np.asarray(weight / weight.sum())

    def trajectories(self) -> tuple[Trajectory, ...]:
        """Return all tracks.

        Returns
        -------
        tuple of Trajectory
            The best first.

        Raises
        ------
        RestorationError
            If there are no tracks.

        References
        ----------
        IMM UrO RAN report (2016), section 2.4: control tracks.
        """
        found = []
        for weight, track in zip(self.weights(), self._tracks, strict=False):
            kinds = tuple(KIND_NAMES[int(kind)] for kind in segments_of(track)[:, layout.KIND])
            controls = control_track_of(track, self._anchor_s)
            found.append(Trajectory(float(weight), controls, kinds))
        return tuple(found)

    def restored(self, time_s: ArrayLike, by: str = WEIGHTED) -> GeometricTrack:
        """Return the reconstructed path.

        Parameters
        ----------
        time_s : (k,) array_like
            Ascending times within `window_s`; later ones are extrapolated.
        by : str
            `best`: the best track. `weighted`: the weighted mean of all.

        Returns
        -------
        GeometricTrack
            At these times.

        Raises
        ------
        RestorationError
            If there are no tracks.
        ValueError
            If `by` is neither.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.5.
        """
        times = finite_array(time_s, "geometric track times", (None,))
        weights = self._weights_by(by)
        states = np.zeros((len(weights), len(times), 4))
        for track, state in zip(self._tracks, states, strict=False):
            trace(track, self._anchor_s, times, state)
        mean = np.einsum("i,ikc->kc", weights, velocity_states(states))
        return GeometricTrack(
            times, mean[:, :2], np.hypot(mean[:, 2], mean[:, 3]), np.arctan2(mean[:, 2], mean[:, 3])
        )

    def estimate(self, by: str = WEIGHTED, time_s: float | None = None) -> Estimate:
        """Return the motion at the last plot, or at another time.

        Parameters
        ----------
        by : str
            `best`: that of the best track. `weighted`: the weighted mean of all.
        time_s : float, optional
            Time; that of the last plot by default.

        Returns
        -------
        Estimate
            Motion with accelerations.

        Raises
        ------
        RestorationError
            If there are no tracks.
        ShapeError
            If the time is not finite.
        ValueError
            If `by` is neither.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.5.
        """
        given_s = self._now_s() if time_s is None else time_s
        when = float(finite_array(given_s, "estimation time", ()))
        path = self.path([when], by)
        return Estimate(
            when, path.state[0], path.covariance[0], float(path.lateral_mps2[0]),
            float(path.longitudinal_mps2[0]), path.kind_probability[0],
        )  # fmt: skip

    def path(self, time_s: ArrayLike, by: str = WEIGHTED) -> Path:
        """Return the motion at many times, with covariances.

        Parameters
        ----------
        time_s : (k,) array_like
            Ascending times, as for `restored`.
        by : str
            `best` or `weighted`, as for `estimate`.

        Returns
        -------
        Path
            At these times.

        Raises
        ------
        RestorationError
            If there are no tracks.
        ValueError
            If `by` is neither.

        References
        ----------
        IMM UrO RAN report (2016), section 2.2.5; covariances are the project's own.
        """
        times = finite_array(time_s, "path times", (None,))
        weights = self._weights_by(by)
        return path_of(self._tracks, weights, self._window(), times, self._fit_scratch)

    def final_states(self) -> FinalStates:
        """Return the states of the tracks at the last plot, from which a forecast starts.

        Returns
        -------
        FinalStates
            The best first.

        Raises
        ------
        RestorationError
            If there are no tracks.
        """
        return final_states_of(self._tracks, self.weights(), self._window(), self._fit_scratch)

    def copy(self) -> "Bundle":
        """Return a copy of the bundle, with scratch arrays of its own.

        Returns
        -------
        Bundle
            An independent bundle.
        """
        other = Bundle(self._settings)
        other._live, other._anchor_s = self._live, self._anchor_s
        other._restarts, other._tried_s = self._restarts, self._tried_s
        other._last = self._last - self._first
        other._manoeuvre_history = self._manoeuvre_history
        other._tracks[: self._live] = self._tracks[: self._live]
        other._plots[: other._last] = self._plots[self._first : self._last]
        return other

    def _record_manoeuvres(self) -> None:
        decided_s = self._now_s() - DECIDED_AFTER_S
        due = not decided_s < self._manoeuvre_history.until_s + RECORDED_EVERY_S
        if due and decided_s >= self._anchor_s:
            kinds = kinds_at(self._tracks[: self._live], decided_s)
            straight = self.weights() @ (kinds == layout.STRAIGHT)
            self._manoeuvre_history = self._manoeuvre_history.extended(decided_s, float(straight))

    def _window(self) -> FitWindow:
        plots = self._plots[self._first : self._last]
        return FitWindow(self._anchor_s, plots, self._kinds, self._rules)

    def _now_s(self) -> float:
        return float(self._plots[self._last - 1, layout.TIME])

    def _weights_by(self, by: str) -> Floats:
        if by not in (BEST, WEIGHTED):
            raise ValueError(f"expected {BEST!r} or {WEIGHTED!r}, was {by!r}")
        weights = self.weights()
        return np.ones(1) if by == BEST else weights

    def _require_tracks(self) -> None:
        if not self._live:
            raise RestorationError(
                f"no track: expected three plots {TRIPLE_APART_S:g} s and {TRIPLE_APART_M:g} m "
                f"apart within {self._settings.window_s:g} s, found no such triple among "
                f"{self._last - self._first} plots"
            )

    def _append(
        self, time_s: float, position_m: ArrayLike, covariance_m2: ArrayLike,
        shared_m2: ArrayLike | None,
    ) -> None:  # fmt: skip
        row = plot_row(time_s, position_m, covariance_m2, shared_m2, self._settings)
        if self._last > self._first and row[layout.TIME] < self._now_s():
            raise TimeOrderError("plot time", float(row[layout.TIME]), self._now_s())
        if self._last == len(self._plots):
            kept = self._last - self._first
            self._plots[:kept] = self._plots[self._first : self._last]
            self._first, self._last = 0, kept
        self._plots[self._last] = row
        self._last += 1

    # Initiate with the shortest window of last plots that contains an arc.
    def _initiate(self) -> None:
        rules, times = self._settings, self._plots[: self._last, layout.TIME]
        oldest = int(np.searchsorted(times[self._first :], times[-1] - rules.window_s))
        self._first = max(self._first + oldest, self._last - layout.INITIAL_PLOTS_MAX)
        for factor in _WIDER:
            begin_s = times[-1] - min(factor * rules.initial_s, rules.window_s)
            first = self._first + int(np.searchsorted(times[self._first :], begin_s))
            tracks = first_tracks(self._plots[first : self._last], rules, self._fit_scratch)
            if len(tracks):
                self._adopt(tracks, first)
                return

    # If the last plots are outliers of the best track: re-initialise if likelier, or drop it.
    def _check_track_loss(self) -> None:
        now_s = self._now_s()
        best = LossTest(self._tracks[0], self._anchor_s, self._plots, self._first, self._last)
        first = lost_since(best) if self._live else self._last
        if first == self._last or now_s - self._tried_s < _PATIENCE_S:
            return
        refuted = fits_none(best)
        tracks = first_tracks(self._plots[first : self._last], self._settings, self._fit_scratch)
        if len(tracks):
            self._tried_s = now_s
        if len(tracks) and is_likelier(tracks[0], best, first, refuted=refuted):
            self._adopt(tracks, first)
            self._restarts += 1
        elif refuted:
            self._live, self._first = 0, first
            self._restarts += 1

    # Initial tracks have one segment. They branch in the cells since then, because a turn may have
    # started or ended before initiation.
    def _adopt(self, tracks: Floats, first: int) -> None:
        self._tracks[: len(tracks)] = tracks
        self._live, self._first = len(tracks), first
        self._anchor_s = float(self._plots[first, layout.TIME])
        self._step(self._anchor_s)

    # Process the newest plot; segments may start after `since_s`.
    def _step(self, since_s: float) -> None:
        self._live, self._first, self._anchor_s = push_plot(
            self._tracks, self._live, self._settings.tracks_max, self._anchor_s, self._plots,
            self._first, self._last, since_s, self._kinds, self._rules, self._settings.rounds,
            self._fit_scratch, self._memory,
        )  # fmt: skip

    # Tracks do not survive a gap longer than the window.
    def _has_gap(self) -> bool:
        if not self._live:
            return False
        before_s, now_s = self._plots[self._last - 2 : self._last, layout.TIME]
        return bool(now_s - before_s > self._settings.window_s)
