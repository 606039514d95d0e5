"""Simulate runs of the whole service under faults: `python -m support.simulation --runs N`.

The exit status is 1 if a run failed, or if a fault took effect in none of so many runs that it
should have: from 400 runs on, every fault; from 50 runs on, every one given with --fault.
"""

import argparse
import itertools
import multiprocessing
import os
import sys
from collections.abc import Iterator, Sequence
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
#: Missing pairs of rows that are shown, at most.
PAIRS_SHOWN = 10
#: From so many runs on, every fault takes effect, and every one that all runs have. Of 400 runs, 36
#: draw a fault, and of the rarest one, a third puts it into effect.
RUNS_OF_ALL, RUNS_OF_GIVEN = 400, 50


def main(arguments: list[str] | None = None) -> int:
    """Simulate; return 1 if a run failed, or if a fault took effect in none, as `absent` says."""
    options = _options(arguments)
    clock = SystemClock()
    started_s = shown_s = clock.monotonic_s()
    total = Outcome()
    for outcome in _outcomes(options):
        total.add(outcome)
        for seed, names in outcome.effects.items() if options.show_effects else ():
            _show(f"seed {seed}: {', '.join(sorted(names))}")
        for seed, how in outcome.failures:
            _show(_failure(seed, how, options.fault))
        now_s = clock.monotonic_s()
        if now_s - shown_s >= PROGRESS_S:
            shown_s = now_s
            _show(_progress(total, options.runs, now_s - started_s))
    missing = absent(total, options.fault)
    _show(summary(total, clock.monotonic_s() - started_s, dry=options.dry_run))
    if missing:
        _show(f"without effect in {total.runs} runs: {', '.join(missing)}")
    return int(bool(total.failures or missing))


def run(arguments: list[str]) -> None:
    """Simulate in a process for this alone, and end it."""
    sys.exit(main(arguments))


def absent(total: Outcome, given: Sequence[str] = ()) -> list[str]:
    """Return the faults that took effect in no run, of enough runs.

    These are `RUNS_OF_ALL` runs for all faults, or `RUNS_OF_GIVEN` for those given, if there are
    any. With its faults, each row of the fault model takes effect.
    """
    if total.runs < (RUNS_OF_GIVEN if given else RUNS_OF_ALL):
        return []
    wanted = [fault.name for fault in FAULTS if not given or fault.name in given]
    return [name for name in wanted if not total.faults[name]]


def summary(total: Outcome, duration_s: float, *, dry: bool = False) -> str:
    """Return what runs covered, as text: faults that took effect, or if dry, that were drawn."""
    rows = {fault.row for fault in FAULTS}
    pairs = list(itertools.combinations(sorted(rows), 2))
    least = min(total.pairs[pair] for pair in pairs)
    missing = [f"{one}/{other}" for one, other in pairs if not total.pairs[one, other]]
    elsewhere = ", ".join(map(str, ELSEWHERE))
    lines = [
        f"{total.runs} runs, {len(total.failures)} failed, {total.kills} processes ended, "
        f"{total.takeovers} takeovers, {total.migrations} migrations; "
        f"{total.runs / max(duration_s, 1e-9):.1f} runs/s",
        f"{'drawn' if dry else 'in effect'}: faults {len(total.faults)} of {len(FAULTS)}; "
        f"rows of the fault model {len(total.rows)} of {len(rows)} (tested elsewhere: "
        f"{elsewhere})",
        f"pairs of rows {len(total.pairs)} of {len(pairs)}, the rarest {least} times",
        f"damage of the journal reported {total.detected.total()} times",
    ]
    if 0 < len(missing) <= PAIRS_SHOWN:
        lines.append(f"pairs of rows that are missing: {', '.join(missing)}")
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
    parser.add_argument("--dry-run", action="store_true", help="only show what is drawn")
    parser.add_argument("--fault", action="append", default=[], help="only this fault; repeatable")
    parser.add_argument(
        "--show-effects", action="store_true", help="show the faults that took effect in each run"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes")
    options = parser.parse_args(arguments)
    options.runs = len(options.seeds) or options.runs
    options.workers = min(options.workers, options.runs)
    return options


if __name__ == "__main__":
    sys.exit(main())
