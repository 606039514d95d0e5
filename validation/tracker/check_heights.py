"""Prints the guide's table of heights: scenario `climbs` with heights filtered, and as reported.

::

    python -m validation.tracker.check_heights

A row for the aircraft of one kind: RMS errors of height, rate of climb and position, and error² /
sigma², which is 1 where sigmas are right.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import Observation, observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Bias, Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.simulation.traffic import all_aircraft
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

#: Before this time biases and heights are still settling, s.
SETTLED_S = 100.0


def main() -> None:
    """Track the scenario with heights filtered and as exact, and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--filter", default="two-stage", help="filter, two-stage by default")
    name = parser.parse_args().filter
    whole = builtin_scenario("climbs")
    silent = replace(whole.traffic[2], count=40)
    known = tuple(replace(one, biases=(Bias(estimate=False),) * 4) for one in whole.sensors)
    cases = [
        ("25 ft, 100 ft and none, three radars, biases estimated", whole),
        ("none, two radars without biases", replace(whole, sensors=known[:2], traffic=(silent,))),
        ("none, one radar", replace(whole, sensors=known[:1], traffic=(silent,))),
    ]
    for label, scene in cases:
        for exact in (True, False):
            settings = TrackingSettings(filter_name=name, exact_heights=exact)
            print(f"{label}; heights {'as heard' if exact else 'filtered'}")
            for line in figures(scene, settings):
                print(line)


def figures(scene: Scenario, settings: TrackingSettings) -> list[str]:
    """Return a line for the aircraft of each height step, in a table's form."""
    seen = observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))
    engine, tracks = tracked(scene, seen, settings)
    row = ["time_s", "sensor_id", "track_number"]
    kinds = {
        one.track_number: f"{one.height_step_m / 0.3048:.0f} ft" if one.reports_height else "none"
        for one in all_aircraft(scene)
    }
    both = (
        tracks.join(truth_frame(scene, seen).unique(row), on=row, suffix="_true")
        .filter(pl.col("time_s") > SETTLED_S)
        .with_columns(kind=pl.col("track_number").replace_strict(kinds))
    )
    east, north = place(engine, both, "")
    true_east, true_north = place(engine, both, "_true")
    both = both.with_columns(apart=pl.Series(np.hypot(east - true_east, north - true_north)))
    both = both.with_columns(
        off=pl.col("height_m") - pl.col("height_m_true"),
        climb=true_climb(both) - pl.col("vertical_rate_mps"),
    )
    found = both.group_by("kind").agg(
        height=(pl.col("off") ** 2).mean().sqrt(),
        height_nees=((pl.col("off") / pl.col("height_sigma_m")) ** 2).mean(),
        climb=(pl.col("climb") ** 2).mean().sqrt(),
        position=(pl.col("apart") ** 2).mean().sqrt(),
        position_nees=((pl.col("apart") / pl.col("position_sigma_m")) ** 2).mean(),
        reported=pl.col("height_m").is_not_null().mean(),
    )
    return [
        f"| {kind} | {reported:.0%} | {number(height)} m | {number(height_nees, 2)} "
        f"| {number(climb)} m/s | {number(position)} m | {number(position_nees, 2)} |"
        for kind, height, height_nees, climb, position, position_nees, reported in found.sort(
            "kind"
        ).iter_rows()
    ]


def tracked(
    scene: Scenario, seen: Observation, settings: TrackingSettings
) -> tuple[Engine, pl.DataFrame]:
    """Track the measurements of a scenario."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(sensors_text(scene), encoding="utf-8")
        table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(measurements_frame(scene, seen), table)
    engine = Engine(table, settings)
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    return engine, wire.tracks_frame(updates, table)


def place(engine: Engine, both: pl.DataFrame, of: str) -> tuple[np.ndarray, np.ndarray]:
    """Return east and north of the tracks, or of the truth, on the system plane."""
    return engine.plane.to_plane(
        np.radians(both[f"latitude_deg{of}"].to_numpy()),
        np.radians(both[f"longitude_deg{of}"].to_numpy()),
    )


def true_climb(both: pl.DataFrame) -> pl.Series:
    """Return the true rate of climb of each row, by the slope of the true heights around it."""
    rates = np.full(len(both), np.nan)
    for _, own in both.with_row_index().group_by("track_number"):
        own = own.unique("time_s").sort("time_s")
        if len(own) > 1:
            slope = np.gradient(own["height_m_true"].to_numpy(), own["time_s"].to_numpy())
            rates[own["index"].to_numpy()] = slope
    return pl.Series(rates).fill_nan(None)


def number(value: float | None, digits: int = 1) -> str:
    """Return a figure as text, a dash for none."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


if __name__ == "__main__":
    main()
