"""Prints the tables of docs/howto/encounters.md: validation of intervals and probabilities.

::

    python -m validation.motion.check_encounters  # five minutes
    # after forecasts of 300 s have been evaluated
    python -m validation.motion.check_encounters --settled 450

Simulated traffic is tracked with the radars of the sample recording and estimated biases, and
encounters are computed every twenty seconds. The true minimum distance within the horizon is
compared with the reported 95 % interval, by the time to the closest approach; the fraction of pairs
that come within the distance with the mean of the reported probabilities; and the difference
of heights with its interval.
"""

import argparse
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters
from multiradar.simulation.paths import Path, fly
from multiradar.tracking.columns import rows_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.settings import TrackingSettings
from validation.motion.check_manoeuvres import Flown, flights

Floats = NDArray[np.float64]

#: Mean time of straight flight, s: no turns, as on airways, as near airports.
TRAFFIC = {"straight": 1e5, "one turn per ten minutes": 600.0, "one turn per two minutes": 120.0}
FILTERS = ("two-stage", "imm")
EVERY_S = 20.0
#: Bounds of the times to the closest approach, s.
AHEAD_S = (0.0, 15.0, 30.0, 60.0, 120.0, 300.0)
PROBABILITIES = (0.0, 0.5, 0.8, 0.95, 1.0)
#: Wide enough for many pairs; a little more than what keeps aircraft apart.
QUERY = EncounterQuery(300.0, 15_000.0, limit=None)
HEIGHT_SIGMAS = 1.96
DENSE_S = 1.0


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=3, help="seeds")
    parser.add_argument("--aircraft", type=int, default=40, help="in each run")
    parser.add_argument("--duration", type=float, default=1200.0, help="of each run, s")
    parser.add_argument("--settled", type=float, default=120.0, help="asked from then on, s")
    options = parser.parse_args()
    columns = [
        "together",
        *(f"{a:g} to {b:g} s" for a, b in pairwise(AHEAD_S)),
        "all",
        "width",
        "height",
    ]
    print(f"| traffic, filter | {' | '.join(columns)} |")
    print("|" + "---|" * (1 + len(columns)))
    reliability = []
    for name, straight_s in TRAFFIC.items():
        flown = flights(
            options.runs, aircraft=options.aircraft, duration_s=options.duration, known=False,
            extent_m=75e3, straight_s=straight_s,
        )  # fmt: skip
        for filter_name in FILTERS:
            settings = TrackingSettings(filter_name=filter_name)
            times_s = np.arange(options.settled, options.duration - QUERY.horizon_s, EVERY_S)
            evaluated = np.concatenate(
                [evaluate_encounters(one, settings, times_s) for one in flown]
            )
            print(f"| {name}, `{filter_name}` | {' | '.join(contained(evaluated))} |", flush=True)
            reliability.append(
                f"| {name}, `{filter_name}` | {' | '.join(reliability_cells(evaluated))} |"
            )
    columns = [*(f"reported {a:g} to {b:g}" for a, b in pairwise(PROBABILITIES)), "mean square"]
    print(f"\n| traffic, filter | {' | '.join(columns)} |")
    print("|" + "---|" * (1 + len(columns)))
    print("\n".join(reliability))


def evaluate_encounters(
    one: Flown, settings: TrackingSettings, times_s: Floats
) -> NDArray[np.void]:
    """Return a row for each encounter reported at these times, with its outcome."""
    end_s = float(times_s[-1]) + EVERY_S + QUERY.horizon_s
    paths = [fly(flier, end_s, np.random.Generator(np.random.PCG64(0))) for flier in one.fliers]
    kinds = [
        ("ahead_s", np.float64), ("together", np.bool_), ("held", np.bool_),
        ("width_m", np.float64), ("height_held", np.float64), ("probability", np.float64),
        ("came", np.bool_),
    ]  # fmt: skip
    return np.array(list(outcomes(one, settings, times_s, paths)), np.dtype(kinds))


def outcomes(
    one: Flown, settings: TrackingSettings, times_s: Floats, paths: list[Path]
) -> Iterator[tuple[float, bool, bool, float, float, float, bool]]:
    """Process the scenario and yield the outcome of each encounter."""
    engine, live = Engine(one.sensors, settings, sampling=Sampling.DRAWN), LiveTracks()
    calibration = calibration_for(settings)
    before = 0
    number_of: dict[int, int] = {}
    for cut in np.searchsorted(one.batch.time_s, times_s).tolist():
        output = engine.push(one.batch.select(slice(before, cut)))
        updates, before = output.updates, cut
        calibration.observe(output)
        live.update(rows_of(updates))
        number_of |= dict(
            zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True)
        )
        sky = TrackSnapshot(float(one.batch.time_s[cut - 1]), live.all(), engine.tracks())
        answer = encounters(sky, QUERY, engine.plane, settings, calibration)
        dense_s = answer["time_s"] + np.arange(0.0, QUERY.horizon_s + DENSE_S, DENSE_S)
        for encounter in answer["encounters"]:
            first, second = (
                paths[number_of[encounter[f"{side}_track_id"]] - 1] for side in ("first", "second")
            )
            least_m = nearest(second.position(dense_s) - first.position(dense_s))
            at_s = np.array([encounter["closest_time_s"]])
            error_m = (
                encounter["second_height_m"] - encounter["first_height_m"]
                - float((second.height(at_s) - first.height(at_s))[0])
            )  # fmt: skip
            yield (
                encounter["time_to_closest_s"], encounter["together"],
                encounter["distance_low_m"] <= least_m <= encounter["distance_high_m"],
                encounter["distance_high_m"] - encounter["distance_low_m"],
                float(abs(error_m) <= HEIGHT_SIGMAS * encounter["vertical_sigma_m"]),
                encounter["probability"], least_m <= QUERY.distance_m,
            )  # fmt: skip


def nearest(apart_m: Floats) -> float:
    """Return the minimum distance of a path from the origin, straight between its points."""
    start, step = apart_m[:-1], np.diff(apart_m, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-12)
    part = np.clip(-(start * step).sum(axis=1) / square, 0.0, 1.0)
    return float(np.hypot(*(start + part[:, None] * step).T).min())


def contained(evaluated: NDArray[np.void]) -> list[str]:
    """Return the fraction of intervals that contain the true value, by the time ahead."""
    together = evaluated["together"]
    chosen = [together]
    for low, high in pairwise(AHEAD_S):
        within = (evaluated["ahead_s"] >= low) & (
            evaluated["ahead_s"] < high + (high == AHEAD_S[-1])
        )
        chosen.append(within & ~together)
    chosen.append(np.ones(len(evaluated), np.bool_))
    cells = [
        f"{evaluated['held'][rows].mean():.1%} of {rows.sum()}" if rows.any() else "–"
        for rows in chosen
    ]
    width = f"{np.median(evaluated['width_m']):.0f} m"
    return [*cells, width, f"{evaluated['height_held'].mean():.1%}"]


def reliability_cells(evaluated: NDArray[np.void]) -> list[str]:
    """Return mean reported probability and observed fraction by probability, and the error."""
    cells = []
    for low, high in pairwise(PROBABILITIES):
        reported = evaluated["probability"]
        rows = (reported >= low) & (reported < high + (high == PROBABILITIES[-1]))
        cells.append(
            f"{reported[rows].mean():.3f}: {evaluated['came'][rows].mean():.3f} of {rows.sum()}"
            if rows.any()
            else "–"
        )
    return [*cells, f"{np.mean((evaluated['probability'] - evaluated['came']) ** 2):.4f}"]


if __name__ == "__main__":
    main()
