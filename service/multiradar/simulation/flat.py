"""Plots of a scenario on a flat plane, as arrays: the data of the studies of the report."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.simulation.biases import TrueBiases, simulate_biases
from multiradar.simulation.observation.detections import (
    LineOfSight,
    detection_opportunities,
    make_plots,
    wrapped,
)
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import Scenario, Sensor
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
        Indices of the measured aircraft and of the radar.
    range_m, azimuth_rad : (p,) float64
        Measured distance on the plane, and azimuth clockwise from north, in [0, 2π).
    truth : (p, 4) float64
        True (east, north, their rates) of the aircraft at the time stamp.
    site_m : (m, 2) float64
        East and north of the radars.
    life_s : (n, 2) float64
        Start and end time of each aircraft, within the scenario.
    grid_s : (t,) float64
        0, 1, 2, … s, to the end of the scenario.
    states : (t, n, 4) float64
        True states on the grid; held constant before the start and after the end of a flight.
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


def flat_plots(scenario: Scenario, rng: np.random.Generator) -> FlatPlots:
    """Simulate all plots of a flat scenario.

    Parameters
    ----------
    scenario : Scenario
        Its plane is `flat` and its sensors are radars. Its traffic is drawn from its own seed:
        the same in each call.
    rng : Generator
        For noise, detections, drift of the biases and random manoeuvres. It must be able to
        spawn, as generators made from a seed are.

    Returns
    -------
    FlatPlots
        Measurements and truth.

    Raises
    ------
    ConfigurationError
        If the scenario is not flat or has sensors other than radars.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.4), (1.5), (1.7) and section 1.6.
    """
    if scenario.plane != "flat" or any(one.kind != "radar" for one in scenario.sensors):
        msg = f"scenario {scenario.title!r}: only radars on a flat plane are supported"
        raise ConfigurationError(msg)
    bias_rng, phase_rng, *own = rng.spawn(2 + len(all_aircraft(scenario)))
    biases = simulate_biases(scenario.sensors, scenario.duration_s, bias_rng)
    phases = phase_rng.uniform(size=len(scenario.sensors))
    paths: list[Path] = []
    rows: list[tuple[NDArray[np.float64], ...]] = []
    for one, (aircraft, stream) in enumerate(zip(all_aircraft(scenario), own, strict=True)):
        paths.append(fly(aircraft, scenario.duration_s, stream))
        rows.extend(
            _plots_of(sensor, (one, radar), paths[-1], (biases, float(phases[radar])), stream)
            for radar, sensor in enumerate(scenario.sensors)
        )
    columns = [np.concatenate(column) for column in zip(*rows, strict=True)] or [np.empty(0)] * 9
    return _gathered(scenario, paths, biases, columns)


# Columns of the plots of one aircraft by one radar: stamp, aircraft, radar, range, azimuth, truth.
def _plots_of(
    sensor: Sensor,
    pair: tuple[int, int],
    path: Path,
    truth: tuple[TrueBiases, float],
    rng: np.random.Generator,
) -> tuple[Floats, ...]:
    (aircraft, radar), (biases, phase) = pair, truth
    line_of_sight = partial(_line_of_sight, sensor, path)
    rotating = sensor.rotation_period_s is not None
    times = detection_opportunities(
        sensor, phase if rotating else 0.0, (path.start_s, path.end_s), line_of_sight
    )
    plots, _ = make_plots(sensor, times, line_of_sight, partial(biases.at, radar), rng)
    state = path.states(plots.time_s)
    count = len(plots.time_s)
    return (
        plots.time_s, np.full(count, float(aircraft)), np.full(count, float(radar)),
        plots.range_m, plots.azimuth_rad, *state.T,
    )  # fmt: skip


def _line_of_sight(sensor: Sensor, path: Path, time_s: Floats) -> LineOfSight:
    east, north = (path.position(time_s) - [sensor.east_m, sensor.north_m]).T
    distance = np.hypot(east, north)
    visible = (distance >= sensor.range_min_m) & (distance <= sensor.range_max_m)
    return LineOfSight(distance, wrapped(np.arctan2(east, north)), visible)


def _gathered(
    scenario: Scenario, paths: list[Path], biases: TrueBiases, columns: list[Floats]
) -> FlatPlots:
    time_s, aircraft, radar, distance, azimuth, *truth = columns
    order = np.lexsort((radar, aircraft, time_s))
    grid = _GRID_S * np.arange(np.floor(scenario.duration_s / _GRID_S) + 1.0)
    states = [path.states(np.clip(grid, path.start_s, path.end_s)) for path in paths]
    values = [biases.at(index, grid).T for index in range(len(scenario.sensors))]
    return FlatPlots(
        time_s=time_s[order],
        aircraft=aircraft[order].astype(np.int32),
        radar=radar[order].astype(np.int32),
        range_m=distance[order],
        azimuth_rad=azimuth[order],
        truth=np.stack(truth, axis=-1)[order],
        site_m=np.array([[one.east_m, one.north_m] for one in scenario.sensors]),
        life_s=np.array([[path.start_s, path.end_s] for path in paths]).reshape(-1, 2),
        grid_s=grid,
        states=np.stack(states, axis=1) if states else np.empty((len(grid), 0, 4)),
        biases=np.stack(values, axis=1),
    )
