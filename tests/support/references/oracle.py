"""Geodesy of PROJ, as an independent reference."""

import numpy as np
import pyproj
from numpy.typing import ArrayLike, NDArray


def topocentric(
    site: tuple[float, float, float],
    latitude_deg: ArrayLike,
    longitude_deg: ArrayLike,
    height_m: ArrayLike,
) -> NDArray[np.float64]:
    """East, north, up (m) of WGS 84 positions in the local frame at a site (degrees, m)."""
    pipeline = pyproj.Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad "
        "+step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lat_0={site[0]} +lon_0={site[1]} +h_0={site[2]}"
    )
    latitude, longitude, height = np.broadcast_arrays(
        np.asarray(latitude_deg, np.float64), longitude_deg, height_m
    )
    return np.stack(pipeline.transform(longitude, latitude, height))


def orthographic(centre_deg: tuple[float, float]) -> pyproj.Proj:
    """PROJ's ellipsoidal orthographic projection with this centre (latitude, longitude)."""
    return pyproj.Proj(proj="ortho", ellps="WGS84", lat_0=centre_deg[0], lon_0=centre_deg[1])
