"""Runs by seed, and what they covered."""

import contextlib
import gc
import itertools
import logging
import traceback
from collections import Counter
from dataclasses import dataclass, field

import structlog

from support.simulation.faults import FAULTS, drawn
from support.simulation.front import Front
from support.simulation.record import Detected, Violation
from support.simulation.scheduler import VirtualClock
from support.simulation.traffic import START_S
from support.simulation.world import World

#: New objects after which the garbage of a run is collected before its end.
COLLECTED_OBJECTS = 200_000
#: Runs after which all modules, kernels and caches are in memory.
LOADING_RUNS = 5


@dataclass(slots=True)
class Outcome:
    """What runs have shown.

    Attributes
    ----------
    runs, kills, takeovers, migrations : int
        Runs, processes that ended in them, takeovers by a standby, and migrations of the journal.
    drawn, faults : Counter of str
        Runs by fault that they drew, and that took effect in them.
    pairs : Counter of pairs of int
        Runs by pair of rows of the fault model that took effect in them.
    effects : dict of int to set of str
        Faults that took effect, by seed.
    detected : Counter of str
        Reported damage of the journal, by kind.
    failures : list of (int, str)
        Seeds that failed, and how.
    """

    runs: int = 0
    kills: int = 0
    takeovers: int = 0
    migrations: int = 0
    drawn: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    pairs: Counter[tuple[int, int]] = field(default_factory=Counter)
    effects: dict[int, set[str]] = field(default_factory=dict)
    detected: Counter[str] = field(default_factory=Counter)
    failures: list[tuple[int, str]] = field(default_factory=list)

    def add(self, other: "Outcome") -> None:
        """Add other runs."""
        self.runs += other.runs
        self.kills += other.kills
        self.takeovers += other.takeovers
        self.migrations += other.migrations
        self.drawn.update(other.drawn)
        self.faults.update(other.faults)
        self.pairs.update(other.pairs)
        self.effects |= other.effects
        self.detected.update(other.detected)
        self.failures.extend(other.failures)

    def cover(self, seed: int, names: set[str]) -> None:
        """Add the faults that took effect in the run of a seed."""
        self.effects[seed] = names
        rows = sorted({fault.row for fault in FAULTS if fault.name in names})
        self.faults.update(names)
        self.pairs.update(itertools.combinations(rows, 2))

    @property
    def rows(self) -> set[int]:
        """Rows of the fault model that took effect."""
        return {fault.row for fault in FAULTS if self.faults[fault.name]}


class Simulator:
    """Runs by seed; one application serves all."""

    def __init__(self) -> None:
        # What the service logs under faults is of no interest here.
        logging.disable(logging.CRITICAL)
        structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
        self._clock = VirtualClock(START_S)
        self._front = Front(self._clock)
        self._runs = 0
        # The collector looks for the garbage of a run after it, and during it where there is much.
        gc.set_threshold(COLLECTED_OBJECTS)
        _keep()

    def run(self, seed: int, names: tuple[str, ...] = (), *, dry: bool = False) -> Outcome:
        """Run a seed, with the faults that it draws or with these.

        If dry, only draw them, as if all took effect.
        """
        outcome = Outcome(runs=1)
        if self._runs == LOADING_RUNS and not dry:
            _keep()
        world = World(seed, self._front, self._clock)
        faults = drawn(world, names)
        outcome.drawn.update(fault.name for fault in faults)
        if dry:
            outcome.cover(seed, set(outcome.drawn))
            world.machine.folder.rmdir()
            return outcome
        self._runs += 1
        named = ", ".join(fault.name for fault in faults)
        try:
            with contextlib.suppress(Detected):
                world.run()
        except Violation as error:
            outcome.failures.append((seed, f"{error}\n  faults: {named}"))
        except Exception:
            outcome.failures.append((seed, f"{traceback.format_exc()}\n  faults: {named}"))
        finally:
            gc.collect()
        outcome.cover(seed, world.occurred)
        outcome.kills += world.record.kills
        outcome.takeovers += world.record.takeovers
        outcome.migrations += world.record.migrations
        outcome.detected.update(world.record.detected)
        return outcome


def _keep() -> None:
    # What is there between runs is never garbage.
    gc.collect()
    gc.freeze()


_simulators: list[Simulator] = []


def begin() -> None:
    """Prepare a process that runs simulations."""
    _simulators.append(Simulator())


def run_some(seeds: range, names: tuple[str, ...]) -> Outcome:
    """Run seeds in a prepared process."""
    total = Outcome()
    for seed in seeds:
        total.add(_simulators[0].run(seed, names))
    return total
