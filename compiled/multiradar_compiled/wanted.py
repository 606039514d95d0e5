"""Which kernels a purpose needs, and for which types of arguments: a list that comes along.

`make kernel-list` writes it, from what commands call; a test compares both. A kernel that
is missing is compiled at its first call.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_LIST = Path(__file__).with_name("kernels.json")


@dataclass(frozen=True, slots=True)
class Wanted:
    """A kernel, compiled for arguments of given types.

    Attributes
    ----------
    kernel : str
        Module and function, as in `package.module:function`.
    arguments : tuple of str
        `signatures.describe` of each argument.
    seconds : float
        What compiling it took where the list was made: the longest go first.
    """

    kernel: str
    arguments: tuple[str, ...]
    seconds: float = 0.0


@cache
def kernels_by_purpose() -> dict[str, tuple[Wanted, ...]]:
    """Return the list: purposes, and the kernels each of them needs."""
    document = json.loads(_LIST.read_text(encoding="utf-8"))
    types = document["types"]
    found: dict[str, list[Wanted]] = {purpose: [] for purpose in document["purposes"]}
    for one in document["kernels"]:
        arguments = tuple(types.get(name, name) for name in one["arguments"])
        wanted = Wanted(one["kernel"], arguments, one["seconds"])
        for purpose in one["purposes"]:
            found[purpose].append(wanted)
    return {purpose: tuple(kernels) for purpose, kernels in found.items()}


def kernels_for(purposes: Iterable[str]) -> list[Wanted]:
    """Return the kernels of all these purposes, each once, those that take longest first.

    Raises
    ------
    KeyError
        If the list has no such purpose.
    """
    known = kernels_by_purpose()
    kernels = {one: None for purpose in purposes for one in known[purpose]}
    return sorted(kernels, key=lambda one: -one.seconds)
