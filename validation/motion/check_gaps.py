"""Prints the table of gaps of turns.md: error² / sigma² where scans are missed at far range.

::

    python -m validation.motion.check_gaps  # one minute
    python -m validation.motion.check_gaps --runs 12 --bank 45

Radars with a scan period of 10 or 12 s detect an aircraft in half of their scans. Aircraft fly
straight legs, turns with 10 to 25 degrees of bank, accelerations and decelerations of up to
0.6 m/s². Biases are known. Each cell gives the RMS position error and error² / sigma² (1 is
consistent): of straight legs and turns after the first minute of a track; of updates after gaps of
more than 30 s in turns; of the first minute of a track without its first plot; of all updates.
"""

import argparse

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.scenario.model import Aircraft, Leg, Scenario
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from validation.motion import check_manoeuvres
from validation.motion.check_manoeuvres import (
    GRAVITY_MPS2,
    SETTLED_S,
    STRAIGHT,
    TURN,
    Flown,
    Place,
    doing_at,
)

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

DURATION_S = 1800.0
LONG_GAP_S = 30.0
FILTERS = ("two-stage", "imm")
# As in `check_manoeuvres.RADARS`.
FAR: Place = ("far", 46.0, 6.0, 1500.0, 12.0, 60.0, 0.08, 0.5, 460e3, 0.0, 0.0)
OTHER: Place = ("other", 48.5, 12.0, 800.0, 10.0, 60.0, 0.08, 0.5, 460e3, 0.0, 0.0)
SCENES: tuple[tuple[str, tuple[Place, ...], tuple[float, float]], ...] = (
    ("one radar, 200 to 420 km", (FAR,), (200e3, 420e3)),
    ("one radar, 60 to 150 km", (FAR,), (60e3, 150e3)),
    ("two radars, 200 to 420 km", (FAR, OTHER), (200e3, 420e3)),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=6, help="seeds")
    parser.add_argument("--aircraft", type=int, default=20, help="in each run")
    parser.add_argument("--bank", type=float, default=25.0, help="steepest bank, degrees")
    parser.add_argument("--filters", nargs="+", default=FILTERS)
    options = parser.parse_args()
    print("| scenario | filter | straights | turns | turns, after a gap | first minute | all |")
    print("|---|---|---|---|---|---|---|")
    for name, places, away_m in SCENES:
        flown = [
            scene(seed, places, away_m, options.aircraft, bank_max_deg=options.bank)
            for seed in range(options.runs)
        ]
        for one in options.filters:
            found = figures(TrackingSettings(filter_name=one), flown)
            print(f"| {name} | `{one}` | {' | '.join(found.values())} |", flush=True)


def scene(
    seed: int,
    places: tuple[Place, ...],
    away_m: tuple[float, float],
    aircraft: int,
    *,
    bank_max_deg: float = 25.0,
) -> Flown:
    """Simulate a scenario with aircraft that start so far from its centre."""
    rng = np.random.Generator(np.random.PCG64([77, seed]))
    sensors = check_manoeuvres.table(known=True, places=places)
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    fliers = tuple(flier(number + 1, away_m, bank_max_deg, rng) for number in range(aircraft))
    simulated = Scenario(
        "", seed, DURATION_S, "wgs84", (plane.latitude_rad, plane.longitude_rad), fliers, (),
        check_manoeuvres.radars(plane, sensors, known=True, places=places),
    )  # fmt: skip
    rows = observe(simulated, rng).measurements
    doing = [
        doing_at(fliers[one], time) for one, time in zip(rows.aircraft, rows.time_s, strict=True)
    ]
    batch = check_manoeuvres.batch(rows)
    return Flown(sensors, batch, rows, np.array(doing), np.empty(0), fliers)


def flier(
    number: int, away_m: tuple[float, float], bank_max_deg: float, rng: np.random.Generator
) -> Aircraft:
    """Return an aircraft with random legs, at first across the line of sight."""
    away, bearing = rng.uniform(*away_m), rng.uniform(0.0, 2.0 * np.pi)
    speed = start = rng.uniform(180.0, 250.0)
    legs: list[Leg] = []
    while sum(leg.duration_s for leg in legs) < DURATION_S:
        legs.append(Leg(rng.uniform(90.0, 270.0)))
        if rng.uniform() < 0.3:
            change, time_s = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.6), rng.uniform(20, 50)
            if not 150.0 < speed + change * time_s < 270.0:
                change = -change
            legs.append(Leg(time_s, acceleration_mps2=change))
            speed += change * time_s
        else:
            rate = GRAVITY_MPS2 * np.tan(np.radians(rng.uniform(10.0, bank_max_deg))) / speed
            angle = np.radians(rng.uniform(20.0, 120.0))
            legs.append(Leg(angle / rate, rate * rng.choice([-1.0, 1.0])))
    heading = (bearing + np.pi / 2.0 + rng.uniform(-0.6, 0.6)) % (2.0 * np.pi)
    return Aircraft(
        number, away * np.sin(bearing), away * np.cos(bearing), rng.uniform(8e3, 12e3), start,
        heading, legs=tuple(legs),
    )  # fmt: skip


def figures(settings: TrackingSettings, flown: list[Flown]) -> dict[str, str]:
    """Return the cells of a row."""
    results = [errors_of(settings, one) for one in flown]
    error, sigma, doing, gap, age = (np.concatenate([one[i] for one in results]) for i in range(5))
    settled = age > SETTLED_S
    chosen: dict[str, Flags] = {
        "straights": settled & (doing == STRAIGHT),
        "turns": settled & (doing == TURN),
        "turns, after a gap": settled & (doing == TURN) & (gap > LONG_GAP_S),
        "first minute": ~settled & (age > 0.0),
        "all": age >= 0.0,
    }
    return {
        name: f"{np.sqrt(np.mean(error[rows] ** 2)):.0f} m, "
        f"{np.mean((error[rows] / sigma[rows]) ** 2):.2f}"
        for name, rows in chosen.items()
    }


def errors_of(settings: TrackingSettings, one: Flown) -> tuple[Floats, ...]:
    """Return error, sigma and manoeuvre, time since the last update, and age of the track."""
    engine = Engine(one.sensors, settings)
    updates = TrackUpdates.concatenate([engine.push(one.batch).updates, engine.flush().updates])
    keys = zip(one.rows.time_s, one.rows.sensor, one.rows.aircraft, strict=True)
    place = {key: row for row, key in enumerate(keys)}
    found = zip(updates.time_s, updates.sensor, updates.track_number - 1, strict=True)
    row = np.array([place[key] for key in found])
    east, north = engine.plane.to_plane(updates.latitude_rad, updates.longitude_rad)
    true_east, true_north = engine.plane.to_plane(
        one.rows.true_latitude_rad[row], one.rows.true_longitude_rad[row]
    )
    shape = engine.plane.local_matrix(true_east, true_north)
    off = np.einsum("nij,nj->ni", shape, np.column_stack([east - true_east, north - true_north]))
    first: dict[int, float] = {}
    last: dict[int, float] = {}
    gap, age = np.zeros(len(row)), np.zeros(len(row))
    for i, (track, time_s) in enumerate(zip(updates.track_id, updates.time_s, strict=True)):
        gap[i] = time_s - last.get(track, time_s)
        age[i] = time_s - first.setdefault(track, time_s)
        last[track] = time_s
    return np.hypot(*off.T), updates.position_sigma_m, one.doing[row], gap, age


if __name__ == "__main__":
    main()
