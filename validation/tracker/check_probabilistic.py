"""Prints the table of validation/jpda.md that compares association methods for close aircraft.

::

    python -m validation.tracker.check_probabilistic  # 20 seeds, a few minutes
    python -m validation.tracker.check_probabilistic unresolved my.toml --seeds 5 --filter imm

Every scenario is simulated with the seeds 1, 2, …, tracked with all identity hidden, and evaluated
like `multiradar evaluate --truth`. Swaps, new numbers, false and duplicate tracks are sums over the
seeds; position errors are of all updates of all seeds; completeness is a mean. The last columns are
of aircraft that no radar resolved from others for a while: the scans of the first radar that
resolves it, from the first resolved plot until a confirmed track of its own has a plot of it, the
first counted; and the number of aircraft whose previous track continued with one of the group, and
with its first member, to which all unresolved plots belong.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.evaluation.card.figures import figures_of
from multiradar.evaluation.scorecard import evaluate
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.tables import reference_of_truth, tracks_of
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_names, builtin_scenario, load_scenario
from multiradar.simulation.scenario.model import Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

SCENES = ("crossing", "unresolved", "formation", "formation-split", "clutter")
HIDDEN = ("track_number", "mode_3a", "mode_s_address")
METHODS: dict[str, dict[str, Any]] = {
    "nearest": {},
    "probabilistic": {"association": "probabilistic"},
    "probabilistic, all events": {"association": "probabilistic", "joint_events": "all"},
}
HEADER = (
    "scenario", "filter", "association", "swaps", "new numbers", "RMS", "95 %", "completeness",
    "false", "duplicate", "own track after, scans", "track continues", "CPU time",
)  # fmt: skip
SETTINGS = EvaluationSettings()
#: Time before and after in which a track is compared with its earlier and later aircraft, s.
AROUND_S = 60.0


@dataclass(frozen=True)
class Parting:
    """An aircraft that a radar resolves from a time on.

    Attributes
    ----------
    numbers : tuple of int
        Its track number first, then those of the others it was unresolved from.
    time_s, period_s : float
        Its first resolved plot, and the scan period of that radar.
    """

    numbers: tuple[int, ...]
    time_s: float
    period_s: float


@dataclass(frozen=True)
class Recording:
    """A simulated scenario as input of the tracker, its truth, and the aircraft that separate."""

    sensors: SensorTable
    batch: MeasurementBatch
    truth: pl.DataFrame
    partings: list[Parting]


@dataclass
class Sums:
    """Sums over all seeds of one scenario with one method."""

    counts: dict[str, int] = field(default_factory=dict)
    position_m: list["np.typing.NDArray[np.float64]"] = field(default_factory=list)
    completeness: list[float] = field(default_factory=list)
    scans: list[float] = field(default_factory=list)
    kept: list[bool] = field(default_factory=list)
    first: list[bool] = field(default_factory=list)
    cpu_s: float = 0.0


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="built-in names or files", default=SCENES)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--filter", nargs="+", default=["two-stage", "imm"], dest="filters")
    chosen = parser.parse_args()
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}", flush=True)
    for name in chosen.scenes:
        scene = builtin_scenario(name) if name in builtin_names() else load_scenario(Path(name))
        sums = {(one, how): Sums() for one in chosen.filters for how in METHODS}
        for seed in range(1, chosen.seeds + 1):
            recording = simulated(replace(scene, seed=seed))
            for (one, how), total in sums.items():
                settings = TrackingSettings(filter_name=one, hidden_fields=HIDDEN, **METHODS[how])
                if seed == 1:  # Compilation is not counted.
                    add(Sums(), recording, settings)
                add(total, recording, settings)
        for (one, how), total in sums.items():
            print(f"| {' | '.join([Path(name).stem, one, how, *cells(total)])} |", flush=True)


def simulated(scene: Scenario) -> Recording:
    """Simulate a scenario with its seed."""
    seen = observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "sensors.toml"
        path.write_text(sensors_text(scene), encoding="utf-8")
        sensors = load_sensor_table(path)
    batch, _ = wire.measurement_batch(measurements_frame(scene, seen), sensors)
    return Recording(sensors, batch, truth_frame(scene, seen), partings(scene))


def partings(scene: Scenario) -> list[Parting]:
    """Return the aircraft that radars resolve, from the same plots with and without resolution."""
    if all(one.range_resolution_m == 0.0 for one in scene.sensors):
        return []
    sharp = replace(
        scene, sensors=tuple(replace(one, range_resolution_m=0.0) for one in scene.sensors)
    )
    apart, seen = (
        truth_frame(one, observe(one, np.random.Generator(np.random.PCG64(scene.seed))))
        for one in (sharp, scene)
    )
    keys = ["time_s", "sensor_id", "track_number"]
    merged = apart.join(seen, on=keys, how="anti").drop_nulls("track_number")
    periods_s = {one.identifier: one.rotation_period_s or one.interval_s for one in scene.sensors}
    found = []
    for (number,), rows in merged.group_by("track_number", maintain_order=True):
        mine = seen.filter(pl.col("track_number") == number)
        firsts = []
        for sensor, period_s in periods_s.items():
            last = times(rows.filter(pl.col("sensor_id") == sensor))
            own = times(mine.filter(pl.col("sensor_id") == sensor))
            if len(last) and own.max(initial=-np.inf) > last.max():
                firsts.append((float(own[own > last.max()].min()), period_s))
        # Only aircraft that were unresolved by every radar.
        if len(firsts) == len(periods_s):
            others = companions(apart, rows, number)
            found.append(Parting((number, *others), *min(firsts)))
    return found


def times(rows: pl.DataFrame) -> "np.typing.NDArray[np.float64]":
    """Return the times of rows."""
    return rows["time_s"].to_numpy()


def companions(apart: pl.DataFrame, merged: pl.DataFrame, number: int) -> list[int]:
    """Return the aircraft nearest to most of the unresolved plots."""
    position = ["latitude_deg", "longitude_deg"]
    nearest: dict[int, int] = {}
    for row in merged.gather_every(5).iter_rows(named=True):
        near = apart.filter(
            (pl.col("time_s") - row["time_s"]).abs() < 1.0, pl.col("track_number") != number,
            ((pl.col(position[0]) - row[position[0]]).abs() < 0.02)
            & ((pl.col(position[1]) - row[position[1]]).abs() < 0.03),
        )["track_number"].unique()  # fmt: skip
        for other in near.to_list():
            nearest[other] = nearest.get(other, 0) + 1
    return [other for other, count in nearest.items() if count > 2]


def add(total: Sums, recording: Recording, settings: TrackingSettings) -> None:
    """Track a recording and add its figures."""
    engine = Engine(recording.sensors, settings)
    begin_s = time.process_time()
    updates = TrackUpdates.concatenate(
        [engine.push(recording.batch).updates, engine.flush().updates]
    )
    total.cpu_s += time.process_time() - begin_s
    engine.close()
    frame = wire.tracks_frame(updates, recording.sensors)
    reference = reference_of_truth(recording.truth, "truth", SETTINGS.reference_gap_s)
    tracks = tracks_of(frame, "tracks", reference.plane, tentative=False)
    card = evaluate(tracks, reference, SETTINGS, ())
    scores: dict[str, Any] = figures_of(card)
    for key, value in {
        "swaps": scores["identity"]["swaps"], "changes": scores["identity"]["number_changes"],
        "false": scores["tracks"]["false"], "second": scores["tracks"]["duplicate"],
    }.items():  # fmt: skip
        total.counts[key] = total.counts.get(key, 0) + value
    total.position_m.append(card.errors.position_m)
    total.completeness.append(scores["siap"]["completeness"])
    rows = confirmed_plots(frame, recording.truth)
    for one in recording.partings:
        add_parting(total, one, rows)


def confirmed_plots(frame: pl.DataFrame, truth: pl.DataFrame) -> pl.DataFrame:
    """Return the updates of confirmed tracks with the aircraft of their plots."""
    keys = ["time_s", "sensor_id"]
    once = truth.select(*keys, "track_number").unique(keys, keep="none")
    rows = frame.drop("track_number").join(once, on=keys).sort("sequence")
    return rows.filter(pl.col("state") != "tentative")


def add_parting(total: Sums, one: Parting, rows: pl.DataFrame) -> None:
    """Add the scans to a track of its own, and whether the previous track continues."""
    after = rows.filter(pl.col("time_s") >= one.time_s)
    settled_s = one.time_s + AROUND_S
    late = after.filter(pl.col("time_s").is_between(settled_s, settled_s + AROUND_S))
    own = most(late.filter(pl.col("track_number") == one.numbers[0]))
    if own is None:
        total.scans.append(np.inf)
        return
    mine = after.filter((pl.col("track_id") == own) & (pl.col("track_number") == one.numbers[0]))
    total.scans.append(float(times(mine).min() - one.time_s) / one.period_s + 1.0)
    before = rows.filter(
        pl.col("track_number").is_in(one.numbers)
        & pl.col("time_s").is_between(one.time_s - AROUND_S, one.time_s)
    )
    if before.height:
        group = [most(late.filter(pl.col("track_number") == number)) for number in one.numbers]
        total.kept.append(most(before) in group)
        total.first.append(most(before) == group[int(np.argmin(one.numbers))])


def most(rows: pl.DataFrame) -> int | None:
    """Return the track of most rows."""
    counts = rows.group_by("track_id").len().sort("len", "track_id", descending=[True, False])
    return None if counts.is_empty() else int(counts["track_id"][0])


def cells(total: Sums) -> list[str]:
    """Return sums as text."""
    errors = np.abs(np.concatenate(total.position_m))
    scans = kept = "–"
    if total.scans:
        late = np.percentile(total.scans, 95, method="lower")
        scans = f"{np.median(total.scans):.1f} (95 %: {late:.1f}, worst {max(total.scans):.1f})"
        kept = f"{sum(total.kept)} of {len(total.kept)}, {sum(total.first)} with the first aircraft"
    return [
        str(total.counts["swaps"]), str(total.counts["changes"]),
        f"{np.sqrt(np.mean(errors**2)):.1f} m", f"{np.percentile(errors, 95):.0f} m",
        f"{np.mean(total.completeness):.2%}", str(total.counts["false"]),
        str(total.counts["second"]), scans, kept, f"{total.cpu_s:.1f} s",
    ]  # fmt: skip


if __name__ == "__main__":
    main()
