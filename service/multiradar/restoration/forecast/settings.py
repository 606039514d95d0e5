"""What a forecast from a bundle depends on beside the bundle."""

from dataclasses import dataclass

import numpy as np

from multiradar.errors import ConfigurationError

#: No forecast goes farther ahead, s: ten minutes from now, where the last plot is two minutes old.
AHEAD_MAX_S = 720.0


@dataclass(frozen=True, slots=True)
class ForecastSettings:
    """How aircraft are expected to fly on.

    The bundle looks for manoeuvres more often than they come, so as to see them early; a forecast
    has rates of its own.

    Attributes
    ----------
    straight_s : float
        Mean duration of straight flight of an aircraft of which nothing is known.
    turn_s, speeding_s : float
        Mean durations of turns, and of changes of speed: as much is expected to remain of one that
        is being flown.
    habit_s : float
        For so long a flight the mean duration of straight flight above stands; what an aircraft
        does itself is added to it.
    later_turns : float
        Share of turns among manoeuvres that have not begun.
    turn_rates_rad_per_s : tuple of float
        Rates of turns that have not begun, equally likely.
    speed_change_mps : float
        Standard deviation of what a change of speed that has not begun comes to.
    velocity_density : float
        Spectral density of the acceleration, m²/s³, that no segment has: wind, corrections.
    durations : int
        Remaining durations that each manoeuvre is continued by.
    weight_min : float
        Tracks with less of the whole weight are left out.

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
