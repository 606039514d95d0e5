"""Prints the table of smoothers of scorecard-reference.md: filters and smoothers against the truth.

::

    python -m validation.motion.check_smoothers  # two seeds, under a minute

The scenarios are those of check_manoeuvres.py. RMS position error, and error² / sigma² of each axis
(1 where the reported sigma is right), by manoeuvre, of all updates and positions after the first
minute. With estimated biases the smoothers subtract the final estimates of the filter, like
`multiradar evaluate --smoothed`; `imm` accounts for the residual biases.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.evaluation.smoothing.motion_modes import civil_modes
from multiradar.evaluation.smoothing.multiple_modes import ResidualBiases, smooth_modes
from multiradar.evaluation.smoothing.plot_positions import Radar, locate_plots, noise_on_plane
from multiradar.evaluation.smoothing.single_mode import PositionMeasurements, Smoothed, smooth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import CLASSES, SETTLED_S, Flown, figures, flights

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Steps for the numerical derivatives of positions by a bias, m and rad.
STEPS = (1.0, 1e-5)
DENSITIES = (3.0, 10.0, 30.0)


@dataclass(frozen=True)
class Seen:
    """Positions of the plots of a scenario, true positions, and manoeuvres."""

    sightings: PositionMeasurements
    biases: ResidualBiases
    true_m: Floats
    doing: Integers


def main() -> None:
    """Print a table with known biases and one with estimated ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2, help="seeds")
    parser.add_argument("--aircraft", type=int, default=30, help="in each run")
    parser.add_argument("--duration", type=float, default=900.0, help="of each run, s")
    options = parser.parse_args()
    for known in (True, False):
        flown = flights(
            options.runs, aircraft=options.aircraft, duration_s=options.duration, known=known
        )
        print(f"biases {'known' if known else 'estimated'}\n")
        print(f"| | {' | '.join(CLASSES)} |\n|{'---|' * (1 + len(CLASSES))}")
        for name in ("two-stage", "imm"):
            found = figures(TrackingSettings(filter_name=name), flown)
            cells = [f"{found[one].rms_m:.1f} m, {found[one].nees:.2f}" for one in CLASSES]
            print(f"| filter `{name}` | {' | '.join(cells)} |", flush=True)
        seen = [in_place(one) for one in flown]
        for density in DENSITIES:
            name = f"smoother, constant velocity, {density:g} m²/s³"
            print(row(name, seen, by_density(density)), flush=True)
        print(row("smoother, `imm`", seen, by_modes), flush=True)
        print()


def by_density(density: float) -> Callable[[Seen], Smoothed]:
    """Return the constant-velocity smoother."""
    return lambda one: smooth(one.sightings, density)


def by_modes(one: Seen) -> Smoothed:
    """Smooth with interacting modes."""
    return smooth_modes(one.sightings, civil_modes(), DENSITIES[-1], one.biases)


def row(name: str, seen: list[Seen], by: Callable[[Seen], Smoothed]) -> str:
    """Return a row of the table."""
    errors, squares, doing = [], [], []
    for one in seen:
        found = by(one)
        kept = found.used & (one.sightings.time_s > SETTLED_S)
        error = found.state[kept, :2] - one.true_m[kept]
        weighed = np.linalg.solve(found.position_covariance_m2[kept], error[..., None])[..., 0]
        errors.append(np.hypot(error[:, 0], error[:, 1]))
        squares.append(np.sum(error * weighed, axis=1) / 2.0)
        doing.append(one.doing[kept])
    metres, ratios, kinds = (np.concatenate(part) for part in (errors, squares, doing))
    cells = []
    for which in CLASSES.values():
        chosen = np.isin(kinds, which)
        rms = float(np.sqrt(np.mean(metres[chosen] ** 2)))
        cells.append(f"{rms:.1f} m, {np.mean(ratios[chosen]):.2f}")
    return f"| {name} | {' | '.join(cells)} |"


def in_place(one: Flown) -> Seen:
    """Project plots on the plane, corrected for the biases estimated by the filter."""
    sensors, batch, rows = one.sensors, one.batch, one.rows
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    columns = len(sensors.parameter_kind)
    estimate, covariance = np.zeros(2 * len(sensors)), np.zeros((columns, columns))
    if columns:
        engine = Engine(sensors, TrackingSettings())
        engine.push(batch)
        engine.flush()
        estimate, covariance = engine.biases.estimate, engine.biases.covariance
    position = np.full((len(batch), 2), np.nan)
    noise = np.zeros((len(batch), 2, 2))
    slope = np.zeros((len(batch), 2, 2 * len(sensors)))
    for number in range(len(sensors)):
        own = np.flatnonzero(batch.sensor == number)
        site = tuple(
            float(part[number])
            for part in (sensors.latitude_rad, sensors.longitude_rad, sensors.height_m)
        )
        radar = Radar(
            (site[0], site[1], site[2]), float(sensors.range_sigma_m[number]),
            float(sensors.azimuth_sigma_rad[number]),
        )  # fmt: skip
        polar = np.stack([batch.range_m[own], batch.azimuth_rad[own]])
        polar -= estimate[2 * number : 2 * number + 2, None]
        position[own] = places(plane, radar, polar, batch.height_m[own])
        noise[own] = noise_on_plane(plane, radar, position[own], polar[0])
        for part, step in enumerate(STEPS):
            moved = polar + step * np.eye(2)[:, part, None]
            off = places(plane, radar, moved, batch.height_m[own]) - position[own]
            slope[own, :, 2 * number + part] = off / step
    shown = np.flatnonzero(np.isfinite(position[:, 0]) & np.isfinite(slope).all(axis=(1, 2)))
    shown = shown[np.lexsort((batch.time_s[shown], rows.aircraft[shown]))]
    true = np.stack(plane.to_plane(rows.true_latitude_rad, rows.true_longitude_rad), axis=-1)
    return Seen(
        PositionMeasurements(
            rows.aircraft[shown].astype(np.int64), batch.time_s[shown], position[shown],
            noise[shown],
        ),
        ResidualBiases(slope[shown][..., :columns], covariance),
        true[shown],
        one.doing[shown],
    )  # fmt: skip


def places(plane: SystemPlane, radar: Radar, polar: Floats, height_m: Floats) -> Floats:
    """Return the positions of plots on the plane, NaN above the radar."""
    found = locate_plots(radar.site, polar[0], polar[1], height_m)
    place = np.stack(plane.to_plane(found.latitude_rad, found.longitude_rad), axis=-1)
    return np.where(found.usable[:, None], place, np.nan)


if __name__ == "__main__":
    main()
