"""Tracks recordings not used for tuning, and lists failures.

::

    python -m validation.tracker.check_unseen  # simulated traffic
    python -m validation.tracker.check_unseen flights.json.gz --runs 12 --filters two-stage imm
    python -m validation.tracker.check_unseen --only storm clutter --list  # every failure by itself

Each recording is made by `unseen_recordings.py`, tracked with all identity hidden and with
codes, and compared with its truth by `unseen_results.py`:

- *swaps*: a confirmed track changed to another aircraft; *breaks*: a continuously detected aircraft
  got another track; *lost*: five or more consecutive plots were on no track of their aircraft;
- *late*: aircraft with three plots in three scans of the radar that detected them first, not
  confirmed by then; beside it the scans of all, and the most plots before confirmation;
- *false*: confirmed tracks without aircraft; *duplicates*: a second track of an aircraft.
"""

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from validation.tracker import unseen_recordings as unseen
from validation.tracker.unseen_results import Result, compare

HIDDEN = {
    "none": ("track_number", "mode_3a", "mode_s_address"),
    "codes": ("track_number", "mode_s_address"),
}
HEADER = (
    "recording", "known", "filter", "plots", "aircraft", "tracks", "right track", "swaps", "breaks",
    "lost", "late", "scans: 95 %, worst", "wait", "false", "over 30 s", "duplicates", "RMS, m",
    "CPU, s",
)  # fmt: skip
#: Failures that the last rows sum up.
SUMMED = ("swap", "break", "lost", "late", "never", "false", "duplicate")
#: Seeds of hostile recordings count from here.
HOSTILE_FIRST = 1000
ROWS_AT_ONCE = 8192


def main() -> None:
    """Print a Markdown table, the failures where asked for, and sums."""
    options = arguments()
    flights = [one for path in options.files for one in unseen.read_flights(path)]
    print(f"| {' | '.join(HEADER)} |\n|{'---|' * len(HEADER)}", flush=True)
    sums: dict[tuple[str, str], Counter[str]] = {}
    for recording in recordings(options, flights):
        for known in options.known:
            for name in options.filters:
                began = time.process_time()
                settings = TrackingSettings(hidden_fields=HIDDEN[known], filter_name=name)
                result = compare(tracked(recording, settings), recording)
                spent = f"{time.process_time() - began:.1f}"
                row = (recording.name, known, name, *cells(result), spent)
                print(f"| {' | '.join(row)} |", flush=True)
                for one in result.failures if options.list else []:
                    print(f"    {one.what} at {one.time_s:.1f} s, {one.aircraft}: {one.word}")
                total = sums.setdefault((known, name), Counter())
                total.update(one.what for one in result.failures)
                total.update(aircraft=result.aircraft, tracks=result.tracks)
    for (known, name), total in sums.items():
        text = ", ".join(f"{what} {total[what]}" for what in ("aircraft", "tracks", *SUMMED))
        print(f"\n{known}, {name}: {text}")


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, help="ADS-B reports; simulated without")
    parser.add_argument("--runs", type=int, default=4, help="recordings that are not hostile")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument(
        "--only", nargs="*", help="these hostile ones", default=list(unseen.HOSTILE)
    )
    parser.add_argument("--filters", nargs="+", default=["two-stage"])
    parser.add_argument("--known", nargs="+", default=list(HIDDEN), choices=list(HIDDEN))
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--list", action="store_true", help="list every failure")
    return parser.parse_args()


def recordings(
    options: argparse.Namespace, flights: list[unseen.Flight]
) -> Iterator[unseen.Recording]:
    """Make the recordings that were asked for."""
    names = list(unseen.HOSTILE)
    seeds = range(options.first, options.first + options.runs)
    made = [(f"seed {seed}", seed) for seed in seeds]
    made += [(name, HOSTILE_FIRST + options.first + names.index(name)) for name in options.only]
    for name, seed in made:
        yield unseen.recording(name, seed, flights, 60.0 * options.minutes)


def tracked(recording: unseen.Recording, settings: TrackingSettings) -> pl.DataFrame:
    """Track a recording as `track` does."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sensors.toml"
        path.write_text(recording.sensors, encoding="utf-8")
        table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(recording.measurements, table)
    engine = Engine(table, settings)
    parts = [
        engine.push(batch.select(slice(first, first + ROWS_AT_ONCE))).updates
        for first in range(0, max(len(batch), 1), ROWS_AT_ONCE)
    ]
    parts.append(engine.flush().updates)
    engine.close()
    return wire.tracks_frame(TrackUpdates.concatenate(parts), table)


def cells(found: Result) -> list[str]:
    """Return a result as text."""
    scans = found.scans if len(found.scans) else np.zeros(1)
    late = found.count("late") + found.count("never")
    return [
        str(found.plots), str(found.aircraft), str(found.tracks), f"{found.right_share:.2%}",
        str(found.count("swap")), str(found.count("break")), str(found.count("lost")), str(late),
        f"{np.percentile(scans, 95):.1f}, {np.max(scans):.1f}", str(found.wait),
        str(found.false_tracks), str(found.count("false")), str(found.count("duplicate")),
        f"{found.rms_m:.0f}",
    ]  # fmt: skip


if __name__ == "__main__":
    main()
