"""List of the kernels needed for each purpose, with their argument types.

`make kernel-list` writes it from the calls of commands; a test compares both. A kernel missing in
it is compiled at its first call.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_LIST = Path(__file__).with_name("kernels.json")


@dataclass(frozen=True, slots=True)
class TypedKernel:
    """A kernel with the types of its arguments.

    Attributes
    ----------
    kernel : str
        Module and function, as in `package.module:function`.
    arguments : tuple of str
        `signatures.describe` of each argument.
    seconds : float
        Compilation time where the list was made: the longest are compiled first.
    """

    kernel: str
    arguments: tuple[str, ...]
    seconds: float = 0.0


@cache
def kernels_by_purpose() -> dict[str, tuple[TypedKernel, ...]]:
    """Return the kernels of each purpose."""
    document = json.loads(_LIST.read_text(encoding="utf-8"))
    types = document["types"]
    found: dict[str, list[TypedKernel]] = {purpose: [] for purpose in document["purposes"]}
    for one in document["kernels"]:
        arguments = tuple(types.get(name, name) for name in one["arguments"])
        wanted = TypedKernel(one["kernel"], arguments, one["seconds"])
        for purpose in one["purposes"]:
            found[purpose].append(wanted)
    return {purpose: tuple(kernels) for purpose, kernels in found.items()}


def kernels_for(purposes: Iterable[str]) -> list[TypedKernel]:
    """Return the kernels of all these purposes, each once, the longest compilation first.

    Raises
    ------
    KeyError
        If the list has no such purpose.
    """
    known = kernels_by_purpose()
    kernels = {one: None for purpose in purposes for one in known[purpose]}
    return sorted(kernels, key=lambda one: -one.seconds)
