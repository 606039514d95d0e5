"""The ways in which aircraft may be taken to go on; which of them fits, the traffic tells."""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.forecast.forecast import densities_of, forecast_modes_of, forecast_of_modes
from multiradar.tracking.forecast.persistent_walk import straight_on, walked
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

MODES = "modes"
STRAIGHT = "straight"
#: Rates at which the expected velocity fades where the heading walks at random, 1/s: from one who
#: keeps his heading for an hour to one who turns all the time.
WALKS_PER_S = {
    "walk-3000": 1.0 / 3000.0,
    "walk-1000": 1.0 / 1000.0,
    "walk-300": 1.0 / 300.0,
    "walk-100": 1.0 / 100.0,
}
#: All motions that some filter has.
MOTIONS = (MODES, STRAIGHT, *WALKS_PER_S)
#: White acceleration beside the walk, m²/s³.
WALK_DENSITY = 1.0


class ForecastFamily:
    """The motions by which tracks of a filter are forecast.

    Parameters
    ----------
    settings : TrackingSettings
        How the filter takes aircraft to move.
    keeps_modes : bool
        Whether the filter has modes of motion.

    Attributes
    ----------
    names : tuple of str
        What the motions are called.
    first : int
        Which of them is taken while nothing is known of the traffic: straight on.
    """

    def __init__(self, settings: TrackingSettings, *, keeps_modes: bool) -> None:
        self._settings = settings
        self._modes = forecast_modes_of(settings) if keeps_modes else None
        first = (MODES, STRAIGHT) if keeps_modes else (STRAIGHT,)
        self.names = (*first, *WALKS_PER_S)
        self.first = self.names.index(STRAIGHT)

    def forecast(self, motion: int, states: TrackStates, ahead_s: Floats) -> tuple[Floats, Floats]:
        """Propagate the positions of tracks.

        Parameters
        ----------
        motion : int
            Which of `names`.
        states : TrackStates
            Of n tracks.
        ahead_s : (k,) or (n, k) ndarray
            Times after the states, s, not negative, ascending; the same for all, or those of each.

        Returns
        -------
        means : (n, k, 2) ndarray
            East and north, m.
        covariances : (n, k, 2, 2) ndarray
            m².
        """
        name = self.names[motion]
        if name in WALKS_PER_S:
            rate = WALKS_PER_S[name]
            return walked(states.mean, states.covariance, rate, WALK_DENSITY, ahead_s)
        if name == STRAIGHT:
            densities = densities_of(self._settings, states.mean[:, 2:])
            return straight_on(states.mean, states.covariance, densities, ahead_s)
        means, covariances = self._by_modes(states.modes, ahead_s)
        return means[..., :2], covariances

    def courses(self, motion: int, states: TrackStates, ahead_s: Floats) -> tuple[Floats, Floats]:
        """Do as `forecast`, with the velocities too: means (n, k, 4), m and m/s."""
        name = self.names[motion]
        if name == MODES:
            return self._by_modes(states.modes, ahead_s)
        means, covariances = self.forecast(motion, states, ahead_s)
        fading = np.exp(-WALKS_PER_S.get(name, 0.0) * ahead_s)
        rates = np.broadcast_to(fading[..., None] * states.mean[:, None, 2:], means.shape)
        return np.concatenate([means, rates], axis=-1), covariances

    def careful_covariances(self, means: Floats, states: TrackStates, ahead_s: Floats) -> Floats:
        """Return how far from forecasts aircraft are that turn all the time.

        Parameters
        ----------
        means : (n, k, 2) ndarray
            The forecasts: east and north, m.
        states : TrackStates
            Of n tracks.
        ahead_s : (k,) ndarray
            Times after the states, s.

        Returns
        -------
        (n, k, 2, 2) ndarray
            Second moments about `means` of the walk that fades fastest, m².
        """
        there, covariances = self.forecast(len(self.names) - 1, states, ahead_s)
        apart = there - means
        return np.asarray(covariances + apart[..., :, None] * apart[..., None, :])

    def own_covariances(
        self, motion: int, states: TrackStates, ahead_s: Floats, found: Floats
    ) -> Floats:
        """Return the covariances by the filter's own motion.

        Parameters
        ----------
        motion : int
            Which of `names` has been propagated.
        states, ahead_s : TrackStates, (n, k) ndarray
            As for `forecast`.
        found : (n, k, 2, 2) ndarray
            What came of it, m².

        Returns
        -------
        (n, k, 2, 2) ndarray
            Of the modes where the filter has such, else of straight flight, m².
        """
        return found if motion == 0 else self.forecast(0, states, ahead_s)[1]

    def forecast_all(self, states: TrackStates, ahead_s: Floats) -> tuple[Floats, Floats]:
        """Propagate the positions of tracks by every motion: (j, n, k, 2) and (j, n, k, 2, 2)."""
        found = [self.forecast(motion, states, ahead_s) for motion in range(len(self.names))]
        return np.stack([one for one, _ in found]), np.stack([one for _, one in found])

    def _by_modes(self, modes: ModeStates | None, ahead_s: Floats) -> tuple[Floats, Floats]:
        assert modes is not None
        assert self._modes is not None
        table = self._modes
        count = len(modes.probability)
        times_s = np.broadcast_to(ahead_s, (count, np.shape(ahead_s)[-1]))
        means, covariances = np.empty((*times_s.shape, 4)), np.empty((*times_s.shape, 2, 2))
        known = zip(modes.probability, modes.mean, modes.covariance, strict=True)
        for row, one in enumerate(known):
            means[row], whole = forecast_of_modes(*one, table, times_s[row])
            covariances[row] = whole[:, :2, :2]
        return means, covariances
