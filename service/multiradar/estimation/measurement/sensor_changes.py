"""What a change of the sensors means for what was learnt about them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, SensorTable

# A sensor whose columns of these differ measures with other random errors.
_NOISES = ("range_sigma_m", "azimuth_sigma_rad", "position_sigma_m", "elevation_sigma_rad")
_SITES = ("latitude_rad", "longitude_rad", "height_m")


class SensorChange(NamedTuple):
    """A change from one table of sensors to another, with the same sensors first.

    Attributes
    ----------
    reset : (m,) bool
        Sensors of the old table whose biases start from their priors again: those that moved, since
        their offsets contain errors of the site and of the antenna's orientation, and those that
        an operator names.
    relearnt : (m,) bool
        Sensors of the old table whose health starts again, since it refers to their site, biases
        and noise.
    """

    reset: NDArray[np.bool_]
    relearnt: NDArray[np.bool_]

    @classmethod
    def between(cls, old: SensorTable, new: SensorTable, reset: int = -1) -> "SensorChange":
        """Return the change between two tables, with a sensor whose biases are reset anyway.

        Raises
        ------
        ConfigurationError
            If a sensor of the old table has another place, kind or bias parameters in the new one,
            or transponder delays are estimated in one of them only.
        """
        _require_continuous(old, new)
        again = _differs(old, new, _SITES)
        again[reset] |= reset >= 0
        return cls(again, again | _differs(old, new, _NOISES))


def _differs(old: SensorTable, new: SensorTable, names: tuple[str, ...]) -> NDArray[np.bool_]:
    found = np.zeros(len(old), np.bool_)
    for name in names:
        before, now = getattr(old, name), getattr(new, name)[: len(old)]
        found |= (before != now) & ~(np.isnan(before) & np.isnan(now))
    return found


def _require_continuous(old: SensorTable, new: SensorTable) -> None:
    later = "; to change it, edit the sensors file and start a new journal"
    if old.ids != new.ids[: len(old)]:
        raise ConfigurationError(
            f"the existing sensors ({', '.join(old.ids)}) must come first and in this order; to "
            "remove or reorder sensors, edit the sensors file and start a new journal"
        )
    for row, name in enumerate(old.ids):
        for what in ("kinds", "moving"):
            before, now = getattr(old, what)[row], getattr(new, what)[row]
            if before != now:
                raise ConfigurationError(
                    f"sensor {name}: {what.removesuffix('s')} cannot change while the service "
                    f"runs{later}"
                )
        before, now = (one.parameter_kind[one.parameter_sensor == row] for one in (old, new))
        if before.tolist() != now.tolist():
            raise ConfigurationError(
                f"sensor {name}: the estimated biases cannot change while the service runs: "
                f"expected {_names(before)}, was {_names(now)}{later}"
            )
    if old.delayed.any() != new.delayed.any() or old.delay_sigma_m != new.delay_sigma_m:
        raise ConfigurationError(
            "transponder_delay_sigma_m cannot change while the service runs: expected "
            f"{old.delay_sigma_m:g}, was {new.delay_sigma_m:g}{later}"
        )


def _names(kinds: NDArray[np.int8]) -> str:
    return ", ".join(PARAMETER_NAMES[kind] for kind in kinds.tolist()) or "none"
