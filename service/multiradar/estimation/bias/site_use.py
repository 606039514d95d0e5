"""Why the plots of a sensor have not contributed to the biases."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import SEVERAL
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.estimation.measurement.sites import numbers_of_sites
from multiradar.state import Fields

#: A bias whose sigma exceeds this fraction of that without measurements has had no information.
UNTOUCHED_RATIO_MIN = 0.999


class SiteUse:
    """Whether the aircraft of each sensor were measured from other sites too; one owner.

    A plot contributes to the biases only if its aircraft was measured from several sites and its
    height is known.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    """

    STATE: ClassVar[Fields] = {
        "_used": np.ndarray,
        "_shared": np.ndarray,
    }

    def __init__(self, sensors: SensorTable) -> None:
        self._sites = numbers_of_sites(sensors)
        self._used = np.zeros(len(sensors), np.bool_)
        self._shared = np.zeros(len(sensors), np.bool_)

    @property
    def is_settled(self) -> bool:
        """Whether further measurements change nothing: all sensors share aircraft."""
        return bool(self._shared.all())

    def record(self, sensor: NDArray[np.integer], measured_from: NDArray[np.int64]) -> None:
        """Record accepted measurements.

        Parameters
        ----------
        sensor : (n,) int
            Sensor of each.
        measured_from : (n,) int64
            `Aircraft.measured_from` of its aircraft.
        """
        self._used[sensor] = True
        self._shared[sensor[measured_from == SEVERAL]] = True

    def reason(self, sensor: int) -> str:
        """Return why the biases of a sensor have had no information, and what to do."""
        if not self._used[sensor]:
            return "none of its measurements has updated a track"
        if self._shared[sensor]:
            return (
                "its plots do not contribute as long as the heights of its aircraft are unknown "
                "or uncertain; add ADS-B, or a sensor that receives Mode C"
            )
        if len(np.unique(self._sites[self._used])) == 1:
            return (
                "all aircraft were observed from one site; add a radar at another site (at least "
                "1 km away), ADS-B, or multilateration (with no estimated frame biases)"
            )
        return (
            "none of its aircraft was observed from another site; check whether the coverage, "
            "times and identities of the sensors agree"
        )
