"""The plots of the coupled-motion study, from its rows."""

from collections.abc import Iterable, Sequence

import numpy as np

from multiradar.report.content import Plot, Series
from multiradar.research.studies.coupled_motion.models import (
    DRAWN,
    FRAME,
    PUBLISHED_TURN_RATES_RAD_PER_S,
    TRACKED,
    TURN_RATES_RAD_PER_S,
    Scenario,
)
from multiradar.research.studies.coupled_motion.rows import Row

#: Panel names of the paper's figures.
PANELS = ("1 a", "1 b", "3 a", "3 b")

BAND = ("band_low", "band_high")
#: The flights of model (5) with the turn rate of figure 3 a.
PUBLISHED_FLIGHTS = TRACKED[2 + TURN_RATES_RAD_PER_S.index(PUBLISHED_TURN_RATES_RAD_PER_S[0])]
HEADING_CAPTION = (
    "Lines: exact values, computed from the parameters; points: simulated. Only the parameters of "
    "the velocity frame are valid for every heading and separate along-track from cross-track "
    "acceleration."
)
CONSISTENCY_CAPTION = (
    "The process noise of the relative-speed model depends on the coordinate axes: its filter is "
    "nearly consistent at headings between the axes and loses track of aircraft that fly along an "
    "axis."
)
TURN_CAPTION = {
    "velocity_rms_mps": "RMS over all flights, excluding the first fifth of each flight. The lines "
    "for Cartesian and white acceleration coincide.",
    "position_rms_m": "",
    "nees": "1 for a consistent filter, above 1 if its covariance is too small.",
}


def plots(rows: Sequence[Row]) -> list[Plot]:
    """Return the plots; named ones go into the guide.

    Returns
    -------
    list of Plot
        Figures 1 and 3, accelerations by heading, errors in time, consistency by heading.
    """
    figures = [
        _figure(rows, scenario, panel) for scenario, panel in zip(DRAWN, PANELS, strict=True)
    ]
    return [
        *figures,
        *_headings(rows),
        *_by_turn_rate(rows),
        *_consistency(rows),
        _in_time(rows),
    ]


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
        caption="Horizontal trajectories, all starting from the origin at 100 m/s.",
        group=f"Figure {panel[0]}: model ({'5' if scenario.model == FRAME else '2'})",
        name=f"figure-{panel[0]}" if panel.endswith("b") else "",
    )


def _headings(rows: Sequence[Row]) -> Iterable[Plot]:
    of = [row for row in rows if row["part"] == "heading"]
    for setting in dict.fromkeys(row["setting"] for row in of):
        selected = [row for row in of if row["setting"] == setting]
        is_frame = selected[0]["model"] == FRAME
        yield Plot(
            f"{selected[0]['model']}: {setting}",
            "heading, °",
            "acceleration, m/s²",
            tuple(_along_and_across(selected)),
            caption=HEADING_CAPTION if is_frame else "",
            group="RMS acceleration over one interval, by heading",
        )


def _along_and_across(rows: Sequence[Row]) -> Iterable[Series]:
    for quantity, label in (
        ("acceleration_along_mps2", "along the track"),
        ("acceleration_across_mps2", "across the track"),
    ):
        points = [row for row in rows if row["quantity"] == quantity]
        heading = _numbers(points, "heading_deg")
        yield Series(label, heading, _numbers(points, "expected"), "line")
        simulated = _numbers(points, "value")
        yield Series(f"{label}, simulated", heading, simulated, "points", key=label)


def _by_turn_rate(rows: Sequence[Row]) -> Iterable[Plot]:
    flights = TRACKED[-len(TURN_RATES_RAD_PER_S) :]
    rates = np.degrees(TURN_RATES_RAD_PER_S)
    for quantity, title, unit, name in (
        ("velocity_rms_mps", "Velocity error", ", m/s", "velocity"),
        ("position_rms_m", "Position error", ", m", ""),
        ("nees", "NEES / 6", "", "nees"),
    ):
        found: dict[str, list[Row]] = {}
        for scenario in flights:
            for row in rows:
                if _is(row, scenario) and row["quantity"] == quantity and _is_mean(row):
                    found.setdefault(str(row["filter"]), []).append(row)
        series = [Series(one, rates, _numbers(of, "value")) for one, of in found.items()]
        if quantity == "nees":
            series.append(Series("expected", rates, np.ones(len(rates)), "reference"))
        yield Plot(
            title,
            "turn rate v_K, °/s",
            f"{title}{unit}",
            tuple(series),
            y_scale="log",
            caption=TURN_CAPTION[quantity],
            group="Flights of model (5), by turn rate",
            name=name,
        )


def _consistency(rows: Sequence[Row]) -> Iterable[Plot]:
    for scenario in (*TRACKED[:2], PUBLISHED_FLIGHTS):
        of = _tracking(rows, scenario, "nees", "heading_deg")
        series = [
            Series(name, _numbers(points, "heading_deg"), _numbers(points, "value"))
            for name, points in of.items()
        ]
        series.append(Series("expected", np.array([0.0, 345.0]), np.ones(2), "reference"))
        yield Plot(
            f"{scenario.model}, {scenario.setting}",
            "initial heading, °",
            "NEES / 6",
            tuple(series),
            y_scale="log",
            caption=CONSISTENCY_CAPTION if scenario.model == FRAME else "",
            group="NEES by initial heading, for each motion model",
        )


def _in_time(rows: Sequence[Row]) -> Plot:
    scenario = PUBLISHED_FLIGHTS
    series: list[Series] = []
    for name, points in _tracking(rows, scenario, "nees", "time_s").items():
        time, low, high = (_numbers(points, column) for column in ("time_s", *BAND))
        if not series:
            series.append(Series("95 % band", time, low, "band", y2=high))
        series.append(Series(name, time, _numbers(points, "value")))
    return Plot(
        f"Consistency over time: {scenario.model}, {scenario.setting}",
        "time, s",
        "NEES / 6",
        tuple(series),
        y_scale="log",
        caption="Mean over all flights, with the 95 % band for a consistent filter.",
    )


# Rows of a quantity with a time (or a heading), by filter.
def _tracking(
    rows: Sequence[Row], scenario: Scenario, quantity: str, by: str
) -> dict[str, list[Row]]:
    result: dict[str, list[Row]] = {}
    for row in rows:
        wanted = row["part"] == "tracking" and row["quantity"] == quantity
        if wanted and row[by] is not None and _is(row, scenario):
            result.setdefault(str(row["filter"]), []).append(row)
    return result


# A figure over the whole flight.
def _is_mean(row: Row) -> bool:
    return row["part"] == "tracking" and row["time_s"] is None and row["heading_deg"] is None


def _is(row: Row, scenario: Scenario) -> bool:
    return row["model"] == scenario.model and row["setting"] == scenario.setting


def _numbers(rows: Iterable[Row], column: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([row[column] for row in rows], np.float64)
