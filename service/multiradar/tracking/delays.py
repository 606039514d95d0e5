"""Delays of transponders, as estimated by the filter."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import DELAY_VARIANCE
from multiradar.estimation.filters.arrays import (
    DELAY_BIASES,
    DELAY_MEAN,
    DELAY_SIGMA,
    Aircraft,
    Model,
)
from multiradar.state import Fields
from multiradar.tracking.outputs import DelayRecords
from multiradar.tracking.roster import Roster

Floats = NDArray[np.float64]


class DelayLog:
    """The delays of tracks that have ended since the last output; owned by the engine."""

    STATE: ClassVar[Fields] = {
        "_parts": list[DelayRecords],
    }

    def __init__(self) -> None:
        self._parts: list[DelayRecords] = []

    def add(
        self,
        slots: NDArray[np.int64],
        track_id: NDArray[np.int64],
        aircraft: Aircraft,
        roster: Roster,
        model: Model,
    ) -> None:
        """Record tracks at the published biases; nothing where no delay is estimated.

        Parameters
        ----------
        slots, track_id : (n,) int64
            Their slots, of terminated tracks before these are reused, and their identifiers.
        aircraft : Aircraft
            The states.
        roster : Roster
            The identities.
        model : Model
            The published biases.
        """
        if not len(model.delayed) or not len(slots):
            return
        delay_m, sigma_m = delays(aircraft.delay[slots], model)
        self._parts.append(
            DelayRecords(
                time_s=aircraft.updated[slots],
                track_id=track_id,
                track_number=roster.track_number[slots],
                mode_s_address=roster.mode_s_address[slots],
                delay_m=delay_m,
                sigma_m=sigma_m,
            )
        )

    def pop(self) -> DelayRecords:
        """Return what was recorded since the last call."""
        found, self._parts = DelayRecords.concatenate(self._parts), []
        return found


def delays(states: Floats, model: Model) -> tuple[Floats, Floats]:
    """Return delays of transponders at the published biases, and their standard deviations.

    Parameters
    ----------
    states : (n, DELAY_BIASES + c) float64
        Rows of `Aircraft.delay`.
    model : Model
        The published biases.

    Returns
    -------
    delay_m, sigma_m : (n,) float64
        d̂ + V_d ς̂ and √(B + V_d P_ς V_dᵀ). That of an aircraft without measurements is the prior.
    """
    by_biases, sigma = states[:, DELAY_BIASES:], states[:, DELAY_SIGMA]
    before = np.sqrt(model.options[DELAY_VARIANCE])
    spread = np.einsum("nc,cd,nd->n", by_biases, model.bias_covariance, by_biases)
    return (
        states[:, DELAY_MEAN] + by_biases @ model.bias,
        np.sqrt(np.where(sigma > 0.0, sigma, before) ** 2 + spread),
    )
