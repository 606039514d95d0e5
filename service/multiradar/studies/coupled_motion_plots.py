"""The plots of the coupled-motion study, from its rows."""

from collections.abc import Iterable, Sequence

import numpy as np

from multiradar.studies.coupled_motion_models import DRAWN, FRAME, RELATIVE, TRACKED, Scenario
from multiradar.studies.coupled_motion_rows import Row
from multiradar.studies.result import Plot, Series

#: What the paper calls the panels of its figures.
PANELS = ("1 a", "1 b", "3 a", "3 b")


def plots(rows: Sequence[Row]) -> list[Plot]:
    """Return the plots; those with a name go into the guide.

    Parameters
    ----------
    rows : sequence of dict
        Of the study.

    Returns
    -------
    list of Plot
        Figures 1 and 3, accelerations by heading, errors in time, consistency by heading.
    """
    figures = [
        _figure(rows, scenario, panel) for scenario, panel in zip(DRAWN, PANELS, strict=True)
    ]
    return [*figures, *_headings(rows), *_errors(rows), *_consistency(rows)]


def _figure(rows: Sequence[Row], scenario: Scenario, panel: str) -> Plot:
    of = [row for row in rows if row["part"] == "figure" and _is(row, scenario)]
    runs = sorted({row["run"] for row in of if row["run"] is not None}, key=float)
    series = []
    for run in runs:
        east = [row for row in of if row["run"] == run and row["quantity"] == "east_m"]
        north = [row for row in of if row["run"] == run and row["quantity"] == "north_m"]
        series.append(
            Series(
                "", _numbers(east, "value") / 1e3, _numbers(north, "value") / 1e3, "track",
                key=f"run {run}",
            )
        )  # fmt: skip
    return Plot(
        f"Figure {panel}: {scenario.setting}",
        "east, km",
        "north, km",
        tuple(series),
        equal_axes=True,
        caption="Trajectories on the plane, all from the origin at 100 m/s.",
        group=f"Figure {panel[0]}: model ({'5' if scenario.model == FRAME else '2'})",
        name=f"figure-{panel.replace(' ', '')}",
    )


def _headings(rows: Sequence[Row]) -> Iterable[Plot]:
    of = [row for row in rows if row["part"] == "heading"]
    for setting in dict.fromkeys(row["setting"] for row in of):
        ours = [row for row in of if row["setting"] == setting]
        series = []
        for quantity, label in (
            ("acceleration_along_mps2", "along the track"),
            ("acceleration_across_mps2", "across the track"),
        ):
            points = [row for row in ours if row["quantity"] == quantity]
            heading = _numbers(points, "heading_deg")
            series.append(Series(label, heading, _numbers(points, "expected"), "line"))
            series.append(
                Series(f"{label}, simulated", heading, _numbers(points, "value"), "points",
                       key=label)
            )  # fmt: skip
        yield Plot(
            f"{ours[0]['model']}: {setting}",
            "heading, °",
            "acceleration, m/s²",
            tuple(series),
            y_scale="log",
            caption="Only in the velocity frame do the parameters mean the same at every heading "
            "and tell along from across."
            if ours[0]["model"] == FRAME
            else "",
            group="Root mean square acceleration of one interval, by heading",
            name="heading-velocity-frame" if ours[0]["model"] == FRAME
            else "heading-relative" if ours[0]["model"] == RELATIVE else "",
        )  # fmt: skip


def _errors(rows: Sequence[Row]) -> Iterable[Plot]:
    for scenario in TRACKED:
        of = _tracking(rows, scenario, "velocity_rms_mps", "time_s")
        series = []
        for name, points in of.items():
            time = _numbers(points, "time_s")
            series.append(Series(name, time, _numbers(points, "value"), "line"))
            series.append(
                Series(f"{name}, claimed", time, _numbers(points, "expected"), "dashed", key=name)
            )
        strong = scenario is TRACKED[-1]
        yield Plot(
            f"{scenario.model}, {scenario.setting}",
            "time, s",
            "velocity error, m/s",
            tuple(series),
            y_scale="log",
            caption="Solid: root mean square error over the flights; dashed: what the filter "
            "claims." if strong else "",
            group="Velocity error of each filter, by what it tracks",
            name="velocity-error" if strong else "",
        )  # fmt: skip


def _consistency(rows: Sequence[Row]) -> Iterable[Plot]:
    for scenario in TRACKED:
        of = _tracking(rows, scenario, "nees", "heading_deg")
        series = [
            Series(name, _numbers(points, "heading_deg"), _numbers(points, "value"), "line")
            for name, points in of.items()
        ]
        if series:
            ends = np.array([0.0, 345.0])
            series.append(Series("expected", ends, np.ones(2), "reference"))
        yield Plot(
            f"{scenario.model}, {scenario.setting}",
            "initial heading, °",
            "NEES / 6",
            tuple(series),
            y_scale="log",
            caption="A filter whose noise follows the axes is right at some headings and wrong at "
            "others." if scenario.model == FRAME else "",
            group="Normalised error squared by initial heading, by what is tracked",
        )  # fmt: skip


# Rows of a quantity that have a time (or a heading), by filter.
def _tracking(
    rows: Sequence[Row], scenario: Scenario, quantity: str, by: str
) -> dict[str, list[Row]]:
    result: dict[str, list[Row]] = {}
    for row in rows:
        wanted = row["part"] == "tracking" and row["quantity"] == quantity
        if wanted and row[by] is not None and _is(row, scenario):
            result.setdefault(str(row["filter"]), []).append(row)
    return result


def _is(row: Row, scenario: Scenario) -> bool:
    return row["model"] == scenario.model and row["setting"] == scenario.setting


def _numbers(rows: Iterable[Row], column: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([row[column] for row in rows], np.float64)
