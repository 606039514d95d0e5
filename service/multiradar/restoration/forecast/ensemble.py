"""A forecast ensemble: weighted trajectories of an aircraft at times ahead."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Motion of a member after the last segment of its track, by number.
LATER_NAMES = ("straight", "right", "left", "speed")
#: Members of a region, beside the rest as one: its size is accurate to some per cent.
REGION_MEMBERS = 40


class Members(NamedTuple):
    """Members of a forecast ensemble with the largest weights at each time, and the rest as one.

    Attributes
    ----------
    member : (k, n) int64
        Indices in the ensemble, by decreasing weight; −1 for the rest, which is last.
    weight : (k, n) float64
        Probabilities with sum one.
    state : (k, n, 4) float64
        As in the ensemble; the mean for the rest.
    covariance : (k, n, 4, 4) float64
        As in the ensemble; for the rest including the differences between its members.
    """

    member: Integers
    weight: Floats
    state: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ForecastEnsemble:
    """Weighted members: possible states of an aircraft at times ahead.

    Attributes
    ----------
    time_s : float
        Time of the last plot.
    ahead_s : (k,) float64
        Times after it.
    track : (c,) int64
        The track of the bundle that each member continues, 0 the best.
    lasts_s : (c,) float64
        Remaining duration of the last segment of the track; infinite for straight flight.
    later : (c,) int64
        Motion that starts after it: index of `LATER_NAMES`.
    weight : (k, c) float64
        Probabilities of the members, with sum one at each time; those of new manoeuvres grow with
        time.
    state : (k, c, 4) float64
        East and north, m, and their rates, m/s.
    covariance : (k, c, 4, 4) float64
        Covariance of the errors of `state`.
    """

    time_s: float
    ahead_s: Floats
    track: Integers
    lasts_s: Floats
    later: Integers
    weight: Floats
    state: Floats
    covariance: Floats

    def __len__(self) -> int:
        """Return the number of members."""
        return len(self.track)

    def heaviest(self, most: int) -> Members:
        """Return the members with the largest weights, and the rest as one more.

        Parameters
        ----------
        most : int
            Maximum number of members, at least 1.

        Returns
        -------
        Members
            Mean and covariance of the mixture are those of the whole ensemble.

        References
        ----------
        The project's own: moments of a mixture.
        """
        order = np.argsort(-self.weight, axis=1, kind="stable")
        rows = np.arange(len(order))[:, None]
        if len(self) <= most:
            return Members(
                order, self.weight[rows, order], self.state[rows, order],
                self.covariance[rows, order],
            )  # fmt: skip
        first, last = order[:, :most], order[:, most:]
        total, mean, spread = _mixed(
            self.weight[rows, last], self.state[rows, last], self.covariance[rows, last]
        )
        return Members(
            np.append(first, np.full((len(order), 1), -1), axis=1),
            np.append(self.weight[rows, first], total[:, None], axis=1),
            np.append(self.state[rows, first], mean[:, None], axis=1),
            np.append(self.covariance[rows, first], spread[:, None], axis=1),
        )

    def mean(self) -> Floats:
        """Return the expected states.

        Returns
        -------
        (k, 4) ndarray
            Weighted means of the members.

        References
        ----------
        The project's own: moments of a mixture.
        """
        return _mixed(self.weight, self.state, self.covariance)[1]

    def spread(self) -> Floats:
        """Return the covariances of the expected states.

        Returns
        -------
        (k, 4, 4) ndarray
            Covariances including the differences between the members.

        References
        ----------
        The project's own: moments of a mixture.
        """
        return _mixed(self.weight, self.state, self.covariance)[2]


# Weight, mean and covariance of each mixture (k, c); with equal weights where all are zero.
def _mixed(weight: Floats, state: Floats, covariance: Floats) -> tuple[Floats, Floats, Floats]:
    total = weight.sum(axis=1)
    share = np.where(total[:, None] > 0.0, weight, 1.0)
    share = share / share.sum(axis=1, keepdims=True)
    mean = np.einsum("kc,kci->ki", share, state)
    off = state - mean[:, None]
    spread = np.einsum("kc,kcij->kij", share, covariance)
    spread += np.einsum("kc,kci,kcj->kij", share, off, off)
    return total, mean, spread
