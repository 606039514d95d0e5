"""Prints a table of validation/forecasts.md: forecasts by the modes of motion, and by white noise.

::

    python -m validation.motion.check_forecasts  # two scenarios, under two minutes

The scenarios are those of check_manoeuvres.py, with estimated biases. Every seven seconds a track
is forecast 10, 30 and 60 s ahead and compared with the true position: RMS error, and error² /
sigma² of each axis (1 where the reported sigma is right), by the manoeuvre of the aircraft when the
forecast is made.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.gaussian import normalised_squared
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import Aircraft
from multiradar.tracking.forecast.forecast_of_modes import (
    density_of,
    forecast_modes_of,
    forecast_of_modes,
)
from multiradar.tracking.forecast.persistent_walk import propagate_straight
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import CLASSES, Flown, doing_at, flights

Floats = NDArray[np.float64]
Forecast = Callable[[TrackStates, int], tuple[Floats, Floats]]

AHEAD_S = np.array([10.0, 30.0, 60.0])
SETTLED_S = 60.0
EVERY_S = 7.0


@dataclass(frozen=True)
class Start:
    """An initial state of a forecast, and the truth of its aircraft."""

    states: TrackStates
    place: int
    aircraft: Aircraft
    path: Path


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2, help="seeds")
    parser.add_argument("--aircraft", type=int, default=30, help="in each run")
    parser.add_argument("--duration", type=float, default=900.0, help="of each run, s")
    options = parser.parse_args()
    flown = flights(
        options.runs, aircraft=options.aircraft, duration_s=options.duration, known=False
    )
    ahead = ", ".join(f"{one:g} s" for one in AHEAD_S)
    print(f"| forecast | {' | '.join(f'{name}: {ahead}' for name in CLASSES)} |")
    print("|" + "---|" * (1 + len(CLASSES)))
    two_stage = TrackingSettings(filter_name="two-stage")
    modes = TrackingSettings(filter_name="imm")
    frame = replace(two_stage, motion="velocity-frame", turn_rate_rad_per_s=0.05)
    for name, settings, by in (
        ("`two-stage`, white noise", two_stage, by_density(two_stage)),
        ("`two-stage`, `velocity-frame`, v_K = 0.05", frame, by_density(frame)),
        ("`imm`, white noise (not available to users)", modes, by_density(modes)),
        ("`imm`, its modes", modes, by_modes(modes)),
    ):
        started = [one for each in flown for one in starts(each, settings, options.duration)]
        print(row(name, started, by), flush=True)


def by_density(settings: TrackingSettings) -> Forecast:
    """Return the forecast of a constant velocity with noise."""

    def by(states: TrackStates, place: int) -> tuple[Floats, Floats]:
        one = states.at(np.array([place]))
        density = density_of(settings, one.mean[0, 2:]) * np.eye(2)
        means, covariances = propagate_straight(one.mean, one.covariance, density[None], AHEAD_S)
        return means[0], covariances[0]

    return by


def by_modes(settings: TrackingSettings) -> Forecast:
    """Return the forecast by the modes of motion."""
    table = forecast_modes_of(settings)

    def by(states: TrackStates, place: int) -> tuple[Floats, Floats]:
        assert states.modes is not None
        known = states.modes
        return forecast_of_modes(
            known.probability[place], known.mean[place], known.covariance[place], table, AHEAD_S
        )

    return by


def starts(one: Flown, settings: TrackingSettings, duration_s: float) -> list[Start]:
    """Return the states of all tracks, time after time."""
    engine = Engine(one.sensors, settings)
    # Legs are flown without random numbers.
    paths = [
        fly(flier, duration_s, np.random.Generator(np.random.PCG64(0))) for flier in one.fliers
    ]
    found: list[Start] = []
    number: dict[int, int] = {}
    cuts = np.searchsorted(
        one.batch.time_s, np.arange(SETTLED_S, duration_s - AHEAD_S[-1], EVERY_S)
    )
    before = 0
    for cut in cuts.tolist():
        updates = engine.push(one.batch.select(slice(before, cut))).updates
        number |= dict(zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True))
        before = cut
        states = engine.tracks()
        for place, track in enumerate(states.track_id.tolist()):
            if states.time_s[place] >= SETTLED_S:
                aircraft = number[track] - 1
                found.append(Start(states, place, one.fliers[aircraft], paths[aircraft]))
    return found


def row(name: str, started: list[Start], by: Forecast) -> str:
    """Return a row of the table."""
    errors, squares = np.empty((2, len(started), len(AHEAD_S)))
    doing = np.empty(len(started), np.int64)
    for i, one in enumerate(started):
        time_s = float(one.states.time_s[one.place])
        means, covariances = by(one.states, one.place)
        error = means[:, :2] - one.path.position(time_s + AHEAD_S)
        errors[i] = np.hypot(error[:, 0], error[:, 1])
        squares[i] = normalised_squared(error, covariances[:, :2, :2])
        doing[i] = doing_at(one.aircraft, time_s)
    cells = []
    for kinds in CLASSES.values():
        chosen = np.isin(doing, kinds)
        metres = np.sqrt(np.mean(errors[chosen] ** 2, axis=0))
        ratios = np.mean(squares[chosen], axis=0) / 2.0
        cells.append(", ".join(f"{m:.0f} m ({r:.2f})" for m, r in zip(metres, ratios, strict=True)))
    return f"| {name} | {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
