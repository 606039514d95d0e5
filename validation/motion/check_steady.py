"""Prints the table of steady flight of validation/steady-flight.md: noise of heading and speed.

::

    python -m validation.motion.check_steady  # two minutes
    python -m validation.motion.check_steady --runs 6 --scenes "one radar of 12 s, 150 to 400 km"

Aircraft fly straight at constant speed. One to six radars with scan periods of 4 to 12 s see them,
near and far. Biases are known, or estimated. For each aircraft the RMS error of heading and speed
from three minutes after the start of its track on; the table gives the median of the aircraft and
the worst tenth (90th percentile), and the mean error² / sigma² of the velocity, per dimension.

Rows: the filters as they are; `imm` with rarer manoeuvres (`imm_straight_s = 120`); a Kalman filter
of one mode with the constant process noise that is best for the position of manoeuvring aircraft
seen by the same radars; and the bound, the same filter with the noise of steady flight alone (0.003
m²/s³), which no filter that has to follow turns reaches.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.scenario.model import Aircraft, Scenario
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from validation.motion import check_manoeuvres
from validation.motion.check_gaps import scene as manoeuvring
from validation.motion.check_manoeuvres import Flown, Place

Floats = NDArray[np.float64]

DURATION_S = 1200.0
SETTLED_S = 180.0
#: Mean straight flight, s, between manoeuvres rarer than the default has them.
RARER_S = 120.0
#: Spectral density of steady flight, m²/s³.
STEADY_DENSITY = 0.003
# As in `check_manoeuvres.RADARS`.
EN_ROUTE: tuple[Place, ...] = (
    ("a", 46.0, 6.0, 1500.0, 12.0, 60.0, 0.08, 0.9, 460e3, 120.0, 0.1),
    ("b", 48.5, 12.0, 800.0, 10.0, 60.0, 0.08, 0.9, 460e3, -80.0, -0.12),
    ("c", 44.5, 9.5, 600.0, 12.0, 60.0, 0.07, 0.9, 460e3, 40.0, 0.05),
)
TERMINAL: tuple[Place, ...] = (
    ("d", 46.3, 7.0, 400.0, 4.0, 30.0, 0.06, 0.95, 200e3, 60.0, -0.08),
    ("e", 47.5, 8.5, 500.0, 4.8, 30.0, 0.06, 0.95, 200e3, -30.0, 0.06),
    ("f", 45.6, 8.7, 300.0, 5.0, 40.0, 0.07, 0.95, 200e3, 20.0, 0.03),
)
SCENES: tuple[tuple[str, tuple[Place, ...], tuple[float, float]], ...] = (
    ("one radar of 4 s, 20 to 100 km", TERMINAL[:1], (20e3, 100e3)),
    ("one radar of 12 s, 60 to 150 km", EN_ROUTE[:1], (60e3, 150e3)),
    ("one radar of 12 s, 150 to 400 km", EN_ROUTE[:1], (150e3, 400e3)),
    ("two radars of 10 and 12 s, 100 to 300 km", EN_ROUTE[:2], (100e3, 300e3)),
    ("three radars of 4 to 5 s, 20 to 120 km", TERMINAL, (20e3, 120e3)),
    ("six radars of 4 to 12 s, 20 to 200 km", EN_ROUTE + TERMINAL, (20e3, 200e3)),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=4, help="seeds")
    parser.add_argument("--aircraft", type=int, default=25, help="in each run")
    parser.add_argument("--scenes", nargs="+", default=[one[0] for one in SCENES])
    parser.add_argument("--estimated", action="store_true", help="biases are estimated")
    options = parser.parse_args()
    print(
        "| scenario | filter | heading, °: median, 90th percentile | speed, m/s | error² / sigma² |"
    )
    print("|---|---|---|---|---|")
    for name, places, away_m in (one for one in SCENES if one[0] in options.scenes):
        known = not options.estimated
        flown = [
            scene(seed, places, away_m, options.aircraft, known=known)
            for seed in range(options.runs)
        ]
        for title, settings in rows(places, away_m):
            print(f"| {name} | {title} | {' | '.join(figures(settings, flown))} |", flush=True)


def rows(
    places: tuple[Place, ...], away_m: tuple[float, float]
) -> list[tuple[str, TrackingSettings]]:
    """Return the filters of the table with their names."""
    turning = [manoeuvring(seed, places, away_m, 20) for seed in range(2)]
    best = check_manoeuvres.best_constant(turning, check_manoeuvres.DENSITIES)
    bound = replace(best, acceleration_density=STEADY_DENSITY)
    density = f"{best.acceleration_density:g} m²/s³"
    return [
        ("`imm`", TrackingSettings(filter_name="imm")),
        (f"`imm`, straight for {RARER_S:g} s", TrackingSettings(imm_straight_s=RARER_S)),
        ("`two-stage`", TrackingSettings(filter_name="two-stage")),
        (f"best constant noise, {density}", best),
        ("bound", bound),
    ]


def scene(
    seed: int,
    places: tuple[Place, ...],
    away_m: tuple[float, float],
    aircraft: int,
    *,
    known: bool,
) -> Flown:
    """Simulate aircraft in steady flight that start so far from the centre of the radars."""
    rng = np.random.Generator(np.random.PCG64([15, seed]))
    sensors = check_manoeuvres.table(known=known, places=places)
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    fliers = tuple(flier(number + 1, away_m, rng) for number in range(aircraft))
    simulated = Scenario(
        "", seed, DURATION_S, "wgs84", (plane.latitude_rad, plane.longitude_rad), fliers, (),
        check_manoeuvres.radars(plane, sensors, known=known, places=places),
    )  # fmt: skip
    made = observe(simulated, rng).measurements
    return Flown(
        sensors, check_manoeuvres.batch(made), made, np.zeros(len(made), np.int64), np.empty(0),
        fliers,
    )  # fmt: skip


def flier(number: int, away_m: tuple[float, float], rng: np.random.Generator) -> Aircraft:
    """Return an aircraft that flies straight across a ring around the centre."""
    away, bearing = rng.uniform(*away_m), rng.uniform(0.0, 2.0 * np.pi)
    return Aircraft(
        number, away * np.sin(bearing), away * np.cos(bearing), rng.uniform(8e3, 12e3),
        rng.uniform(150.0, 250.0), rng.uniform(0.0, 2.0 * np.pi),
    )  # fmt: skip


def figures(settings: TrackingSettings, flown: Sequence[Flown]) -> tuple[str, str, str]:
    """Return the cells of a row: heading, speed, error² / sigma²."""
    results = [errors_of(settings, one) for one in flown]
    heading, speed, nees = (np.concatenate([one[i] for one in results]) for i in range(3))
    return (
        f"{np.median(heading):.2f}, {np.quantile(heading, 0.9):.2f}",
        f"{np.median(speed):.2f}, {np.quantile(speed, 0.9):.2f}",
        f"{np.mean(nees):.2f}",
    )


def errors_of(settings: TrackingSettings, one: Flown) -> tuple[Floats, Floats, Floats]:
    """Return by aircraft the RMS of heading (°) and speed (m/s) errors, and error² / sigma²."""
    engine = Engine(one.sensors, settings)
    updates = TrackUpdates.concatenate([engine.push(one.batch).updates, engine.flush().updates])
    keys = zip(one.rows.time_s, one.rows.sensor, one.rows.aircraft, strict=True)
    place = {key: row for row, key in enumerate(keys)}
    found = zip(updates.time_s, updates.sensor, updates.track_number - 1, strict=True)
    row = np.array([place[key] for key in found])
    true_heading, true_speed = one.rows.true_heading_rad[row], one.rows.true_speed_mps[row]
    turned = np.degrees((updates.heading_rad - true_heading + np.pi) % (2.0 * np.pi) - np.pi)
    faster = updates.speed_mps - true_speed
    across = 2.0 * np.sqrt(updates.speed_mps * true_speed) * np.sin(np.radians(turned) / 2.0)
    nees = (across**2 + faster**2) / updates.velocity_sigma_mps**2
    kept = updates.time_s > SETTLED_S
    parts = [
        (turned[own] ** 2, faster[own] ** 2, nees[own])
        for number in np.unique(updates.track_number[kept])
        if (own := kept & (updates.track_number == number)).sum() >= 10
    ]
    means = np.array([[part.mean() for part in three] for three in parts])
    return np.sqrt(means[:, 0]), np.sqrt(means[:, 1]), means[:, 2]


if __name__ == "__main__":
    main()
