"""Size of the benchmarks, and folder of their files."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter


@dataclass(frozen=True)
class Plan:
    """Parameters of the suites.

    Attributes
    ----------
    folder : Path
        An empty folder for the files of one suite.
    quick : bool
        Small loads and few runs: shows that everything works, says little about speed.
    gigabytes : float
        Size of the dump that the converter reads.
    """

    folder: Path
    quick: bool = False
    gigabytes: float = 0.1

    @property
    def runs(self) -> int:
        """Number of runs for a median, where a run takes long."""
        return 1 if self.quick else 3

    def size(self, full: int) -> int:
        """Return a number to measure, given the number of a full run."""
        return max(1, full // 10) if self.quick else full


def seconds(task: Callable[[], object]) -> float:
    """Time one call."""
    begin = perf_counter()
    task()
    return perf_counter() - begin


def median_seconds(task: Callable[[], object], runs: int) -> float:
    """Time several calls; return the median."""
    return median(seconds(task) for _ in range(runs))
