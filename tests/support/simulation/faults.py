"""The catalogue of faults: what each does to a run, and which row of the fault model it is."""

import functools
import random
from collections.abc import Callable
from dataclasses import dataclass

from support.simulation import faults_data, faults_machine, faults_network
from support.simulation.traffic import Occurred
from support.simulation.world import World

Arm = Callable[[World, random.Random, Occurred], None]


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault.

    Attributes
    ----------
    name : str
        What happens.
    row : int
        Row of the fault model.
    arm : callable
        Arranges it in a run; the last argument is to be called when it takes effect.
    """

    name: str
    row: int
    arm: Arm


FAULTS: tuple[Fault, ...] = tuple(
    Fault(name, row, arm)
    for part in (faults_data, faults_network, faults_machine)
    for row, name, arm in part.FAULTS
)

#: Rows of the fault model that one process cannot show, and where they are tested.
ELSEWHERE: dict[int, str] = {
    41: "tests/integration/deploy/test_packaging.py",
    42: "tests/integration/api/test_tls.py",
}


def drawn(world: World, names: tuple[str, ...] = ()) -> list[Fault]:
    """Draw 3 to 8 faults of different rows, or find those with these names; arm them."""
    random = world.random
    if names:
        found = [fault for fault in FAULTS if fault.name in names]
    else:
        found, rows = [], set[int]()
        count = random.randint(3, 8)
        for fault in random.sample(FAULTS, len(FAULTS)):
            if len(found) < count and fault.row not in rows:
                found.append(fault)
                rows.add(fault.row)
    for fault in found:
        fault.arm(world, random, functools.partial(world.occurred.add, fault.name))
    return found
