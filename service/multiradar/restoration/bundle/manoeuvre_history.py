"""How often an aircraft manoeuvres, by what it has flown."""

from dataclasses import dataclass, replace

import numpy as np

#: What an aircraft did is told so long after it, s: then plots have decided it.
DECIDED_AFTER_S = 40.0
#: It is noted so often, s.
RECORDED_EVERY_S = 5.0
#: Of a longer silence nothing is known but its end, s.
SILENCE_MAX_S = 30.0


@dataclass(frozen=True, slots=True)
class ManoeuvreHistory:
    """Times an aircraft has flown straight, and has not.

    Attributes
    ----------
    straight_s, manoeuvring_s : float
        Sums over the flight.
    until_s : float
        To when they go; NaN before the first.
    """

    straight_s: float = 0.0
    manoeuvring_s: float = 0.0
    until_s: float = float("nan")

    def noted(self, until_s: float, straight: float) -> "ManoeuvreHistory":
        """Return the sums with the time since the last note.

        Parameters
        ----------
        until_s : float
            Data time; nothing is noted before that of the last note.
        straight : float
            Chance that the aircraft flew straight then.

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
        """Return how long straight flight of this aircraft lasts on average.

        Parameters
        ----------
        expected_s : float
            What is expected before anything is known.
        manoeuvre_s : float
            How long a manoeuvre lasts.
        weight_s : float
            So long a flight of what is expected is added to what was flown.

        Returns
        -------
        float
            Time straight over the number of manoeuvres.
        """
        share = expected_s / (expected_s + manoeuvre_s)
        straight = self.straight_s + share * weight_s
        manoeuvring = self.manoeuvring_s + (1.0 - share) * weight_s
        return manoeuvre_s * straight / manoeuvring
