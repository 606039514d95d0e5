"""Effects of errors of a radar on the positions of its plots, east and north."""

from dataclasses import dataclass

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import seen_from
from multiradar.diagnosis.plots import Floats, Site, ground_range

#: Kinds of errors.
SHIFT, GAIN, SCALE, CLOCK = "shift", "gain", "scale", "clock"
#: Maximum difference of the heights used for a plot by the sensor and by others, m: the height of a
#: plot without one is assumed.
HEIGHTS_ALIKE_M = 300.0
#: Pressure heights are off in proportion on a hot or a cold day (7 % at 20 K from the standard
#: atmosphere), which resembles another site height; the step of a fit.
HEIGHT_SCALE = 1.05


@dataclass(frozen=True, slots=True)
class SiteError:
    """An error of one radar, or of radars that share a site.

    Attributes
    ----------
    kind : str
        `SHIFT`, `GAIN`, `SCALE` or `CLOCK`.
    radars : tuple of int
        Rows of the radars, or of a sensor that reports positions, in the table of sensors.
    value : tuple of float
        Configured minus true site, or reported minus true position, east and north, m, ratio of
        measured to true range or azimuth minus 1, or claimed minus true time, s.
    before_m, after_m : float
        Median residual of the pairs with these radars as configured and with the error corrected,
        m.
    """

    kind: str
    radars: tuple[int, ...]
    value: tuple[float, ...]
    before_m: float
    after_m: float


@dataclass(frozen=True, slots=True)
class Effects:
    """How positions move with the range and the azimuth of a radar.

    Attributes
    ----------
    range_m : (k,) float64
        Slant ranges of the positions.
    along, across : (k, 2) float64
        Directions in which a position moves with range and with azimuth.
    by_scale_m : (k,) float64
        Distance along by which it moves where heights are greater by `HEIGHT_SCALE`, m.
    """

    range_m: Floats
    along: Floats
    across: Floats
    by_scale_m: Floats

    @property
    def offsets(self) -> Floats:
        """Effect of 1 m of range and of 1 rad of azimuth, (k, 2, 2)."""
        return np.stack([self.along, self.across * self.range_m[:, None]], axis=2)

    @property
    def height_scale(self) -> Floats:
        """Effect of greater heights, (k, 2, 1)."""
        return (self.along * self.by_scale_m[:, None])[:, :, None]


def effects_at(site: Site, position_m: Floats, height_m: Floats) -> Effects:
    """Return the effects at ECEF positions (k, 3) of aircraft at heights (k,)."""
    range_m, azimuth = seen_from(site, position_m)
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    along, across = np.column_stack([sine, cosine]), np.column_stack([cosine, -sine])
    level_m, _ = ground_range(site[2], range_m, height_m)
    raised_m, _ = ground_range(site[2], range_m, HEIGHT_SCALE * height_m)
    return Effects(range_m, along, across, level_m - raised_m)
