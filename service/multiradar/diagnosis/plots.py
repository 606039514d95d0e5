"""The plots of a source as arrays, and their positions as configured."""

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.geodesic import EARTH_RADIUS_M
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Site = tuple[float, float, float]

#: Height of aircraft that report none, m.
HEIGHT_ASSUMED_M = 7000.0

#: Columns that identify an aircraft, the most reliable first.
KEYS = ("track_number", "mode_s_address", "mode_3a")
#: Codes shared by many aircraft, which identify none: Mode S and VFR conspicuity (ICAO EUR Doc 023;
#: FAA JO 7110.66), and 0000 and 2000, of aircraft without an assigned code.
CONSPICUITY = tuple(
    int(code, 8) for code in ("0000", "1000", "1200", "1400", "2000", "7000", "7001", "7010")
)


#: Standard deviation of normal numbers over their median absolute value.
NORMAL_SPREAD = 1.4826


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns of the same length."""

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(getattr(self, fields(self)[0].name))

    def select(self, which: NDArray[np.intp] | NDArray[np.int64] | NDArray[np.bool_]) -> Self:
        """Return the rows of a mask or of indices."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)})


@dataclass(frozen=True, slots=True)
class Plots(Rows):
    """Plots of one source by time, values as in the columns.

    Attributes
    ----------
    time_s, range_m, azimuth_deg, latitude_deg, longitude_deg, height_m : (n,) float64
        NaN where missing.
    keys : (n, 3) int64
        Identity by `KEYS`, −1 where missing or a code of `CONSPICUITY`.
    """

    time_s: Floats
    range_m: Floats
    azimuth_deg: Floats
    latitude_deg: Floats
    longitude_deg: Floats
    height_m: Floats
    keys: Integers

    def thinned(self, most: int) -> "Plots":
        """Return at most `most` of them, evenly spread."""
        count = self.size
        return (
            self if count <= most else self.select(np.linspace(0, count - 1, most).astype(np.intp))
        )

    def heights(self) -> Floats:
        """Return heights, m; `HEIGHT_ASSUMED_M` where none was reported."""
        return np.where(np.isfinite(self.height_m), self.height_m, HEIGHT_ASSUMED_M)


def plots_of(frame: pl.DataFrame) -> Plots:
    """Return the plots of a frame of `Source.plots`."""
    numbers = ("time_s", "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m")
    code = pl.col("mode_3a").cast(pl.String).str.to_integer(base=8, strict=False)
    keys = frame.select(
        pl.col("track_number"),
        pl.col("mode_s_address").cast(pl.String).str.to_integer(base=16, strict=False),
        pl.when(~code.is_in(CONSPICUITY)).then(code),
    )
    return Plots(
        **{name: frame[name].fill_null(np.nan).to_numpy() for name in numbers},
        keys=keys.fill_null(-1).cast(pl.Int64).to_numpy().reshape(-1, len(KEYS)),
    )


def ground_range(site_height_m: float, range_m: Floats, height_m: Floats) -> tuple[Floats, Floats]:
    """Return the horizontal and the vertical component of slant ranges at a radar, m.

    Parameters
    ----------
    site_height_m : float
        Height of the radar, m.
    range_m, height_m : (n,) float64
        Slant ranges and heights of the aircraft, m.

    Returns
    -------
    ground_m, up_m : (n,) ndarray
        By the law of cosines on a sphere; a range shorter than the height is vertical.
    """
    near, far = EARTH_RADIUS_M + site_height_m, EARTH_RADIUS_M + height_m
    with np.errstate(invalid="ignore", divide="ignore"):
        sine = (far**2 - near**2 - range_m**2) / (2.0 * near * range_m)
    sine = np.clip(np.nan_to_num(sine, nan=0.0), -1.0, 1.0)
    return range_m * np.sqrt(1.0 - sine**2), range_m * sine


def located(site: Site, range_m: Floats, azimuth_rad: Floats, height_m: Floats) -> Floats:
    """Return (n, 3) positions of radar plots, ECEF, m."""
    ground_m, up_m = ground_range(site[2], range_m, height_m)
    east, north = ground_m * np.sin(azimuth_rad), ground_m * np.cos(azimuth_rad)
    local = np.column_stack([east, north, up_m])
    return np.asarray(geodetic_to_ecef(*site) + local @ enu_rotation(site[0], site[1]))


def positions(plots: Plots, site: Site | None) -> Floats:
    """Return (n, 3) positions of plots as configured, ECEF, m; NaN where unknown.

    Parameters
    ----------
    plots : Plots
        Plots of one sensor.
    site : Site, optional
        Of a radar, rad and m; None for a sensor that reports positions.
    """
    if site is not None:
        return located(site, plots.range_m, np.radians(plots.azimuth_deg), plots.heights())
    return reported(plots)


def reported(plots: Plots) -> Floats:
    """Return (n, 3) positions from the latitude and longitude columns, ECEF, m."""
    latitude, longitude = np.radians(plots.latitude_deg), np.radians(plots.longitude_deg)
    return geodetic_to_ecef(latitude, longitude, plots.heights())


def geodetic(position_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Return latitude and longitude, rad, and height, m, of ECEF positions."""
    return ecef_to_geodetic(position_m)
