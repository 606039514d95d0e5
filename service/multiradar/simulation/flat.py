"""Plots of a scene on a flat plane, as arrays: what the studies of the report work on."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.simulation.biases import TrueBiases, walk_biases
from multiradar.simulation.observation.looks import Line, look_times, make_plots, wrapped
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.scene import Scene, Sensor
from multiradar.simulation.traffic import all_aircraft

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]

_GRID_S = 1.0


@dataclass(frozen=True, slots=True)
class FlatPlots:
    """Plots by ascending time stamp, then aircraft, then radar, and the truth.

    Attributes
    ----------
    time_s : (p,) float64
        Time stamps.
    aircraft, radar : (p,) int32
        Indices of who is seen and who sees.
    range_m, azimuth_rad : (p,) float64
        Measured distance on the plane, and azimuth clockwise from north, in [0, 2π).
    truth : (p, 4) float64
        True (east, north, their rates) of the aircraft at the time stamp.
    site_m : (m, 2) float64
        East and north of the radars.
    life_s : (n, 2) float64
        Birth and death (or end of the scene) of the aircraft.
    grid_s : (t,) float64
        0, 1, 2, … s, to the end of the scene.
    states : (t, n, 4) float64
        True states on the grid; before the birth and after the death those of these moments.
    biases : (t, m, 4) float64
        True range offset (m), azimuth offset (rad), range gain (1), time offset (s) on the grid.
    """

    time_s: Floats
    aircraft: Integers
    radar: Integers
    range_m: Floats
    azimuth_rad: Floats
    truth: Floats
    site_m: Floats
    life_s: Floats
    grid_s: Floats
    states: Floats
    biases: Floats

    def __len__(self) -> int:
        return len(self.time_s)


def flat_plots(scene: Scene, rng: np.random.Generator) -> FlatPlots:
    """Make all plots of a flat scene.

    Parameters
    ----------
    scene : Scene
        Its plane is `flat` and its sensors are radars. Its traffic is drawn from its own seed: the
        same in each call.
    rng : Generator
        For everything else: noise, detections, drift of the biases, random manoeuvres. It must
        be able to spawn (as those made from a seed are).

    Returns
    -------
    FlatPlots
        Measurements and truth.

    Raises
    ------
    ConfigurationError
        If the scene is not flat or has other sensors than radars.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.4), (1.5), (1.7) and section 1.6.
    """
    if scene.plane != "flat" or any(one.kind != "radar" for one in scene.sensors):
        msg = f"scene {scene.title!r}: expected a flat plane with radars alone, was another one"
        raise ConfigurationError(msg)
    bias_rng, phase_rng, *own = rng.spawn(2 + len(all_aircraft(scene)))
    biases = walk_biases(scene.sensors, scene.duration_s, bias_rng)
    phases = phase_rng.uniform(size=len(scene.sensors))
    paths: list[Path] = []
    rows: list[tuple[NDArray[np.float64], ...]] = []
    for one, (aircraft, stream) in enumerate(zip(all_aircraft(scene), own, strict=True)):
        paths.append(fly(aircraft, scene.duration_s, stream))
        rows.extend(
            _seen(sensor, (one, radar), paths[-1], (biases, float(phases[radar])), stream)
            for radar, sensor in enumerate(scene.sensors)
        )
    columns = [np.concatenate(column) for column in zip(*rows, strict=True)] or [np.empty(0)] * 9
    return _gathered(scene, paths, biases, columns)


# Columns of the plots of one aircraft by one radar: stamp, aircraft, radar, range, azimuth, truth.
def _seen(
    sensor: Sensor,
    pair: tuple[int, int],
    path: Path,
    truth: tuple[TrueBiases, float],
    rng: np.random.Generator,
) -> tuple[Floats, ...]:
    (aircraft, radar), (biases, phase) = pair, truth
    look = partial(_line, sensor, path)
    turning = sensor.rotation_period_s is not None
    times = look_times(sensor, phase if turning else 0.0, (path.start_s, path.end_s), look)
    plots, _ = make_plots(sensor, times, look, partial(biases.at, radar), rng)
    state = path.states(plots.time_s)
    count = len(plots.time_s)
    return (
        plots.time_s, np.full(count, float(aircraft)), np.full(count, float(radar)),
        plots.range_m, plots.azimuth_rad, *state.T,
    )  # fmt: skip


def _line(sensor: Sensor, path: Path, time_s: Floats) -> Line:
    east, north = (path.place(time_s) - [sensor.east_m, sensor.north_m]).T
    distance = np.hypot(east, north)
    visible = (distance >= sensor.range_min_m) & (distance <= sensor.range_max_m)
    return Line(distance, wrapped(np.arctan2(east, north)), visible)


def _gathered(
    scene: Scene, paths: list[Path], biases: TrueBiases, columns: list[Floats]
) -> FlatPlots:
    time_s, aircraft, radar, distance, azimuth, *truth = columns
    order = np.lexsort((radar, aircraft, time_s))
    grid = _GRID_S * np.arange(np.floor(scene.duration_s / _GRID_S) + 1.0)
    states = [path.states(np.clip(grid, path.start_s, path.end_s)) for path in paths]
    values = [biases.at(index, grid).T for index in range(len(scene.sensors))]
    return FlatPlots(
        time_s=time_s[order],
        aircraft=aircraft[order].astype(np.int32),
        radar=radar[order].astype(np.int32),
        range_m=distance[order],
        azimuth_rad=azimuth[order],
        truth=np.stack(truth, axis=-1)[order],
        site_m=np.array([[one.east_m, one.north_m] for one in scene.sensors]),
        life_s=np.array([[path.start_s, path.end_s] for path in paths]).reshape(-1, 2),
        grid_s=grid,
        states=np.stack(states, axis=1) if states else np.empty((len(grid), 0, 4)),
        biases=np.stack(values, axis=1),
    )
