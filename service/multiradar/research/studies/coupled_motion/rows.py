"""The rows of the coupled-motion study, with the same columns for all parts."""

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Value
from multiradar.research.studies.coupled_motion.figures import (
    HEADINGS_RAD,
    HeadingSpread,
    Realisations,
    heading_band,
)
from multiradar.research.studies.coupled_motion.models import INTERVAL_S, Scenario
from multiradar.research.studies.coupled_motion.tracking import Tracked, nees_band, settled

Row = dict[str, Value]
Floats = NDArray[np.float64]

#: Number of times of a trajectory with rows.
MOMENTS = 30


def figure_rows(scenario: Scenario, made: Realisations) -> list[Row]:
    """Return the points of the drawn trajectories, then the statistics of all."""
    steps, runs = len(made.position_m) - 1, made.position_m.shape[1]
    rows = []
    for run in range(runs):
        for step in _moments(steps + 1):
            for axis, quantity in enumerate(("east_m", "north_m")):
                value = float(made.position_m[step, run, axis])
                rows.append(
                    _row("figure", scenario, quantity, value, run=run, time_s=step * INTERVAL_S)
                )
    statistics = {
        "acceleration_along_mps2": made.along_mps2,
        "acceleration_across_mps2": made.across_mps2,
        "speed_change_mps": made.speed_change_mps,
        "turned_deg": float(np.degrees(made.turned_rad)),
    }
    for quantity, value in statistics.items():
        rows.append(_row("figure", scenario, quantity, value, time_s=steps * INTERVAL_S))
    return rows


def heading_rows(spread: HeadingSpread) -> list[Row]:
    """Return the accelerations along and across at each heading."""
    low, high = heading_band()
    rows = []
    for quantity, values, exact in (
        ("acceleration_along_mps2", spread.along, spread.along_exact),
        ("acceleration_across_mps2", spread.across, spread.across_exact),
    ):
        for heading, value, expected in zip(HEADINGS_RAD, values, exact, strict=True):
            rows.append(
                _row(
                    "heading",
                    spread,
                    quantity,
                    float(value),
                    heading_deg=float(np.degrees(heading)),
                    expected=float(expected),
                    band=(low * float(expected), high * float(expected)),
                )
            )
    return rows


def tracking_rows(scenario: Scenario, name: str, found: Tracked, headings_rad: Floats) -> list[Row]:
    """Return errors and NEES: of the flights, then by initial heading, then by time."""
    means = {
        "position_rms_m": (found.position_squared, found.position_reported),
        "velocity_rms_mps": (found.velocity_squared, found.velocity_reported),
    }
    pairs = {
        quantity: (found.means(squared), found.means(reported))
        for quantity, (squared, reported) in means.items()
    }
    rows = []
    for quantity, (squared, reported) in pairs.items():
        value, expected = _rms(settled(squared)), _rms(settled(reported))
        rows.append(
            _row("tracking", scenario, quantity, value, filter_name=name, expected=expected)
        )
    value = float(found.nees_by_run.mean())
    rows.append(_row("tracking", scenario, "nees", value, filter_name=name, expected=1.0))
    rows += _rows_by_heading(scenario, name, found.nees_by_run, headings_rad)
    for step in _moments(len(found.nees)):
        time = (step + 1) * INTERVAL_S
        rows += [
            _row(
                "tracking",
                scenario,
                quantity,
                _rms(squared[step]),
                filter_name=name,
                time_s=time,
                expected=_rms(reported[step]),
            )
            for quantity, (squared, reported) in pairs.items()
        ]
        rows.append(
            _row(
                "tracking",
                scenario,
                "nees",
                float(found.means(found.nees)[step]),
                filter_name=name,
                time_s=time,
                expected=1.0,
                band=nees_band(len(found.nees_by_run)),
            )
        )
    return rows


# Flights by the nearest initial heading, where there are any.
def _rows_by_heading(
    scenario: Scenario, name: str, nees: Floats, headings_rad: Floats
) -> list[Row]:
    spacing = 2.0 * np.pi / len(HEADINGS_RAD)
    nearest = np.floor(headings_rad / spacing + 0.5).astype(int) % len(HEADINGS_RAD)
    return [
        _row(
            "tracking",
            scenario,
            "nees",
            float(nees[nearest == index].mean()),
            filter_name=name,
            heading_deg=float(np.degrees(heading)),
            expected=1.0,
        )
        for index, heading in enumerate(HEADINGS_RAD)
        if (nearest == index).any()
    ]


def _row(
    part: str,
    of: Scenario | HeadingSpread,
    quantity: str,
    value: float,
    *,
    filter_name: str | None = None,
    run: int | None = None,
    time_s: float | None = None,
    heading_deg: float | None = None,
    expected: float | None = None,
    band: tuple[float, float] | None = None,
) -> Row:
    return {
        "part": part,
        "model": of.model,
        "setting": of.setting,
        "filter": filter_name,
        "quantity": quantity,
        "run": run,
        "time_s": time_s,
        "heading_deg": heading_deg,
        "value": value,
        "expected": expected,
        "band_low": None if band is None else band[0],
        "band_high": None if band is None else band[1],
    }


def _moments(count: int) -> list[int]:
    times = np.linspace(0, count - 1, min(count, MOMENTS + 1))
    return sorted({round(time) for time in times.tolist()})


def _rms(squared: Floats) -> float:
    return float(np.sqrt(squared.mean()))
