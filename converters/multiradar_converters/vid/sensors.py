"""`sensors.toml` of a dump: all its sensors, with positions to fill in."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.scan_period import PLOTS_MAX, scan_period_s, why_no_period
from multiradar_converters.sensors_template import FROM_PLOTS, FoundSensor, sensors_text
from multiradar_converters.vid.naming import NamedPlots
from multiradar_converters.vid.records import Records, decimal, sensor_of, times
from multiradar_converters.vid.table import ADSB_ID

_RANGE, _AZIMUTH, _SWEEP = 1, 2, 3


@dataclass
class SensorFigures:
    """Figures of the plots of each sensor, by its number.

    Attributes
    ----------
    plots, named : int64[s]
        Plots, and those referenced by a track row.
    range_max_m : float64[s]
        Maximum range, m.
    """

    plots: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    named: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    range_max_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    _first: list[list[Records]] = field(default_factory=list)

    def reserve(self, sensors: int) -> None:
        """Extend the arrays to a number of sensors."""
        self.plots = np.zeros(sensors, dtype=np.int64)
        self.named = np.zeros(sensors, dtype=np.int64)
        self.range_max_m = np.zeros(sensors)
        self._first = [[] for _ in range(sensors)]

    def add(self, named: NamedPlots) -> None:
        """Add plots to the figures."""
        sensor = sensor_of(named.plots[:, -1])
        for number in np.flatnonzero(self.plots < PLOTS_MAX).tolist():
            own = named.plots[sensor == number]
            if len(own):
                self._first[number].append(own[: PLOTS_MAX - int(self.plots[number]), :_SWEEP])
        self.plots += np.bincount(sensor, minlength=len(self.plots))
        self.named += np.bincount(sensor[named.aircraft >= 0], minlength=len(self.plots))
        np.maximum.at(self.range_max_m, sensor, decimal(named.plots, _RANGE))

    def without_plots(self, names: list[tuple[int, int]], multiradar_source: int) -> list[str]:
        """Return the sensors of tracks without any plot, as `source-sensor`."""
        return sorted(
            f"{source}-{sensor}"
            for number, (source, sensor) in enumerate(names)
            if source != multiradar_source and not self.plots[number]
        )

    def scan_period(self, number: int) -> tuple[float, str]:
        """Return the scan period from the first plots of a sensor, s, and its source.

        NaN for none, with the reason.
        """
        if not self._first[number]:
            return math.nan, "no plots"
        records = np.concatenate(self._first[number])
        plots = times(records), decimal(records, _AZIMUTH)
        period_s = scan_period_s(*plots)
        return period_s, why_no_period(*plots) if math.isnan(period_s) else FROM_PLOTS


def sensors_toml(
    names: list[tuple[int, int]], figures: SensorFigures, reports: int, multiradar_source: int
) -> str:
    """Write `sensors.toml`.

    Parameters
    ----------
    names : list of (source, sensor)
        Sensors by number.
    figures : SensorFigures
        Figures of their plots.
    reports : int
        Number of ADS-B reports.
    multiradar_source : int
        The source that is not a radar.

    Returns
    -------
    str
        TOML; usable once the position of each radar is filled in.
    """
    radars = sorted(
        (name, number) for number, name in enumerate(names) if name[0] != multiradar_source
    )
    periods = {number: figures.scan_period(number) for _, number in radars}
    found = [
        FoundSensor(
            identifier=f"{source}-{sensor}",
            kind="radar",
            found=_description(figures, number),
            numbers=(("source", source), ("sensor", sensor)),
            rotation_period_s=periods[number][0],
            period_source=periods[number][1],
            range_max_m=float(figures.range_max_m[number]),
        )
        for (source, sensor), number in radars
    ]
    adsb = FoundSensor(identifier=ADSB_ID, kind="adsb", found=_counted(reports, "report"))
    return sensors_text([*found, adsb])


def _description(figures: SensorFigures, number: int) -> str:
    """Describe the plots of a sensor."""
    plots, named = int(figures.plots[number]), int(figures.named[number])
    if not plots:
        return "no plots; referenced by tracks only"
    if plots == 1:
        return f"1 plot, {'' if named else 'not '}referenced by tracks"
    return f"{plots} plots, {named} referenced by tracks"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
