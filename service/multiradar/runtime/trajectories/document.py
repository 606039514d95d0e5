"""The published document of a trajectory bundle."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import OutsidePlaneError, TrajectoryError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.bundle.estimate import BEST, WEIGHTED, Trajectory
from multiradar.restoration.bundle.initial_arcs import TRIPLE_APART_M, TRIPLE_APART_S
from multiradar.restoration.bundle.path import Path
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import KIND_NAMES
from multiradar.runtime.trajectories.pool import Reading

Floats = NDArray[np.float64]

#: Minimum plots of a triple.
_TRIPLE = 3


def trajectories_of(
    track_id: int, reading: Reading, plane: SystemPlane, points: int, step_s: int
) -> dict[str, Any]:
    """Return the document of the bundle of a track.

    Parameters
    ----------
    track_id : int
        The track.
    reading : Reading
        Its bundle.
    plane : SystemPlane
        The plane of the bundle.
    points : int
        Maximum number of points of each path; earlier points are omitted.
    step_s : int
        Whole seconds between them; their times are multiples of it.

    Returns
    -------
    dict
        The fields of `Trajectories` of the schemas, without those of the track.

    Raises
    ------
    TrajectoryError
        If there are no trajectories yet: `TOO_FEW_PLOTS`, `NO_TRIPLE`; or if one leaves the plane:
        `NO_PLACE`.
    """
    bundle = reading.bundle
    require_tracks(bundle)
    begin_s, now_s = bundle.window_s
    times = step_s * np.arange(np.ceil(begin_s / step_s), np.floor(now_s / step_s) + 1.0)
    times = times[max(len(times) - points, 0) :]
    height_m = reading.height_m
    ground = _Ground(plane, 0.0 if np.isnan(height_m) else height_m)
    try:
        return {
            "track_id": track_id,
            "time_s": now_s,
            "window_begin_s": begin_s,
            "plots": reading.plots,
            "restarts": bundle.restarts,
            "height_m": None if np.isnan(height_m) else height_m,
            "estimate": ground.estimate(bundle.path([now_s], WEIGHTED)),
            "trajectories": [_trajectory(one, begin_s) for one in bundle.trajectories()],
            "best": ground.points(bundle.path(times, BEST)),
            "weighted": ground.points(bundle.path(times, WEIGHTED)),
        }
    except OutsidePlaneError as error:
        raise TrajectoryError("NO_PLACE", str(error)) from error


def require_tracks(bundle: Bundle) -> None:
    """Raise TrajectoryError with its reason if a bundle has no tracks."""
    if len(bundle):
        return
    expected = f"expected three plots {TRIPLE_APART_S:g} s and {TRIPLE_APART_M:g} m apart on an arc"
    if bundle.plots < _TRIPLE:
        raise TrajectoryError("TOO_FEW_PLOTS", f"{expected}, found {bundle.plots} plots")
    raise TrajectoryError("NO_TRIPLE", f"{expected}, found none in the last {bundle.plots} plots")


# Segments start within the window; those that end before it are omitted.
def _trajectory(one: Trajectory, begin_s: float) -> dict[str, Any]:
    begins = one.controls.begin_s.tolist()
    ends = [*begins[1:], None]
    columns = (
        begins, ends, one.kinds, one.controls.lateral_mps2.tolist(),
        one.controls.longitudinal_mps2.tolist(),
    )  # fmt: skip
    names = ("begin_s", "end_s", "kind", "lateral_mps2", "longitudinal_mps2")
    segments = [
        dict(zip(names, (max(begin, begin_s), *rest), strict=True))
        for begin, *rest in zip(*columns, strict=True)
        if rest[0] is None or rest[0] > begin_s
    ]
    return {"weight": one.weight, "segments": segments}


class _Ground:
    # Converts from the plane to degrees and true metres at a height.
    def __init__(self, plane: SystemPlane, height_m: float) -> None:
        self._plane, self._height_m = plane, height_m

    def points(self, path: Path) -> list[dict[str, float]]:
        if not len(path.time_s):
            return []
        latitude_deg, longitude_deg, velocity, covariance = self._true(path)
        columns = {
            "time_s": path.time_s,
            "latitude_deg": latitude_deg,
            "longitude_deg": longitude_deg,
            "position_sigma_m": np.sqrt(covariance[:, 0, 0] + covariance[:, 1, 1]),
            "speed_mps": np.hypot(velocity[:, 0], velocity[:, 1]),
            "heading_deg": _headings(velocity),
        }
        rows = np.column_stack(list(columns.values())).tolist()
        return [dict(zip(columns, row, strict=True)) for row in rows]

    def estimate(self, path: Path) -> dict[str, Any]:
        _, _, velocity, covariance = self._true(path)
        point: dict[str, Any] = dict(self.points(path)[0])
        return {
            **point,
            "velocity_east_mps": float(velocity[0, 0]),
            "velocity_north_mps": float(velocity[0, 1]),
            "covariance": covariance[0].ravel().tolist(),
            "lateral_mps2": float(path.lateral_mps2[0]),
            "longitudinal_mps2": float(path.longitudinal_mps2[0]),
            **{
                f"{name}_probability": float(path.kind_probability[0, kind])
                for kind, name in enumerate(KIND_NAMES)
            },
        }

    def _true(self, path: Path) -> tuple[Floats, Floats, Floats, Floats]:
        east_m, north_m = path.state[:, 0], path.state[:, 1]
        latitude_rad, longitude_rad = self._plane.to_geodetic(east_m, north_m)
        matrix = self._plane.local_matrix(east_m, north_m, self._height_m)
        velocity = np.einsum("kij,kj->ki", matrix, path.state[:, 2:])
        both = np.zeros((len(east_m), 4, 4))
        both[:, :2, :2] = both[:, 2:, 2:] = matrix
        covariance = both @ path.covariance @ both.transpose(0, 2, 1)
        return np.degrees(latitude_rad), np.degrees(longitude_rad), velocity, covariance


def _headings(velocity: Floats) -> Floats:
    heading_deg = np.degrees(np.arctan2(velocity[:, 0], velocity[:, 1])) % 360.0
    # A tiny negative angle rounds up to 360°.
    return np.where(heading_deg >= 360.0, 0.0, heading_deg)
