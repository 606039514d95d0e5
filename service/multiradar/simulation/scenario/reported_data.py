"""Data that aircraft report about their flight, in a scenario: atmosphere, registers, faults."""

from dataclasses import dataclass
from typing import Literal

#: Registers that a sensor may receive.
RegisterName = Literal["4,0", "5,0", "6,0"]
REGISTER_NAMES: tuple[RegisterName, ...] = ("4,0", "5,0", "6,0")


@dataclass(frozen=True, slots=True)
class Atmosphere:
    """Wind and temperature, and the magnetic variation.

    Attributes
    ----------
    wind_speed_mps, wind_from_rad : float
        Speed, and direction from which the wind blows, clockwise from true north, at height 0 in
        the centre of the scenario.
    wind_shear_per_s, wind_veer_rad_per_m : float
        Increase of the speed, and turn to the right, with the height.
    wind_gradient_per_s : float
        Increase of the speed towards the east.
    magnetic_variation_rad : float
        Positive to the east.
    temperature_offset_k : float
        Beyond the standard atmosphere.
    """

    wind_speed_mps: float = 0.0
    wind_from_rad: float = 0.0
    wind_shear_per_s: float = 0.0
    wind_veer_rad_per_m: float = 0.0
    wind_gradient_per_s: float = 0.0
    magnetic_variation_rad: float = 0.0
    temperature_offset_k: float = 0.0


@dataclass(frozen=True, slots=True)
class RegisterReports:
    """Registers that a sensor receives of aircraft with a transponder.

    Attributes
    ----------
    registers : tuple of str
        Of `REGISTER_NAMES`.
    probability : float
        Probability of each register in a report.
    noise_scale : float
        Factor of the noise of the values; 0: rounding to the steps of the registers only.
    age_max_s : float
        Values are up to this much older than the position.
    swap_probability : float
        Probability that registers 5,0 and 6,0 of a report have each other's content.
    stale_share, sign_share, stuck_share : float
        Fractions of the aircraft whose registers are not updated any more from some time on, whose
        roll has the wrong sign, and whose heading is stuck from some time on.
    checks : bool
        Whether implausible values are dropped, as in a conversion.
    """

    registers: tuple[RegisterName, ...] = REGISTER_NAMES
    probability: float = 1.0
    noise_scale: float = 1.0
    age_max_s: float = 1.0
    swap_probability: float = 0.0
    stale_share: float = 0.0
    sign_share: float = 0.0
    stuck_share: float = 0.0
    checks: bool = True
