"""Plots of the manoeuvre-plane study, as figures 1 to 4 of the paper."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.report.content import Plot, Series
from multiradar.research.studies.manoeuvre_plane.runs import (
    PUBLISHED,
    RADII_M,
    RATE_HZ,
    SOURCES,
    TIMES_S,
    Case,
    path,
)
from multiradar.research.studies.time_series import Row, series_by_time
from multiradar.restoration.geometry.manoeuvre_plane import LEVEL

Floats = NDArray[np.float64]


def plots(rows: list[Row]) -> list[Plot]:
    """Draw the errors over time, the criterion and the path.

    Returns
    -------
    list of Plot
        Figures 3, 4, 2 and 1 of the paper, in this order.
    """
    return [
        _errors(rows, "normal_error_mrad", "Plane normal error", "mrad", figure=3, name="normal"),
        _errors(rows, "distance_error_m", "Plane distance error", "m", figure=4, name="distance"),
        _criterion(rows),
        _path(),
    ]


def _errors(
    rows: list[Row], quantity: str, title: str, unit: str, *, figure: int, name: str
) -> Plot:
    published = Series(
        "published", np.array(TIMES_S[-1:]), np.array([PUBLISHED[quantity]]), "rings",
        key="published",
    )  # fmt: skip
    return Plot(
        title=f"Figure {figure}: {title[0].lower()}{title[1:]}",
        x_label="t, s",
        y_label=f"{title[0].lower()}{title[1:]}, {unit}",
        series=(
            *(_line(rows, f"radius {radius:g} m", quantity, radius) for radius in RADII_M),
            published,
        ),
        y_scale="log",
        caption="Mean over runs. The paper gives only the final value of a single run.",
        name=name,
    )


def _criterion(rows: list[Row]) -> Plot:
    times = np.array(TIMES_S)
    exact = np.sqrt(2.0 * chi2.isf(LEVEL, np.round(times * RATE_HZ) - 3.0))
    return Plot(
        title="Figure 2: the published criterion",
        x_label="t, s",
        y_label="√(2 Λ)",
        series=(
            _line(rows, "√(2 Λ), mean over runs", "printed_statistic", RADII_M[0]),
            _line(rows, "√(2 N) + 2", "printed_threshold", RADII_M[0], "ink"),
            Series("exact, 0.3 %", times, np.asarray(exact), "dashed", key="exact"),
        ),
        caption=f"Radius {RADII_M[0]:g} m. Above the dashed line, the χ² test with N − 3 degrees "
        "of freedom rejects the plane.",
        name="criterion",
    )


def _path() -> Plot:
    flown = [
        1e-3 * path(Case(SOURCES[0], radius, 0.0))[:, [0, 2]] for radius in RADII_M
    ]  # fmt: skip
    return Plot(
        title="Figure 1: aircraft path",
        x_label="x, km",
        y_label="z, km",
        series=(
            *(
                Series(f"radius {radius:g} m", one[:, 0], one[:, 1], "track")
                for radius, one in zip(RADII_M, flown, strict=True)
            ),
            Series("radar", np.zeros(1), np.zeros(1), "points", key="ink"),
        ),
        equal_axes=True,
        caption="Path in the OXZ plane over 10 s, starting at the dot.",
        name="path",
    )


def _line(rows: list[Row], label: str, quantity: str, radius: float, key: str = "") -> Series:
    wanted: Row = {"part": "example", "radius_m": radius, "quantity": quantity}
    return series_by_time(rows, label, wanted, key)
