"""Makes recordings not used for tuning: flights under randomly drawn radars, and hostile ones.

Flights come from files of ADS-B reports (JSON, plain or gzipped: a list of objects with
`timestamp` in ms, `icao24`, `latitude`, `longitude`, `altitude` in ft, and `groundspeed` in kt or
without), or are simulated where no file is given. Everything follows from the seed.
"""

import gzip
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.model import (
    PARAMETERS,
    Aircraft,
    Bias,
    ClutterBurst,
    Scenario,
    Sensor,
    Traffic,
    Waypoints,
)
from multiradar.simulation.scenario.sensors_text import sensors_text

FOOT_M = 0.3048
KNOT_MPS = 0.514444
#: Minimum time between reports, s; a longer gap than this ends a flight, s.
STEP_S = 4.0
SILENCE_S = 120.0
#: Range of speeds between successive reports of an airborne aircraft.
FASTEST_MPS = 350.0
SLOWEST_MPS = 30.0
#: Maximum relative difference of the speed between reports from the reported speed.
SPEED_PART = 0.25
CENTRE_DEG = (46.8, 8.2)


@dataclass(frozen=True)
class Flight:
    """Reports of one aircraft without a long gap: (n, 4) time, latitude, longitude, height."""

    address: int
    reports: "np.typing.NDArray[np.float64]"


@dataclass(frozen=True)
class Recording:
    """A recording with its truth.

    Attributes
    ----------
    name : str
        Name of the hostile condition, or number.
    measurements, truth : DataFrame
        As `simulate` writes them.
    sensors : str
        Text of the sensors file.
    periods_s : dict
        True scan periods of the radars, s.
    """

    name: str
    measurements: pl.DataFrame
    truth: pl.DataFrame
    sensors: str
    periods_s: dict[str, float]


def read_flights(path: Path) -> list[Flight]:
    """Return the flights of a file of ADS-B reports."""
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rt", encoding="utf-8") as file:
        rows = json.load(file)
    names = ("timestamp", "latitude", "longitude", "altitude")
    found: dict[int, list[tuple[float, ...]]] = {}
    for row in rows:
        slow = (row.get("groundspeed") or np.inf) * KNOT_MPS < SLOWEST_MPS
        if slow or any(row.get(name) is None for name in names):
            continue
        at, latitude, longitude, height = (float(row[name]) for name in names)
        speed = float(row.get("groundspeed") or np.nan) * KNOT_MPS
        found.setdefault(int(row["icao24"], 16), []).append(
            (at / 1000.0, latitude, longitude, height * FOOT_M, speed)
        )
    return [
        Flight(address, part)
        for address, reports in sorted(found.items())
        for part in _parts(np.array(sorted(reports)))
    ]


def _parts(reports: "np.typing.NDArray[np.float64]") -> list["np.typing.NDArray[np.float64]"]:
    parts: list[list[np.typing.NDArray[np.float64]]] = [[reports[0]]]
    for one in reports[1:]:
        last = parts[-1][-1]
        since = one[0] - last[0]
        if since > SILENCE_S:
            parts.append([one])
        elif since >= STEP_S and _continues(last, one):
            parts[-1].append(one)
        elif since >= STEP_S and len(parts[-1]) == 1:
            # Of the first two, the first is more probably a stale one.
            parts[-1] = [one]
    return [np.array(part)[:, :4] for part in parts if len(part) >= 6]


def _continues(last: "np.typing.NDArray[np.float64]", one: "np.typing.NDArray[np.float64]") -> bool:
    # Recordings repeat positions or report stale ones: the distance must fit the speed.
    north = np.radians(one[1] - last[1])
    east = np.radians(one[2] - last[2]) * np.cos(np.radians(one[1]))
    speed = np.hypot(east, north) * 6.37e6 / (one[0] - last[0])
    reported = 0.5 * (one[4] + last[4])
    fits = np.isnan(reported) or abs(speed - reported) <= SPEED_PART * reported
    return bool(SLOWEST_MPS <= speed <= FASTEST_MPS and fits)


def recording(name: str, seed: int, flights: list[Flight], duration_s: float) -> Recording:
    """Make a recording: one of `HOSTILE`, or with any other name radars drawn from the seed."""
    rng = np.random.Generator(np.random.PCG64([7, seed]))
    scene = _scene(seed, flights, duration_s, rng)
    if name in HOSTILE:
        scene = HOSTILE[name](scene)
    seen = observe(scene, np.random.Generator(np.random.PCG64([8, seed])))
    text = sensors_text(scene)
    measurements, truth = measurements_frame(scene, seen), truth_frame(scene, seen)
    if name == "no-turns":
        text = "\n".join(line for line in text.split("\n") if "rotation_period_s" not in line)
    if name == "clocks-back":
        measurements, truth = _clocks_back(measurements, truth)
    shown = truth.with_columns(
        track_number=pl.when(pl.col("outlier")).then(None).otherwise(pl.col("track_number"))
    )
    periods = {
        one.identifier: one.rotation_period_s or one.interval_s
        for one in scene.sensors
        if one.kind == "radar"
    }
    return Recording(name, measurements, shown, text, periods)


def _scene(
    seed: int, flights: list[Flight], duration_s: float, rng: np.random.Generator
) -> Scenario:
    count = int(rng.integers(2, 6))
    centre = CENTRE_DEG
    if flights:
        every = np.concatenate([one.reports for one in flights])
        begin = float(rng.choice(every[:, 0]))
        begin = min(begin, every[:, 0].max() - duration_s)
        centre = (float(np.median(every[:, 1])), float(np.median(every[:, 2])))
    centre_rad = (float(np.radians(centre[0])), float(np.radians(centre[1])))
    scene = Scenario(
        title="unseen", seed=seed, duration_s=duration_s, plane="wgs84", centre_rad=centre_rad,
        aircraft=(), traffic=() if flights else (_traffic(rng),),
        sensors=tuple(_radar(f"radar-{number}", rng) for number in range(count)),
        start_time_s=28_800.0,
    )  # fmt: skip
    if flights:
        scene = replace(scene, aircraft=_aircraft(flights, begin, duration_s, centre_rad, rng))
    return scene


def _aircraft(
    flights: list[Flight], begin_s: float, duration_s: float, centre_rad: tuple[float, float],
    rng: np.random.Generator,
) -> tuple[Aircraft, ...]:  # fmt: skip
    plane = SystemPlane(*centre_rad)
    found: list[Aircraft] = []
    for flight in flights:
        at = flight.reports[:, 0] - begin_s
        if at[-1] <= 30.0 or at[0] >= duration_s - 30.0:
            continue
        east, north = plane.to_plane(*np.radians(flight.reports[:, 1:3]).T)
        height = flight.reports[:, 3]
        found.append(
            Aircraft(
                track_number=len(found) + 1, east_m=0.0, north_m=0.0, height_m=0.0, speed_mps=0.0,
                heading_rad=0.0, start_s=max(float(at[0]), 0.0),
                end_s=min(float(at[-1]), duration_s),
                waypoints=Waypoints(*(tuple(one.tolist()) for one in (at, east, north, height))),
                # Codes are assigned by country and sector: some occur twice.
                mode_3a=int(rng.integers(0o1000, 0o1400)), mode_s_address=flight.address,
                height_step_m=float(rng.choice([7.62, 30.48])),
            )
        )  # fmt: skip
    return tuple(found)


def _traffic(rng: np.random.Generator) -> Traffic:
    return Traffic(
        count=int(rng.integers(25, 70)), east_m=(-150e3, 150e3), north_m=(-110e3, 110e3),
        height_m=(600.0, 12e3), speed_mps=(70.0, 260.0), heading_rad=(0.0, 2.0 * np.pi),
        start_s=(-600.0, 900.0), life_s=(600.0, 1800.0), leg_s=(20.0, 150.0),
        turn_rate_rad_per_s=(0.005, 0.025), acceleration_mps2=(-0.5, 0.5), climb_mps=(-8.0, 8.0),
        height_step_m=7.62,
    )  # fmt: skip


def _radar(name: str, rng: np.random.Generator) -> Sensor:
    biases = [Bias()] * PARAMETERS
    biases[PARAMETER_RANGE_OFFSET] = Bias(value=float(rng.normal(0.0, 250.0)))
    biases[PARAMETER_AZIMUTH_OFFSET] = Bias(value=float(np.radians(rng.normal(0.0, 0.2))))
    return Sensor(
        name, "radar", east_m=float(rng.uniform(-150e3, 150e3)),
        north_m=float(rng.uniform(-100e3, 100e3)), height_m=float(rng.uniform(100.0, 2000.0)),
        range_sigma_m=float(rng.uniform(20.0, 90.0)),
        azimuth_sigma_rad=float(np.radians(rng.uniform(0.04, 0.14))),
        rotation_period_s=float(np.round(rng.uniform(3.9, 12.0), 2)),
        range_max_m=float(rng.uniform(120e3, 350e3)), elevation_max_rad=float(np.radians(45.0)),
        horizon=True, detection_probability=float(rng.uniform(0.75, 0.99)),
        outlier_probability=float(rng.choice([0.0, 0.002, 0.01])),
        garbled_probability=0.01, garbled_height_probability=0.01,
        clutter_per_turn=float(rng.choice([0.0, 1.0, 5.0, 15.0])), biases=tuple(biases),
    )  # fmt: skip


def _each(**changes: object) -> Callable[[Scenario], Scenario]:
    def change(scene: Scenario) -> Scenario:
        return replace(
            scene,
            sensors=tuple(replace(one, **changes) for one in scene.sensors),  # type: ignore[arg-type]
        )

    return change


def _one_radar(scene: Scenario) -> Scenario:
    return replace(scene, sensors=(replace(scene.sensors[0], east_m=0.0, north_m=0.0),))


def _silent(scene: Scenario) -> Scenario:
    third = scene.duration_s / 3.0
    return replace(
        scene,
        sensors=tuple(
            # The first radar stops for a minute, later the others together for half a minute.
            replace(one, gaps_s=((third, third + 60.0),) if not number else
                    ((2.0 * third, 2.0 * third + 30.0),))
            for number, one in enumerate(scene.sensors)
        ),
    )  # fmt: skip


def _storm(scene: Scenario) -> Scenario:
    half = scene.duration_s / 2.0
    first = replace(scene.sensors[0], clutter_bursts=(ClutterBurst(half, half + 60.0, 400.0),))
    return replace(scene, sensors=(first, *scene.sensors[1:]))


def _overhead(scene: Scenario) -> Scenario:
    # All radars are inside the traffic, with a cone of silence from 45 degrees.
    rng = np.random.Generator(np.random.PCG64([9, scene.seed]))
    where = rng.uniform(-30e3, 30e3, (len(scene.sensors), 2)).tolist()
    return replace(
        scene,
        sensors=tuple(
            replace(one, east_m=east, north_m=north)
            for one, (east, north) in zip(scene.sensors, where, strict=True)
        ),
    )


def _one_height(scene: Scenario) -> Scenario:
    flat = tuple(
        one if one.waypoints is None else replace(
            one, waypoints=replace(one.waypoints, height_m=(9000.0,) * len(one.waypoints.height_m))
        )
        for one in scene.aircraft
    )  # fmt: skip
    return replace(
        scene, aircraft=flat,
        traffic=tuple(
            replace(one, height_m=(9000.0, 9000.1), climb_mps=(0.0, 0.0), count=2 * one.count)
            for one in scene.traffic
        ),
    )  # fmt: skip


def _huge_biases(scene: Scenario) -> Scenario:
    rng = np.random.Generator(np.random.PCG64([10, scene.seed]))
    sensors = []
    for one in scene.sensors:
        biases = list(one.biases)
        signs = rng.choice([-1.0, 1.0], 2)
        biases[PARAMETER_RANGE_OFFSET] = Bias(value=2000.0 * float(signs[0]))
        biases[PARAMETER_AZIMUTH_OFFSET] = Bias(value=float(np.radians(2.0 * signs[1])))
        sensors.append(replace(one, biases=tuple(biases)))
    return replace(scene, sensors=tuple(sensors))


#: Hostile conditions.
HOSTILE: dict[str, Callable[[Scenario], Scenario]] = {
    "no-turns": lambda scene: scene,
    "one-radar": _one_radar,
    "slow-radars": _each(rotation_period_s=12.0),
    "primary-only": _each(received=frozenset(), clutter_per_turn=10.0),
    "clutter": _each(clutter_per_turn=50.0),
    "detection-0.6": _each(detection_probability=0.6),
    "clocks-back": lambda scene: scene,
    "silent": _silent,
    "storm": _storm,
    "overhead": _overhead,
    "one-height": _one_height,
    "huge-biases": _huge_biases,
}


def _clocks_back(
    measurements: pl.DataFrame, truth: pl.DataFrame
) -> tuple[pl.DataFrame, pl.DataFrame]:
    # 2 % of the plots of the first radar have a time stamp 8 to 40 s too early.
    rng = np.random.Generator(np.random.PCG64(11))
    hit = (measurements["sensor_id"] == "radar-0").to_numpy()
    hit &= rng.uniform(size=len(measurements)) < 0.02
    late = np.where(hit, rng.uniform(8.0, 40.0, len(measurements)), 0.0)
    moved = pl.col("time_s") - pl.Series(late)
    return measurements.with_columns(time_s=moved), truth.with_columns(time_s=moved)
