"""Plots of the bearing-only study: errors over time, consistency, and geometry."""

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Plot, Series
from multiradar.research.studies.bearing_only.runs import (
    BEARINGS,
    DURATION_S,
    EXTRAPOLATED,
    POSITION_FIXES,
    SCENARIOS,
    SCHEME_LABELS,
    SITES_M,
    START_M,
    VELOCITY_MPS,
)
from multiradar.research.studies.time_series import Row, series_by_time

Floats = NDArray[np.float64]


def plots(rows: list[Row]) -> list[Plot]:
    """Draw the errors of the first scenario, the NEES of its bearings, and the geometry.

    Returns
    -------
    list of Plot
        Position, velocity, NEES, geometry.
    """
    return [
        _errors(rows, "Position error", "position_rms_m", "m", "position"),
        _errors(rows, "Velocity error", "velocity_rms_mps", "m/s", "velocity"),
        _consistency(rows),
        _geometry(),
    ]


def _errors(rows: list[Row], title: str, quantity: str, unit: str, name: str) -> Plot:
    scenario = SCENARIOS[0]
    series = tuple(
        _series(rows, scheme, quantity) for scheme in (BEARINGS, POSITION_FIXES, EXTRAPOLATED)
    )
    return Plot(
        title=title,
        x_label="t, s",
        y_label=f"RMS error, {unit}",
        series=series,
        # Velocity errors fall by two decades after the start.
        y_scale="log" if quantity == "velocity_rms_mps" else "linear",
        y_limits=None if quantity == "velocity_rms_mps" else (0.0, 1.05 * _highest(series)),
        caption=f"Scenario {scenario.name}: {scenario.purpose}.",
        name=name,
    )


def _highest(series: tuple[Series, ...]) -> float:
    return max(float(one.y.max()) for one in series)


def _consistency(rows: list[Row]) -> Plot:
    band = next(row for row in rows if row["quantity"] == "nees" and row["time_s"] is not None)
    nees = _series(rows, BEARINGS, "nees")
    edges = [np.full(len(nees.x), float(band[name] or 0.0)) for name in ("band_low", "band_high")]
    return Plot(
        title="NEES of the bearings-only filter",
        x_label="t, s",
        y_label="NEES per dimension",
        series=(Series("95 % band", nees.x, edges[0], "band", edges[1]), nees),
        caption="Mean over runs at each time; errors within a run are correlated in time.",
        name="nees",
    )


def _geometry() -> Plot:
    path = START_M + np.array([0.0, DURATION_S])[:, None] * VELOCITY_MPS
    lines = [1e-3 * np.array([site, path[1]]) for site in SITES_M]
    return Plot(
        title="Geometry",
        x_label="east, km",
        y_label="north, km",
        series=(
            *(Series("final lines of sight", one[:, 0], one[:, 1], "thin") for one in lines),
            Series("sensors", 1e-3 * SITES_M[:, 0], 1e-3 * SITES_M[:, 1], "points", key="ink"),
            Series("aircraft", 1e-3 * path[:, 0], 1e-3 * path[:, 1], "track"),
        ),
        equal_axes=True,
        caption="Mean aircraft path, starting at the dot. Moving sensors are shown at their "
        "initial positions.",
        name="geometry",
    )


def _series(rows: list[Row], scheme: str, quantity: str) -> Series:
    wanted = {"scene": SCENARIOS[0].name, "scheme": scheme, "quantity": quantity}
    return series_by_time(rows, SCHEME_LABELS[scheme], wanted)
