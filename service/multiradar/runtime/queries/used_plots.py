"""The plots that updated a track, and what each contributed; innovations of radars."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import INNOVATION_BIASES, INNOVATION_COVARIANCE
from multiradar.estimation.measurement.kinds import KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.plot_rows import VARIANCES
from multiradar.runtime.queries.moment import Moment
from multiradar.runtime.queries.plot_coordinates import plot_coordinates
from multiradar.runtime.queries.track_windows import bias_estimates

#: Plots of all sensors that are read for the innovations of radars.
RESIDUALS_MAX = 50_000
RANGE_STEP_M, AZIMUTH_STEP_DEG = 25_000.0, 30.0

_KIND_NAMES = {KIND_RADAR: "radar", KIND_POSITION: "position"}

Floats = NDArray[np.float64]
Document = dict[str, Any]


def plots_of_track(known: Moment, track_id: int, *, window_s: float) -> Document | None:
    """Return the plots of a window before the last update of a live track.

    Parameters
    ----------
    known : Moment
        The data.
    track_id : int
        The track.
    window_s : float
        Length of the window, s.

    Returns
    -------
    dict or None
        The fields of `multiradar_schemas.products.track_plots.TrackPlots`; None for no such track.
    """
    window = known.window(track_id)
    if window is None:
        return None
    last_s = float(window.rows["time_s"][-1])
    rows = window.rows[window.rows["time_s"] >= last_s - window_s]
    sensors = known.sensors
    biases = bias_estimates(window.biases, len(sensors))
    columns = {
        **_measured(rows, biases, sensors),
        **_contributions(rows, known.tracking.downweight_nis),
        **_residuals(rows, biases, sensors),
    }
    return {
        "track_id": track_id,
        "time_s": last_s,
        "window_s": float(window_s),
        "plots": [
            dict(zip(columns, row, strict=True))
            for row in zip(*(_listed(column) for column in columns.values()), strict=True)
        ],
    }


def residuals_of_radars(known: Moment, *, window_s: float) -> Document:
    """Return the innovations of all radars by range and azimuth.

    Parameters
    ----------
    known : Moment
        The data.
    window_s : float
        Length of the window before the data time, s.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.products.residuals.Residuals`.
    """
    data_time_s = known.data_time_s
    rows, _, _ = known.plots_after(None, RESIDUALS_MAX)
    since_s = -np.inf if data_time_s is None else data_time_s - window_s
    rows = rows[(rows["kind"] == KIND_RADAR) & (rows["time_s"] >= since_s)]
    rows = rows[np.isfinite(rows["innovation"][:, 0])]
    found = []
    for sensor in np.unique(rows["sensor"]).tolist():
        own = rows[rows["sensor"] == sensor]
        nis, _ = _nis(own)
        azimuth_deg = np.degrees(own["azimuth_rad"])
        found.append(
            {
                "sensor_id": known.sensors.ids[sensor],
                "plots": len(own),
                "by_range": _bins(own, nis, own["range_m"], RANGE_STEP_M),
                "by_azimuth": _bins(own, nis, azimuth_deg, AZIMUTH_STEP_DEG),
            }
        )
    return {"time_s": data_time_s, "window_s": float(window_s), "sensors": found}


def _measured(rows: NDArray[np.void], biases: Floats, sensors: SensorTable) -> dict[str, Any]:
    range_m, azimuth_rad = polar_without_biases(
        rows["range_m"], rows["azimuth_rad"], biases[rows["sensor"]]
    )
    turn_deg = np.degrees(rows["azimuth_rad"] - azimuth_rad)
    return {
        "time_s": rows["time_s"],
        "sensor_id": [sensors.ids[number] for number in rows["sensor"].tolist()],
        "kind": [_KIND_NAMES.get(kind, "bearing") for kind in rows["kind"].tolist()],
        "range_m": rows["range_m"],
        "azimuth_deg": np.degrees(rows["azimuth_rad"]),
        "height_m": rows["height_m"],
        "range_bias_m": rows["range_m"] - range_m,
        "azimuth_bias_deg": np.mod(turn_deg + 180.0, 360.0) - 180.0,
    }


def _contributions(rows: NDArray[np.void], downweight_nis: float) -> dict[str, Any]:
    innovation = rows["innovation"].astype(np.float64)
    known = np.isfinite(innovation[:, 0])
    radar, reported = rows["kind"] == KIND_RADAR, rows["kind"] == KIND_POSITION
    nis, freedom = _nis(rows)
    return {
        "innovation_range_m": np.where(radar & known, innovation[:, 0], np.nan),
        "innovation_azimuth_deg": np.where(~reported & known, np.degrees(innovation[:, 1]), np.nan),
        "innovation_east_m": np.where(reported & known, innovation[:, 0], np.nan),
        "innovation_north_m": np.where(reported & known, innovation[:, 1], np.nan),
        "nis": nis,
        "degrees_of_freedom": freedom,
        "weight": _weights(rows, nis, freedom, downweight_nis),
    }


def _residuals(rows: NDArray[np.void], biases: Floats, sensors: SensorTable) -> dict[str, Any]:
    latitude, longitude = plot_coordinates(rows, biases, sensors)
    last = rows[-1]
    plane = SystemPlane(float(last["track_latitude_rad"]), float(last["track_longitude_rad"]))
    east, north = np.full((2, len(rows)), np.nan)
    placed = np.flatnonzero(np.isfinite(latitude))
    if len(placed):
        plot = plane.to_plane(latitude[placed], longitude[placed])
        track = plane.to_plane(
            rows["track_latitude_rad"][placed], rows["track_longitude_rad"][placed]
        )
        east[placed], north[placed] = plot[0] - track[0], plot[1] - track[1]
    return {
        "latitude_deg": np.degrees(latitude),
        "longitude_deg": np.degrees(longitude),
        "residual_east_m": east,
        "residual_north_m": north,
    }


def _covariances(rows: NDArray[np.void]) -> tuple[Floats, Floats]:
    # S as (n, 2, 2), and the noise as (n, 2).
    innovation = rows["innovation"].astype(np.float64)
    upper = innovation[:, INNOVATION_COVARIANCE:INNOVATION_BIASES]
    covariance = upper[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    return covariance, innovation[:, VARIANCES]


def _nis(rows: NDArray[np.void]) -> tuple[Floats, NDArray[np.int64]]:
    """Return the normalised innovations squared, NaN without one, and degrees of freedom."""
    innovation = rows["innovation"].astype(np.float64)
    covariance, _ = _covariances(rows)
    # The contribution of uncertain biases is recorded where it matters: for large innovations.
    biases = np.nan_to_num(innovation[:, INNOVATION_BIASES : INNOVATION_BIASES + 3])
    covariance = covariance + biases[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    e0, e1 = innovation[:, 0], innovation[:, 1]
    s00, s01, s11 = covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 1, 1]
    both = (rows["kind"] == KIND_RADAR) | (rows["kind"] == KIND_POSITION)
    with np.errstate(divide="ignore", invalid="ignore"):
        full = (s11 * e0 * e0 - 2.0 * s01 * e0 * e1 + s00 * e1 * e1) / (s00 * s11 - s01 * s01)
        nis = np.where(both, full, e1 * e1 / s11)
    return np.where(np.isfinite(e0) & np.isfinite(nis), nis, np.nan), np.where(both, 2, 1)


def _weights(
    rows: NDArray[np.void], nis: Floats, freedom: NDArray[np.int64], downweight_nis: float
) -> Floats:
    """Return the influence of each plot: 1 - tr(W S⁻¹) / d, W enlarged for outliers.

    References
    ----------
    Cardinali, Pezzulli and Andersson, Influence-matrix diagnostic of a data assimilation system,
    Q. J. R. Meteorol. Soc. 130 (2004), equation (2.9); the filters enlarge W by the normalised
    innovation squared over `downweight_nis`.
    """
    covariance, noise = _covariances(rows)
    factor = np.maximum(1.0, nis / downweight_nis) - 1.0
    s00 = covariance[:, 0, 0] + factor * noise[:, 0]
    s11 = covariance[:, 1, 1] + factor * noise[:, 1]
    s01 = covariance[:, 0, 1]
    w0, w1 = ((factor + 1.0) * noise[:, i] for i in range(2))
    with np.errstate(divide="ignore", invalid="ignore"):
        of_two = (w0 * s11 + w1 * s00) / (s00 * s11 - s01 * s01) / 2.0
        ignored = np.where(freedom == 2, of_two, w1 / s11)
    found = np.clip(1.0 - ignored, 0.0, 1.0)
    return np.where(np.isfinite(nis), found, np.nan)


def _bins(rows: NDArray[np.void], nis: Floats, values: Floats, step: float) -> list[Document]:
    number = np.floor(values / step).astype(np.int64)
    numbers, of_row, counts = np.unique(number, return_inverse=True, return_counts=True)
    range_m = rows["innovation"][:, 0].astype(np.float64)
    azimuth_deg = np.degrees(rows["innovation"][:, 1].astype(np.float64))

    def mean(column: Floats) -> Floats:
        return np.bincount(of_row, column, len(numbers)) / counts

    columns = {
        "begin": numbers * step,
        "end": (numbers + 1) * step,
        "plots": counts,
        "range_mean_m": mean(range_m),
        "range_rms_m": np.sqrt(mean(range_m**2)),
        "azimuth_mean_deg": mean(azimuth_deg),
        "azimuth_rms_deg": np.sqrt(mean(azimuth_deg**2)),
        "nis_mean": mean(nis),
    }
    return [
        dict(zip(columns, row, strict=True))
        for row in zip(*(column.tolist() for column in columns.values()), strict=True)
    ]


def _listed(column: Any) -> list[Any]:
    """Return a column as JSON values: None for NaN."""
    if isinstance(column, list):
        return column
    if column.dtype.kind != "f":
        return list(column.tolist())
    return [value if np.isfinite(value) else None for value in column.tolist()]
