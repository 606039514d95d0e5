"""Prints the table of manoeuvres of guide/motion.md: interacting modes against one motion model.

::

    python -m validation.motion.check_manoeuvres  # both tables, eight seeds, a minute
    python -m validation.motion.check_manoeuvres --modes 3 6 8 --extent 100e3 --straight 200

Aircraft fly legs: straight ones, turns with 10 to 30 degrees of bank, accelerations and
decelerations of up to 0.6 m/s², climbs. The radars are those of the sample recording. `two-stage`
uses constant process noise; the best of many densities over the whole scenario is chosen. The
tables give RMS position errors and error² / sigma² of the updates after the first minute, and the
final error² / sigma² of all biases together, per parameter.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.estimation.gaussian import normalised_squared
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import reported_data
from multiradar.simulation.scenario.model import Aircraft, Bias, Leg, Scenario, Sensor
from multiradar.simulation.scenario.reported_data import Atmosphere, RegisterReports
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire.aircraft_columns import aircraft_data_of
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

GRAVITY_MPS2 = 9.80665
SETTLED_S = 60.0
DENSITIES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 5.0, 10.0, 15.0, 20.0, 30.0)
Place = tuple[str, float, float, float, float, float, float, float, float, float, float]
# Latitude, longitude, height, scan period, sigmas of range and azimuth, Pd, largest range, biases.
RADARS = (
    ("26-10", 46.4247, 6.0994, 1677.0, 4.9, 40.0, 0.06, 0.97, 300e3, 185.0, -0.19),
    ("35-10", 47.4817, 8.3969, 866.0, 4.0, 35.0, 0.05, 0.98, 280e3, -120.0, 0.17),
    ("41-1", 45.6306, 8.7231, 240.0, 6.0, 80.0, 0.15, 0.8, 120e3, 60.0, -0.08),
    ("41-10", 45.6306, 8.7231, 240.0, 6.0, 50.0, 0.08, 0.95, 250e3, 60.0, -0.08),
)
STRAIGHT, TURN, SPEEDING = range(3)
CLASSES = {
    "straights": (STRAIGHT,),
    "turns": (TURN,),
    "changing speed": (SPEEDING,),
    "all": range(3),
}


@dataclass(frozen=True)
class Flown:
    """A scenario as input of the tracker, and for each row the manoeuvre of the aircraft."""

    sensors: SensorTable
    batch: MeasurementBatch
    rows: Measurements
    doing: Integers
    biases: Floats
    fliers: tuple[Aircraft, ...]


@dataclass(frozen=True)
class Figure:
    """Root mean square of errors, m, and mean of error² / sigma²; of biases the latter alone."""

    rms_m: float
    nees: float


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=8, help="seeds")
    parser.add_argument("--aircraft", type=int, default=30, help="in each run")
    parser.add_argument("--duration", type=float, default=1500.0, help="of each run, s")
    parser.add_argument("--extent", type=float, default=150e3, help="traffic begins within ±, m")
    parser.add_argument("--straight", type=float, default=120.0, help="mean straight leg, s")
    parser.add_argument("--modes", type=int, nargs="+", default=[3, 6, 8], help="of `imm`")
    options = parser.parse_args()
    for known in (True, False):
        print(f"biases {'known' if known else 'estimated'}: {', '.join(CLASSES)}, biases")
        flown = flights(
            options.runs, aircraft=options.aircraft, duration_s=options.duration, known=known,
            extent_m=options.extent, straight_s=options.straight,
        )  # fmt: skip
        best = best_constant(flown, DENSITIES)
        against = figures(best, flown)
        name = f"`two-stage`, constant {best.acceleration_density:g} m²/s³ (best)"
        print(row(name, against, against))
        as_it_is = figures(TrackingSettings(filter_name="two-stage"), flown)
        print(row("`two-stage` as it is", as_it_is, against))
        for modes in options.modes:
            settings = TrackingSettings(filter_name="imm", imm_modes=modes)
            print(row(f"`imm`, {modes} modes", figures(settings, flown), against), flush=True)


def row(name: str, found: dict[str, Figure], against: dict[str, Figure]) -> str:
    """Return a row of the table: the figures, and their change in per cent."""
    cells = [
        f"{found[one].rms_m:.1f} m ({found[one].rms_m / against[one].rms_m - 1.0:+.0%}), "
        f"{found[one].nees:.2f}"
        for one in CLASSES
    ]
    biases = found["biases"].nees
    return f"| {name} | {' | '.join(cells)} | {'–' if np.isnan(biases) else f'{biases:.2f}'} |"


def best_constant(flown: list[Flown], densities: Sequence[float]) -> TrackingSettings:
    """Return the constant process noise with the best result over the whole scenario."""
    plain = TrackingSettings(filter_name="two-stage", manoeuvre_factor_max=1.0)
    tried = [replace(plain, acceleration_density=density) for density in densities]
    return min(tried, key=lambda one: figures(one, flown)["all"].rms_m)


def figures(settings: TrackingSettings, flown: list[Flown]) -> dict[str, Figure]:
    """Return the figures of each class of motion, and those of the biases."""
    results = [errors_of(settings, one) for one in flown]
    errors, sigmas, doing = (np.concatenate([one[i] for one in results]) for i in range(3))
    found = {}
    for name, kinds in CLASSES.items():
        chosen = np.isin(doing, kinds)
        found[name] = Figure(
            float(np.sqrt(np.mean(errors[chosen] ** 2))),
            float(np.mean((errors[chosen] / sigmas[chosen]) ** 2)),
        )
    biases = np.concatenate([one[3] for one in results])
    found["biases"] = Figure(np.nan, float(np.mean(biases)) if len(biases) else np.nan)
    return found


def errors_of(settings: TrackingSettings, one: Flown) -> tuple[Floats, Floats, Integers, Floats]:
    """Return errors and sigmas of positions, manoeuvres, and the NEES of the biases."""
    engine = Engine(one.sensors, settings)
    parts = [engine.push(one.batch).updates, engine.flush().updates]
    updates = TrackUpdates.concatenate(parts)
    place = {
        key: row
        for row, key in enumerate(
            zip(one.rows.time_s, one.rows.sensor, one.rows.aircraft, strict=True)
        )
    }
    keys = zip(updates.time_s, updates.sensor, updates.track_number - 1, strict=True)
    row = np.array([place[key] for key in keys])
    north = 6.371e6 * (updates.latitude_rad - one.rows.true_latitude_rad[row])
    east = updates.longitude_rad - one.rows.true_longitude_rad[row]
    east *= 6.371e6 * np.cos(updates.latitude_rad)
    kept = updates.time_s > SETTLED_S
    biases = np.empty(0)
    if len(one.biases):
        state = engine.biases
        error = (state.estimate - one.biases) / state.scale
        scaled = state.covariance / np.outer(state.scale, state.scale)
        biases = np.array([float(normalised_squared(error, scaled)) / len(error)])
    errors = np.hypot(east, north)[kept]
    return errors, updates.position_sigma_m[kept], one.doing[row][kept], biases


def flights(
    runs: int,
    *,
    aircraft: int,
    duration_s: float,
    known: bool,
    extent_m: float = 150e3,
    straight_s: float = 120.0,
    first_seed: int = 0,
    bank_max_deg: float = 30.0,
    registers: RegisterReports | None = None,
    air: Atmosphere | None = None,
) -> list[Flown]:
    """Simulate scenarios; with known biases the radars have none.

    Registers change no other column.
    """
    found = []
    for seed in range(first_seed, first_seed + runs):
        rng = np.random.Generator(np.random.PCG64([2016, seed]))
        sensors = table(known=known)
        plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
        fliers = tuple(
            flier(number + 1, duration_s, extent_m, straight_s, rng, bank_max_deg=bank_max_deg)
            for number in range(aircraft)
        )
        scene = Scenario(
            "", seed, duration_s, "wgs84", (plane.latitude_rad, plane.longitude_rad), fliers, (),
            tuple(
                replace(one, aircraft_data=registers)
                for one in radars(plane, sensors, known=known)
            ),
            atmosphere=air or Atmosphere(),
        )  # fmt: skip
        observation = observe(scene, rng)
        rows = observation.measurements
        reports = reported_data(scene, observation).values.T if registers else ()
        reported = pl.DataFrame(dict(zip(MEASUREMENT_AIRCRAFT, reports, strict=False)))
        doing = [
            doing_at(fliers[one], time)
            for one, time in zip(rows.aircraft, rows.time_s, strict=True)
        ]
        biases = np.array([(one[9], np.radians(one[10])) for one in RADARS]).ravel()
        found.append(
            Flown(
                sensors,
                replace(batch(rows), aircraft_data=aircraft_data_of(reported)),
                rows,
                np.array(doing),
                biases[: 0 if known else None],
                fliers,
            )
        )
    return found


def radars(
    plane: SystemPlane, sensors: SensorTable, *, known: bool, places: Sequence[Place] = RADARS
) -> tuple[Sensor, ...]:
    """Return the true radars."""
    east, north = plane.to_plane(sensors.latitude_rad, sensors.longitude_rad)
    part = 0.0 if known else 1.0
    return tuple(
        Sensor(
            one[0], "radar", east[i], north[i], one[3], one[5], float(np.radians(one[6])),
            rotation_period_s=one[4], detection_probability=one[7], range_max_m=one[8],
            biases=(Bias(part * one[9]), Bias(part * float(np.radians(one[10]))), Bias(), Bias()),
        )
        for i, one in enumerate(places)
    )  # fmt: skip


def flier(
    number: int,
    duration_s: float,
    extent_m: float,
    straight_s: float,
    rng: np.random.Generator,
    *,
    bank_max_deg: float = 30.0,
) -> Aircraft:
    """Return an aircraft with random legs."""
    east, north = rng.uniform(-extent_m, extent_m, 2)
    speed = start = rng.uniform(90.0, 250.0)
    legs: list[Leg] = []
    while sum(leg.duration_s for leg in legs) < duration_s:
        climb = float(rng.choice([0.0, 0.0, 8.0, -8.0]))
        legs.append(Leg(rng.uniform(0.5, 1.5) * straight_s, climb_mps=climb))
        if rng.uniform() < 0.3:
            change = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.6)
            time_s = rng.uniform(20.0, 50.0)
            if not 80.0 < speed + change * time_s < 270.0:
                change = -change
            legs.append(Leg(time_s, acceleration_mps2=change, climb_mps=climb))
            speed += change * time_s
        else:
            rate = GRAVITY_MPS2 * np.tan(np.radians(rng.uniform(10.0, bank_max_deg))) / speed
            angle = np.radians(rng.uniform(20.0, 150.0))
            legs.append(Leg(angle / rate, rate * rng.choice([-1.0, 1.0])))
    return Aircraft(
        number, east, north, rng.uniform(3e3, 9e3), start, rng.uniform(0.0, 2.0 * np.pi),
        legs=tuple(legs),
    )  # fmt: skip


def doing_at(aircraft: Aircraft, time_s: float) -> int:
    """Return the manoeuvre of an aircraft at a time."""
    for leg in aircraft.legs:
        time_s -= leg.duration_s
        if time_s < 0.0:
            if leg.turn_rate_rad_per_s:
                return TURN
            return SPEEDING if leg.acceleration_mps2 else STRAIGHT
    return STRAIGHT


def table(*, known: bool, places: Sequence[Place] = RADARS) -> SensorTable:
    """Return the radars as configured for the tracker."""
    count = len(places)
    columns = np.array([one[1:9] for one in places]).T
    biased = 0 if known else count
    return SensorTable(
        ids=tuple(one[0] for one in places),
        kinds=np.full(count, KIND_RADAR, np.int8),
        latitude_rad=np.radians(columns[0]),
        longitude_rad=np.radians(columns[1]),
        height_m=columns[2],
        range_sigma_m=columns[4],
        azimuth_sigma_rad=np.radians(columns[5]),
        position_sigma_m=np.full(count, 30.0),
        range_max_m=columns[7],
        rotation_period_s=columns[3],
        parameter_sensor=np.repeat(np.arange(biased, dtype=np.int32), 2),
        parameter_kind=np.tile(np.array([0, 1], np.int8), biased),
        prior_mean=np.zeros(2 * biased),
        prior_sigma=np.tile([500.0, np.radians(0.5)], biased),
        drift=np.zeros(2 * biased),
    )


def batch(rows: Measurements) -> MeasurementBatch:
    """Return the measurements as input of the tracker."""
    aircraft = rows.aircraft.astype(np.int64)
    return MeasurementBatch(
        time_s=rows.time_s,
        sensor=rows.sensor,
        kind=np.full(len(rows), KIND_RADAR, np.int8),
        range_m=rows.range_m,
        azimuth_rad=rows.azimuth_rad,
        latitude_rad=rows.latitude_rad,
        longitude_rad=rows.longitude_rad,
        height_m=rows.height_m,
        mode_3a=(0o1000 + aircraft).astype(np.int32),
        mode_s_address=0x400000 + aircraft,
        track_number=aircraft + 1,
        callsign=np.full(len(rows), -1, np.int64),
    )


if __name__ == "__main__":
    main()
