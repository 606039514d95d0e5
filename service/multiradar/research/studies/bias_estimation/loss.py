"""Loss of the two-stage filter by drift, relative to the joint filter, by process noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.theory import Theory, true_covariance
from multiradar.research.studies.bias_estimation.runs import (
    WALK_S,
    Realisation,
    expected_nees,
    traces,
)

#: White acceleration of the aircraft, m²/s³; 0 is exactly straight flight.
DENSITIES = (0.0, 0.003, 0.01, 0.1, 0.3, 1.0)
#: The theory is evaluated after this time, or at the end of a shorter scenario, s.
AFTER_S = 300.0


@dataclass(frozen=True, slots=True)
class Loss:
    """Joint and two-stage filter under drift, with one process noise.

    Attributes
    ----------
    density : float
        Spectral density of the acceleration, of the truth and of the filters, m²/s³.
    time_s : float
        Evaluation time.
    joint_m, two_stage_m : float
        Root mean square error of the position by (1.26).
    nees_aircraft, nees_bias : float
        Expected NEES of the two-stage filter per dimension.
    """

    density: float
    time_s: float
    joint_m: float
    two_stage_m: float
    nees_aircraft: float
    nees_bias: float


def drift_losses(
    one: Realisation, end_s: float, densities: Sequence[float] = DENSITIES
) -> list[Loss]:
    """Return the loss of the two-stage filter, by the theory alone.

    Parameters
    ----------
    one : Realisation
        A run with drift; the filters are linearised along its tracks.
    end_s : float
        End of the scenario, s.
    densities : sequence of float
        Process noises, m²/s³.

    Returns
    -------
    list of Loss
        One for each density.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.26) and (1.27).
    """
    time_s = min(AFTER_S, end_s)
    found = []
    for density in densities:
        joint, two_stage = (_theory(name, one, time_s, density) for name in ("joint", "two-stage"))
        nees = expected_nees(two_stage)[-1]
        found.append(
            Loss(
                density, time_s, _position(joint), _position(two_stage),
                float(nees[0]), float(nees[1]),
            )
        )  # fmt: skip
    return found


def _theory(name: str, one: Realisation, time_s: float, density: float) -> Theory:
    return true_covariance(
        name, one.sensors, one.plots, one.starts, [time_s],
        truth=one.truth, walk_s=WALK_S, options=Options(acceleration_density=density),
    )  # fmt: skip


def _position(theory: Theory) -> float:
    return float(np.sqrt(traces(theory.aircraft, theory.biases)[-1, 0]))
