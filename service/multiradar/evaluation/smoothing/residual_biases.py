"""Residual biases of radars after correction by their estimates, on the plane."""

from collections.abc import Sequence

import numpy as np

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.smoothing.multiple_modes import ResidualBiases
from multiradar.evaluation.trajectories import Floats, Indices
from multiradar.geodesy.system_plane import SystemPlane
from multiradar_schemas.sensors.sensor import Sensor


def residual_biases(
    plane: SystemPlane,
    positions: tuple[Floats, Floats, Indices],
    sensors: Sequence[Sensor],
    biases: Sequence[BiasHistory],
) -> ResidualBiases:
    """Return the position errors caused by errors of the estimated biases.

    Parameters
    ----------
    plane : SystemPlane
        The plane of the positions.
    positions : (n, 2) float64, (n,) float64, (n,) int64
        East and north, slant ranges of plots, and index of the sensor of each.
    sensors : sequence of Sensor
        Only range and azimuth biases of radars are used.
    biases : sequence of BiasHistory
        Their last sigmas are used; a bias without estimates keeps that of its prior.

    Returns
    -------
    ResidualBiases
        One column for each bias. Correlations between estimates of different biases are not in the
        tables, and so not in the covariance.
    """
    position_m, range_m, sensor = positions
    columns, sigmas = [], []
    known = {(one.sensor_id, one.parameter): float(one.sigma[-1]) for one in biases}
    for number, one in enumerate(sensors):
        own = np.flatnonzero(sensor == number)
        if one.kind != "radar":
            continue
        assert one.latitude_deg is not None
        assert one.longitude_deg is not None
        site = plane.to_plane(np.radians(one.latitude_deg), np.radians(one.longitude_deg))
        offset = position_m[own] - np.stack(site, axis=-1)
        ground = np.maximum(np.hypot(*offset.T), 1.0)
        farther = offset * (range_m[own] / ground**2)[:, None]
        clockwise = np.radians(np.stack([offset[:, 1], -offset[:, 0]], axis=-1))
        direction = offset / ground[:, None]
        moves = {
            "range_offset_m": farther,
            "range_gain": farther * range_m[own, None],
            "azimuth_offset_deg": clockwise,
            "azimuth_sine_deg": clockwise * direction[:, :1],
            "azimuth_cosine_deg": clockwise * direction[:, 1:],
            "frame_east_m": np.broadcast_to([1.0, 0.0], offset.shape),
            "frame_north_m": np.broadcast_to([0.0, 1.0], offset.shape),
        }
        for estimated in one.estimated_biases():
            if estimated.parameter not in moves:
                continue
            column = np.zeros((len(position_m), 2))
            column[own] = moves[estimated.parameter]
            columns.append(column)
            sigmas.append(known.get((one.id, estimated.parameter), estimated.prior_sigma))
    sensitivity = np.stack(columns, axis=-1) if columns else np.zeros((len(position_m), 2, 0))
    return ResidualBiases(sensitivity, np.diag(np.array(sigmas, np.float64) ** 2))
