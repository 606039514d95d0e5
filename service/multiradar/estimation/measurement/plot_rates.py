"""How many plots a sensor can deliver: bounds that no sensor in order reaches.

A sensor that delivers more has failed, or somebody else sends in its name. Its measurements beyond
the bound are rejected, so that they delay no other sensor.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import SensorTable

#: Plots per scan and km² of coverage. The densest airspace of Europe has some 0.01 aircraft per km²
#: within 150 km; a radar delivers about as many false plots.
PLOTS_PER_KM2 = 0.05
#: Bounds of the result. A Mode S ground station must process 900 aircraft (EUROCONTROL, Station
#: Functional Specification, edition 3.11).
PLOTS_LEAST, PLOTS_MOST = 10_000.0, 20_000.0
#: Interval of the bound for sensors without a known scan period, s.
WITHOUT_PERIOD_S = 1.0
#: Time over which an excess may last, in scans and s: plots may come a scan at a time, and the data
#: clock may stand still for two reorder horizons.
BURST_SCANS = 3.0
BURST_S = 20.0


def plots_per_scan_max(sensors: SensorTable) -> NDArray[np.float64]:
    """Return the greatest number of plots in a scan of each sensor.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.

    Returns
    -------
    (m,) float64
        Whole numbers, 1.

    Notes
    -----
    `SensorTable.plots_per_scan_max` where given, else `PLOTS_PER_KM2` within the instrumented
    range. It is also the greatest number of tentative tracks that a sensor may initiate.
    """
    area_km2 = np.pi * (sensors.range_max_m / 1000.0) ** 2
    by_coverage = np.clip(PLOTS_PER_KM2 * area_km2, PLOTS_LEAST, PLOTS_MOST)
    given = sensors.plots_per_scan_max
    return np.floor(np.where(np.isnan(given), by_coverage, given))


def plot_paces(sensors: SensorTable) -> NDArray[np.float64]:
    """Return the pace of the plots of each sensor.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.

    Returns
    -------
    (m, 2) float64
        Least mean interval of the plots, and the time by which plots at that interval may be ahead
        of the data time, s.
    """
    periods_s = np.nan_to_num(sensors.rotation_period_s, nan=WITHOUT_PERIOD_S)
    bursts_s = np.maximum(BURST_SCANS * periods_s, BURST_S)
    return np.column_stack([periods_s / plots_per_scan_max(sensors), bursts_s])
