"""The same plots through filters that others wrote, one aircraft an object, without biases."""

from time import perf_counter

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray

from benchmark.load import Load
from multiradar.estimation.motion.constant_velocity import process_noise, transition
from multiradar.geodesy._kernels import predict_polar, site_parameters

#: A plot costs them tens of microseconds: the plots of so many aircraft are enough.
AIRCRAFT = 60


def filterpy_nanoseconds(load: Load) -> float:
    """Time FilterPy's extended Kalman filter over the plots of a few aircraft of a load."""
    plane = load.plane.parameters
    sites = [
        site_parameters(plane, latitude, longitude, height)
        for latitude, longitude, height in zip(
            load.sensors.latitude_rad, load.sensors.longitude_rad, load.sensors.height_m,
            strict=True,
        )
    ]  # fmt: skip
    filters: dict[int, tuple[float, ExtendedKalmanFilter]] = {}
    noise = np.diag([40.0**2, 0.001**2])
    rows = load.rows
    chosen = np.flatnonzero(rows.slot < AIRCRAFT)
    begin = perf_counter()
    for row in chosen:
        slot, time = int(rows.slot[row]), float(rows.time[row])
        if slot not in filters:
            one = ExtendedKalmanFilter(dim_x=4, dim_z=2)
            one.x = np.array([*load.position[slot], 0.0, 0.0])
            one.P = np.diag([1e6, 1e6, 1e5, 1e5])
            filters[slot] = (time, one)
            continue
        last, one = filters[slot]
        one.F, one.Q = transition(time - last), process_noise(time - last, 4.0)
        one.predict()
        seen = predict_polar(plane, sites[rows.sensor[row]], one.x[0], one.x[1], 9000.0)
        jacobian = np.array([[seen[2], seen[3], 0.0, 0.0], [seen[4], seen[5], 0.0, 0.0]])
        one.update(
            rows.z[row], lambda _, j=jacobian: j, lambda _, s=seen: np.array(s[:2]), R=noise,
            residual=_residual,
        )  # fmt: skip
        filters[slot] = (time, one)
    return (perf_counter() - begin) / len(chosen) * 1e9


def _residual(seen: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    difference = seen - expected
    difference[1] = (difference[1] + np.pi) % (2.0 * np.pi) - np.pi
    return difference
