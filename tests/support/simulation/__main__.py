"""Simulate runs of the whole service under faults: `python -m support.simulation --runs N`."""

import argparse
import itertools
import multiprocessing
import os
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from multiradar.clock import SystemClock
from support.processes.waiting import run_to_end
from support.simulation.faults import ELSEWHERE, FAULTS
from support.simulation.run import Outcome, Simulator, begin, run_some

#: Runs that a process makes before it reports.
PIECE_RUNS = 20
#: Pieces of one process, whose memory grows to 0.9 GB in its first hundred runs, and no more after.
PIECES_MAX = 100
PROGRESS_S = 10.0


def main(arguments: list[str] | None = None) -> int:
    """Simulate; return 1 if a run failed, or if a fault did not occur."""
    options = _options(arguments)
    clock = SystemClock()
    started_s = shown_s = clock.monotonic_s()
    total = Outcome()
    for outcome in _outcomes(options):
        total.add(outcome)
        for seed, how in outcome.failures:
            _show(_failure(seed, how, options.fault))
        now_s = clock.monotonic_s()
        if now_s - shown_s >= PROGRESS_S:
            shown_s = now_s
            _show(_progress(total, options.runs, now_s - started_s))
    _show(summary(total, clock.monotonic_s() - started_s))
    return int(bool(total.failures))


def run(arguments: list[str]) -> None:
    """Simulate in a process for this alone, and end it."""
    sys.exit(main(arguments))


def summary(total: Outcome, duration_s: float) -> str:
    """Return what runs covered, as text."""
    rows = {fault.row for fault in FAULTS}
    pairs = len(list(itertools.combinations(sorted(rows), 2)))
    least = min(total.pairs.values(), default=0)
    elsewhere = ", ".join(map(str, ELSEWHERE))
    lines = [
        f"{total.runs} runs, {len(total.failures)} failed, {total.kills} processes ended, "
        f"{total.takeovers} takeovers, {total.migrations} migrations; "
        f"{total.runs / max(duration_s, 1e-9):.1f} runs/s",
        f"faults {len(total.faults)} of {len(FAULTS)}; rows of the fault model {len(total.rows)} "
        f"of {len(rows)} (tested elsewhere: {elsewhere}); pairs of rows {len(total.pairs)} of "
        f"{pairs}, the rarest {least} times",
        f"damage of the journal reported {total.detected.total()} times",
    ]
    return "\n".join(lines)


def _show(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _outcomes(options: argparse.Namespace) -> Iterator[Outcome]:
    seeds = options.seeds or range(options.seed, options.seed + options.runs)
    names = tuple(options.fault)
    if options.workers == 1 or options.dry_run:
        simulator = Simulator()
        for seed in seeds:
            yield simulator.run(seed, names, dry=options.dry_run)
        return
    pieces = [seeds[first : first + PIECE_RUNS] for first in range(0, len(seeds), PIECE_RUNS)]
    context = multiprocessing.get_context("spawn")
    with context.Pool(options.workers, begin, maxtasksperchild=PIECES_MAX) as pool:
        yield from pool.imap_unordered(partial(run_some, names=names), pieces)


def _progress(total: Outcome, runs: int, duration_s: float) -> str:
    return (
        f"{total.runs} of {runs} runs, {len(total.failures)} failed, {len(total.pairs)} pairs, "
        f"{total.runs / duration_s:.1f} runs/s"
    )


def _failure(seed: int, how: str, names: list[str]) -> str:
    more = "".join(f' --fault "{name}"' for name in names)
    return (
        f"seed {seed} at commit {_commit()}: {how}\n"
        f"  again: make simulate-faults SIMULATE_OPTIONS='--runs 1 --seed {seed}{more}'"
    )


def _commit() -> str:
    found = run_to_end(["git", "rev-parse", "HEAD"], cwd=Path(__file__).parent)
    return found.stdout.strip() or "unknown"


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make simulate-faults", description=__doc__)
    parser.add_argument("--runs", type=int, default=1000, help="number of runs")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first run")
    parser.add_argument("--seeds", type=int, nargs="+", default=[], help="seeds of all runs")
    parser.add_argument("--dry-run", action="store_true", help="only show what is covered")
    parser.add_argument("--fault", action="append", default=[], help="only this fault; repeatable")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    options = parser.parse_args(arguments)
    options.runs = len(options.seeds) or options.runs
    options.workers = min(options.workers, options.runs)
    return options


if __name__ == "__main__":
    sys.exit(main())
