"""Motion modes of the interacting multiple model (IMM) filter."""

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.filters.imm._mode_scratch_kernels import (
    ACROSS,
    ALONG,
    ENTERING,
    LATERAL,
    LEAVING,
    MODE_COUNT,
    UNMODELLED,
)
from multiradar.tracking.settings import IMM_MODES_MAX, IMM_MODES_MIN, TrackingSettings

GRAVITY_MPS2 = 9.80665
#: Noise across the velocity of the gentler banks, relative to the steepest one, which also has to
#: cover steeper turns.
GENTLER_NOISE = 0.5


def mode_table(settings: TrackingSettings) -> NDArray[np.float64]:
    """Return the motion modes.

    Parameters
    ----------
    settings : TrackingSettings
        Settings with the prefix `imm_`.

    Returns
    -------
    (j, MODE_COUNT) float64
        Straight flight, right and left turns by increasing bank, and with an even number of modes a
        change of speed; columns as in `estimation.filters._mode_scratch_kernels`.

    Raises
    ------
    ConfigurationError
        If the number of modes is out of bounds.
    """
    count = settings.imm_modes
    if not IMM_MODES_MIN <= count <= IMM_MODES_MAX:
        raise ConfigurationError(
            f"imm_modes: expected {IMM_MODES_MIN} to {IMM_MODES_MAX}, was {count}"
        )
    banks = (count - 1) // 2
    steepest = GRAVITY_MPS2 * np.tan(np.radians(settings.imm_bank_deg))
    parts = np.linspace(0.5, 1.0, banks) if banks > 1 else np.array([0.75])
    table = np.zeros((count, MODE_COUNT))
    table[:, [ALONG, ACROSS]] = settings.imm_straight_density
    table[0, LEAVING] = 1.0 / settings.imm_straight_s
    table[1:, LEAVING] = 1.0 / settings.imm_manoeuvre_s
    turns = slice(1, 1 + 2 * banks)
    table[turns, LATERAL] = (steepest * parts[:, None] * np.array([1.0, -1.0])).ravel()
    table[turns, ACROSS] = settings.imm_turn_density * GENTLER_NOISE
    table[2 * banks - 1 : 1 + 2 * banks, ACROSS] = settings.imm_turn_density
    table[turns, ENTERING] = 1.0 / (2 * banks)
    speeding = count % 2 == 0
    if speeding:
        table[-1, ALONG] = settings.imm_speeding_density
        table[turns, ENTERING] *= 1.0 - settings.imm_speeding_share
        table[-1, ENTERING] = settings.imm_speeding_share
    # Where a mode with wide noise covers unmodelled motion, the other modes stay narrow.
    table[-1 if speeding else slice(None), UNMODELLED] = 1.0
    return table
