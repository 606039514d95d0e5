"""Statistics of straight flight and manoeuvres of one aircraft."""

from dataclasses import dataclass, replace

import numpy as np

#: Delay after which the kind of motion is decided by plots, s.
DECIDED_AFTER_S = 40.0
#: Sampling interval of the history, s.
RECORDED_EVERY_S = 5.0
#: Maximum time credited to one sample, s: longer gaps are unknown.
SILENCE_MAX_S = 30.0


@dataclass(frozen=True, slots=True)
class ManoeuvreHistory:
    """Times of straight flight and of manoeuvres of one aircraft.

    Attributes
    ----------
    straight_s, manoeuvring_s : float
        Sums over the flight.
    until_s : float
        Time of the last sample; NaN before the first.
    """

    straight_s: float = 0.0
    manoeuvring_s: float = 0.0
    until_s: float = float("nan")

    def extended(self, until_s: float, straight: float) -> "ManoeuvreHistory":
        """Return the sums including the time since the last sample.

        Parameters
        ----------
        until_s : float
            Data time; earlier times than the last sample are ignored.
        straight : float
            Probability of straight flight at that time.

        Returns
        -------
        ManoeuvreHistory
            New sums.
        """
        if np.isnan(self.until_s):
            return replace(self, until_s=until_s)
        passed_s = min(max(until_s - self.until_s, 0.0), SILENCE_MAX_S)
        return ManoeuvreHistory(
            self.straight_s + straight * passed_s,
            self.manoeuvring_s + (1.0 - straight) * passed_s,
            max(until_s, self.until_s),
        )

    def mean_straight_s(self, expected_s: float, manoeuvre_s: float, weight_s: float) -> float:
        """Return the mean duration of straight flight of this aircraft.

        Parameters
        ----------
        expected_s : float
            Prior mean duration.
        manoeuvre_s : float
            Mean duration of a manoeuvre.
        weight_s : float
            Weight of the prior, as a duration of flight.

        Returns
        -------
        float
            Time of straight flight over the number of manoeuvres.
        """
        share = expected_s / (expected_s + manoeuvre_s)
        straight = self.straight_s + share * weight_s
        manoeuvring = self.manoeuvring_s + (1.0 - share) * weight_s
        return manoeuvre_s * straight / manoeuvring
