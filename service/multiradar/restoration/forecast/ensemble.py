"""A fan of trajectories with weights: where an aircraft may be at times ahead."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: What a member does after the last segment of its track, by number.
LATER_NAMES = ("straight", "right", "left", "speed")
#: A region is that of so many members and the rest as one: its size is right to some percent.
REGION_MEMBERS = 40


class Members(NamedTuple):
    """The heaviest members of a fan at each time, and the rest as one.

    Attributes
    ----------
    member : (k, n) int64
        Their numbers in the fan, by falling weight; −1 for the rest, which comes last.
    weight : (k, n) float64
        Probabilities, of sum one.
    state : (k, n, 4) float64
        As in the fan; of the rest the mean.
    covariance : (k, n, 4, 4) float64
        As in the fan; of the rest what its members differ by included.
    """

    member: Integers
    weight: Floats
    state: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ForecastEnsemble:
    """Where an aircraft may be.

    Attributes
    ----------
    time_s : float
        Of the last plot.
    ahead_s : (k,) float64
        Times after it.
    track : (c,) int64
        The track of the bundle that each member continues, 0 the best.
    lasts_s : (c,) float64
        How long the last segment of the track goes on; infinite where it is straight flight.
    later : (c,) int64
        What begins after it: number of `LATER_NAMES`.
    weight : (k, c) float64
        Probabilities of the members: of sum one at each time. That of something new grows with the
        time.
    state : (k, c, 4) float64
        East and north, m, and their rates, m/s.
    covariance : (k, c, 4, 4) float64
        Of the errors of `state`.
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
        """Return so many members at most, and the rest as one more.

        Parameters
        ----------
        most : int
            At least 1.

        Returns
        -------
        Members
            With the mean and the covariance of the whole fan.

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
            Means of the members by their weights.

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
            What the members differ by included.

        References
        ----------
        The project's own: moments of a mixture.
        """
        return _mixed(self.weight, self.state, self.covariance)[2]


# Weight, mean and covariance of each mixture (k, c); one without weight has those of its members.
def _mixed(weight: Floats, state: Floats, covariance: Floats) -> tuple[Floats, Floats, Floats]:
    total = weight.sum(axis=1)
    share = np.where(total[:, None] > 0.0, weight, 1.0)
    share = share / share.sum(axis=1, keepdims=True)
    mean = np.einsum("kc,kci->ki", share, state)
    off = state - mean[:, None]
    spread = np.einsum("kc,kcij->kij", share, covariance)
    spread += np.einsum("kc,kci,kcj->kij", share, off, off)
    return total, mean, spread
