"""Positions of radar plots on the plane, corrected for biases, with their noise covariance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.trajectories import Flags, Floats
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

# The height of the point on the beam is nearly linear in the elevation: each round gains three
# digits at 10 km range and more farther out.
# Rounds of the solution for the true azimuth of an eccentric antenna.
_ECCENTRICITY_ROUNDS = 3
_ELEVATION_ROUNDS = 6
#: At a steeper elevation the height error dominates the position: unusable.
_SINE_MAX = 0.95


@dataclass(frozen=True, slots=True)
class Radar:
    """A radar for locating plots.

    Attributes
    ----------
    site : (latitude_rad, longitude_rad, height_m)
        WGS 84.
    range_sigma_m, azimuth_sigma_rad : float
        Random error, 1 sigma.
    """

    site: tuple[float, float, float]
    range_sigma_m: float
    azimuth_sigma_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class PlotPositions:
    """Positions of plots.

    Attributes
    ----------
    latitude_rad, longitude_rad : (n,) float64
        WGS 84.
    usable : (n,) bool
        False where the height is unknown or the elevation is too steep.
    """

    latitude_rad: Floats
    longitude_rad: Floats
    usable: Flags


def locate_plots(
    site: tuple[float, float, float], range_m: Floats, azimuth_rad: Floats, height_m: Floats
) -> PlotPositions:
    """Return the positions of plots with known heights.

    Parameters
    ----------
    site : (latitude_rad, longitude_rad, height_m)
        The radar, WGS 84.
    range_m, azimuth_rad, height_m : (n,) float64
        Slant range, azimuth at the radar and height above the ellipsoid.

    Returns
    -------
    PlotPositions
        The point at that range and azimuth with the given height.
    """
    origin, axes = geodetic_to_ecef(*site), enu_rotation(site[0], site[1])
    usable = np.isfinite(height_m) & np.isfinite(azimuth_rad) & (range_m > 0.0)
    usable[usable] = np.abs(height_m - site[2])[usable] < _SINE_MAX * range_m[usable]
    height = np.where(usable, height_m, site[2])
    length = np.where(usable, range_m, 1.0)
    azimuth_rad = np.where(usable, azimuth_rad, 0.0)
    elevation = np.arcsin(np.where(usable, (height - site[2]) / length, 0.0))
    for _ in range(_ELEVATION_ROUNDS):
        level = np.cos(elevation)
        local = np.stack(
            [level * np.sin(azimuth_rad), level * np.cos(azimuth_rad), np.sin(elevation)], axis=-1
        )
        latitude, longitude, reached = ecef_to_geodetic(origin + (length[:, None] * local) @ axes)
        elevation = elevation + (height - reached) / (length * level)
        elevation = np.clip(elevation, -np.arcsin(_SINE_MAX), np.arcsin(_SINE_MAX))
    return PlotPositions(latitude, longitude, usable)


def noise_on_plane(plane: SystemPlane, radar: Radar, position_m: Floats, range_m: Floats) -> Floats:
    """Return the covariance of positions of plots.

    Parameters
    ----------
    plane : SystemPlane
        The plane of the positions.
    radar : Radar
        The radar of the plots.
    position_m : (n, 2) float64
        Positions on the plane.
    range_m : (n,) float64
        Slant ranges.

    Returns
    -------
    (n, 2, 2) float64
        The range error lies along the line to the radar, the azimuth error across it, m².
    """
    foot = np.stack(plane.to_plane(radar.site[0], radar.site[1]), axis=-1)
    offset = position_m - foot
    ground = np.maximum(np.hypot(*offset.T), 1.0)
    along = offset / ground[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    far = (radar.range_sigma_m * range_m / ground) ** 2
    wide = (radar.azimuth_sigma_rad * ground) ** 2
    covariance: Floats = (
        far[:, None, None] * along[:, :, None] * along[:, None, :]
        + wide[:, None, None] * across[:, :, None] * across[:, None, :]
    )
    return covariance


def without_biases(
    range_m: Floats, azimuth_deg: Floats, time_s: Floats, bias: Mapping[str, Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return measurements corrected for biases.

    Parameters
    ----------
    range_m, azimuth_deg, time_s : (n,) float64
        As measured.
    bias : mapping of str to (n,) float64
        By parameter, measured minus true, at each plot.

    Returns
    -------
    range_m, azimuth_deg, time_s : (n,) float64
        Free of biases, with random errors.
    """
    nothing = np.zeros(len(range_m))
    gain = 1.0 + bias.get("range_gain", nothing)
    true_m = (range_m - bias.get("range_offset_m", nothing)) / gain
    turned = azimuth_deg - bias.get("azimuth_offset_deg", nothing)
    sine, cosine = (bias.get(name, nothing) for name in ("azimuth_sine_deg", "azimuth_cosine_deg"))
    east, north = (bias.get(name, nothing) for name in ("frame_east_m", "frame_north_m"))
    true_deg = turned
    # Effects at the true azimuth: each round gains their digits, as they are small.
    for _ in range(_ECCENTRICITY_ROUNDS):
        s, c = np.sin(np.radians(true_deg)), np.cos(np.radians(true_deg))
        across_m = east * c - north * s
        true_deg = turned - sine * s - cosine * c - np.degrees(across_m / np.maximum(true_m, 1.0))
    along_m = east * np.sin(np.radians(true_deg)) + north * np.cos(np.radians(true_deg))
    return true_m - along_m, true_deg, time_s - bias.get("time_offset_s", nothing)


def report_without_biases(
    latitude_rad: Floats,
    longitude_rad: Floats,
    time_s: Floats,
    reference_rad: tuple[float, float] | None,
    bias: Mapping[str, Floats],
) -> tuple[Floats, Floats, Floats]:
    """Return reported positions corrected for biases of the clock and of a local frame.

    Parameters
    ----------
    latitude_rad, longitude_rad, time_s : (n,) float64
        As reported.
    reference_rad : (latitude, longitude), optional
        Reference point of the frame; None without one.
    bias : mapping of str to (n,) float64
        By parameter, measured minus true, at each report.

    Returns
    -------
    latitude_rad, longitude_rad, time_s : (n,) float64
        Free of biases, with random errors.
    """
    nothing = np.zeros(len(time_s))
    east_m, north_m, turn_deg = (
        bias.get(name, nothing) for name in ("frame_east_m", "frame_north_m", "frame_rotation_deg")
    )
    true_s = time_s - bias.get("time_offset_s", nothing)
    if reference_rad is None or not (east_m.any() or north_m.any() or turn_deg.any()):
        return latitude_rad, longitude_rad, true_s
    plane = SystemPlane(*reference_rad)
    east, north = plane.to_plane(latitude_rad, longitude_rad)
    east, north = east - east_m, north - north_m
    sine, cosine = np.sin(np.radians(turn_deg)), np.cos(np.radians(turn_deg))
    true = plane.to_geodetic(cosine * east - sine * north, sine * east + cosine * north)
    return *true, true_s
