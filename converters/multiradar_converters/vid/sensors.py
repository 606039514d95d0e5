"""The skeleton of `sensors.toml`: every sensor of a dump, its position left to fill in."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.vid.naming import NamedPlots
from multiradar_converters.vid.records import decimal, sensor_of
from multiradar_converters.vid.table import ADSB_ID

_RANGE = 1


@dataclass
class SensorFigures:
    """What the plots say about each sensor, by its number.

    Attributes
    ----------
    plots, named : int64[s]
        Plots, and those of them that a track row names.
    range_max_m : float64[s]
        Longest range, m.
    """

    plots: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    named: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    range_max_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def reserve(self, sensors: int) -> None:
        """Make room for so many sensors."""
        self.plots = np.zeros(sensors, dtype=np.int64)
        self.named = np.zeros(sensors, dtype=np.int64)
        self.range_max_m = np.zeros(sensors)

    def add(self, named: NamedPlots) -> None:
        """Take plots into account."""
        sensor = sensor_of(named.plots[:, -1])
        self.plots += np.bincount(sensor, minlength=len(self.plots))
        self.named += np.bincount(sensor[named.aircraft >= 0], minlength=len(self.plots))
        np.maximum.at(self.range_max_m, sensor, decimal(named.plots, _RANGE))


def sensors_toml(
    names: list[tuple[int, int]], figures: SensorFigures, reports: int, multiradar_source: int
) -> str:
    """Write the skeleton.

    Parameters
    ----------
    names : list of (source, sensor)
        Sensors by number.
    figures : SensorFigures
        What the plots say about them.
    reports : int
        Number of ADS-B reports.
    multiradar_source : int
        The source that is no radar.

    Returns
    -------
    str
        TOML; it can be loaded once the three lines of each radar's position are filled in.
    """
    parts = [
        "# Sensors found in the dump. Fill in the position of each radar (WGS 84) and take the\n"
        "# comment marks of these lines away; the other values are defaults to be improved.\n"
    ]
    radars = sorted(
        (name, number) for number, name in enumerate(names) if name[0] != multiradar_source
    )
    for (source, sensor), number in radars:
        parts.append(
            f"\n[[sensor]]\n"
            f'id = "{source}-{sensor}"\n'
            f'kind = "radar"\n'
            f"source = {source}\n"
            f"sensor = {sensor}\n"
            f"# {_said(figures, number)}\n"
            f"# latitude_deg =\n"
            f"# longitude_deg =\n"
            f"# height_m =\n"
        )
    parts.append(
        f'\n[[sensor]]\nid = "{ADSB_ID}"\nkind = "adsb"\n# {_counted(reports, "report")}\n'
    )
    return "".join(parts)


def _said(figures: SensorFigures, number: int) -> str:
    """Tell what the plots say about a sensor."""
    plots, named = int(figures.plots[number]), int(figures.named[number])
    if not plots:
        return "no plots, seen in tracks only"
    far = f"{figures.range_max_m[number]:.0f} m"
    if plots == 1:
        return f"1 plot, {'named' if named else 'not named'} by tracks, at {far}"
    return f"{plots} plots, {named} of them named by tracks, the farthest at {far}"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
