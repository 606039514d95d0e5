"""Candidate motion models of forecasts; past errors select one of them."""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.forecast.forecast_of_modes import (
    densities_of,
    forecast_modes_of,
    forecast_of_modes,
)
from multiradar.tracking.forecast.persistent_walk import propagate_random_walk, propagate_straight
from multiradar.tracking.mode_states import ModeStates
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

MODES = "modes"
STRAIGHT = "straight"
#: Fading rates of the mean velocity with a random-walk heading, 1/s: from a constant heading for an
#: hour to permanent turns.
WALKS_PER_S = {
    "walk-3000": 1.0 / 3000.0,
    "walk-1000": 1.0 / 1000.0,
    "walk-300": 1.0 / 300.0,
    "walk-100": 1.0 / 100.0,
}
#: White acceleration in addition to the random walk, m²/s³.
WALK_DENSITY = 1.0


class ForecastFamily:
    """Motion models for forecasts of the tracks of a filter.

    Parameters
    ----------
    settings : TrackingSettings
        Motion model of the filter.
    keeps_modes : bool
        Whether the filter has motion modes.

    Attributes
    ----------
    names : tuple of str
        Names of the motion models.
    first : int
        Index of the default model, used before any errors are known: straight flight.
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
            Index in `names`.
        states : TrackStates
            States of n tracks.
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
            return propagate_random_walk(
                states.mean, states.covariance, rate, WALK_DENSITY, ahead_s
            )
        if name == STRAIGHT:
            densities = densities_of(self._settings, states.mean[:, 2:])
            return propagate_straight(states.mean, states.covariance, densities, ahead_s)
        means, covariances = self._by_modes(states.modes, ahead_s)
        return means[..., :2], covariances

    def paths(self, motion: int, states: TrackStates, ahead_s: Floats) -> tuple[Floats, Floats]:
        """As `forecast`, with velocities: means (n, k, 4), m and m/s."""
        name = self.names[motion]
        if name == MODES:
            return self._by_modes(states.modes, ahead_s)
        means, covariances = self.forecast(motion, states, ahead_s)
        fading = np.exp(-WALKS_PER_S.get(name, 0.0) * ahead_s)
        rates = np.broadcast_to(fading[..., None] * states.mean[:, None, 2:], means.shape)
        return np.concatenate([means, rates], axis=-1), covariances

    def worst_case_covariances(self, means: Floats, states: TrackStates, ahead_s: Floats) -> Floats:
        """Return covariances for aircraft that may turn all the time.

        Parameters
        ----------
        means : (n, k, 2) ndarray
            The forecasts: east and north, m.
        states : TrackStates
            States of n tracks.
        ahead_s : (k,) ndarray
            Times after the states, s.

        Returns
        -------
        (n, k, 2, 2) ndarray
            Second moments about `means` of the random walk that fades fastest, m².
        """
        there, covariances = self.forecast(len(self.names) - 1, states, ahead_s)
        apart = there - means
        return np.asarray(covariances + apart[..., :, None] * apart[..., None, :])

    def own_covariances(
        self, motion: int, states: TrackStates, ahead_s: Floats, found: Floats
    ) -> Floats:
        """Return the covariances by the filter's own motion model.

        Parameters
        ----------
        motion : int
            Index in `names` of the model that was propagated.
        states, ahead_s : TrackStates, (n, k) ndarray
            As for `forecast`.
        found : (n, k, 2, 2) ndarray
            Its covariances, m².

        Returns
        -------
        (n, k, 2, 2) ndarray
            Of the motion modes if the filter has them, else of straight flight, m².
        """
        return found if motion == 0 else self.forecast(0, states, ahead_s)[1]

    def forecast_all(self, states: TrackStates, ahead_s: Floats) -> tuple[Floats, Floats]:
        """Propagate positions by every model: (j, n, k, 2) and (j, n, k, 2, 2)."""
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
