"""Sensors with a wrong clock, or that deliver more than they can: which, and what it means."""

from collections.abc import Callable

from multiradar.estimation.measurement.plot_rates import plots_per_scan_max
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission

_CHECK = "check the sensor, and whether another sender uses the same name"


class SensorAlarms:
    """Names the sensors whose measurements the service rejects; any thread reads.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    saturated : callable
        Returns the sensors that could lately initiate no more tracks.
    """

    def __init__(self, sensors: SensorTable, saturated: Callable[[], list[str]]) -> None:
        self.use(sensors)
        self._saturated = saturated
        #: Compares the times, and counts the measurements; None before the start.
        self.admission: Admission | None = None

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors."""
        self._sensors = sensors
        self._tracks_max = dict(zip(sensors.ids, plots_per_scan_max(sensors).tolist(), strict=True))

    def clock_leads(self) -> dict[str, float]:
        """Return by how much the wrong clocks are ahead of the data time, s, by sensor."""
        leads = {} if self.admission is None else self.admission.clock_leads()
        return {self._sensors.ids[sensor]: round(lead_s, 1) for sensor, lead_s in leads.items()}

    def storms(self) -> dict[str, str]:
        """Return a sentence for each sensor that delivers more than it can."""
        found = {
            sensor_id: f"limit of {self._tracks_max[sensor_id]:.0f} tentative tracks "
            f"(plots_per_scan_max) reached; no more are initiated: {_CHECK}"
            for sensor_id in self._saturated()
        }
        if self.admission is None:
            return found
        for sensor in self.admission.storms():
            found[self._sensors.ids[sensor]] = (
                f"more than {self.admission.rate_per_s(sensor):.0f} measurements per second "
                f"(plots_per_scan_max); the excess is rejected: {_CHECK}"
            )
        return dict(sorted(found.items()))

    def warnings(self) -> list[str]:
        """Return a sentence for each of them."""
        clocks = [
            f"{sensor_id}: time stamps are {abs(lead_s):g} s "
            f"{'ahead of' if lead_s > 0.0 else 'behind'} the data time, and the measurements are "
            "rejected; check the sensor clock and the data delay"
            for sensor_id, lead_s in self.clock_leads().items()
        ]
        disabled = [
            f"{sensor_id}: disabled in the sensors file or by an operator; all measurements are "
            "rejected"
            for sensor_id, off in zip(self._sensors.ids, self._sensors.disabled, strict=True)
            if off
        ]
        return [
            *disabled,
            *clocks,
            *(f"{sensor_id}: {what}" for sensor_id, what in self.storms().items()),
        ]
