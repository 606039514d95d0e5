"""Parameters of forecasts from bundles."""

from dataclasses import dataclass

import numpy as np

from multiradar.errors import ConfigurationError

#: Maximum time ahead, s: ten minutes from now, if the last plot is two minutes old.
AHEAD_MAX_S = 720.0


@dataclass(frozen=True, slots=True)
class ForecastSettings:
    """Parameters of forecasts.

    A bundle expects manoeuvres more often than they occur, to detect them early; a forecast has
    rates of its own.

    Attributes
    ----------
    straight_s : float
        Prior mean duration of straight flight.
    turn_s, speeding_s : float
        Mean durations of turns and of changes of speed, also the mean remaining duration of a
        present one.
    habit_s : float
        Weight of the prior mean duration of straight flight, as a duration of flight.
    later_turns : float
        Fraction of turns among later manoeuvres.
    turn_rates_rad_per_s : tuple of float
        Turn rates of later turns, equally likely.
    speed_change_mps : float
        Standard deviation of a later change of speed.
    velocity_density : float
        Spectral density of the acceleration not modelled by segments, m²/s³: wind, corrections.
    durations : int
        Number of remaining durations of each present manoeuvre.
    weight_min : float
        Minimum weight of a track.

    Raises
    ------
    ConfigurationError
        If one of them is out of its range.
    """

    straight_s: float = 80.0
    turn_s: float = 60.0
    speeding_s: float = 40.0
    habit_s: float = 600.0
    later_turns: float = 0.7
    turn_rates_rad_per_s: tuple[float, ...] = (0.008, 0.018, 0.035)
    speed_change_mps: float = 18.0
    velocity_density: float = 0.003
    durations: int = 6
    weight_min: float = 1e-3

    def __post_init__(self) -> None:
        for name in self.__slots__:
            values = np.atleast_1d(getattr(self, name))
            wrong = values[~((values > 0.0) & np.isfinite(values))]
            if len(wrong):
                raise ConfigurationError(f"{name}: expected a number above 0, was {wrong[0]}")
        bounds = (("later_turns", 1.0), ("durations", 32), ("weight_min", 0.1))
        for name, most in bounds:
            value = getattr(self, name)
            if value > most:
                raise ConfigurationError(f"{name}: expected at most {most:g}, was {value:g}")
        rates = len(self.turn_rates_rad_per_s)
        if not 1 <= rates <= 8:
            raise ConfigurationError(f"turn_rates_rad_per_s: expected 1 to 8 rates, was {rates}")
