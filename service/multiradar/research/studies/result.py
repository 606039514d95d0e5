"""Options and results of a study: rows for programs, tables and plots for readers.

A study is a module with one function, ``run(options, progress) -> StudyResult``. It is independent
of terminals, files and HTML: `multiradar.report` and the command display its results.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from multiradar.report.content import Plot, Table, Value

#: Called with the number of completed steps and of all steps; the total may change.
Progress = Callable[[int, int], None]


def step_counter(progress: Progress, total: int) -> Callable[[], None]:
    """Return a function that reports one more completed step with each call.

    Parameters
    ----------
    progress : callable
        Called with the number of completed steps and of all steps.
    total : int
        Number of steps.

    Returns
    -------
    callable
        To be called after each step.
    """
    done = count(1)
    return lambda: progress(next(done), total)


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """Options of a study.

    Attributes
    ----------
    runs : int, optional
        Independent realisations, at least 1; None for the study's default.
    seed : int
        Random seed, not negative: the same seed gives the same result.
    filters : tuple of str, optional
        Names of filters of the study; None for all of them.
    duration_s : float, optional
        Duration of the scenario, s, positive; None for the study's default.
    """

    runs: int | None = None
    seed: int = 1
    filters: tuple[str, ...] | None = None
    duration_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StudyResult:
    """Result of a study.

    Attributes
    ----------
    study : str
        Its name in the catalogue.
    title : str
        Heading of the report.
    seed : int
        The seed of the run.
    rows : list of dict
        Results for programs, one flat object per row; documented in ``docs/validation/studies.md``.
    tables : list of Table
        For readers; the first is the main one.
    plots : list of Plot
        For readers; the first is the main one.
    notes : list of str
        Readings, limits and findings, one plain paragraph each.
    summary : str
        Subject of the study, in one plain paragraph.
    options : mapping
        Options of the run: runs, filters, duration_s, where supported.
    """

    study: str
    title: str
    seed: int
    rows: list[dict[str, Value]]
    tables: list[Table]
    plots: list[Plot]
    notes: list[str] = field(default_factory=list)
    summary: str = ""
    options: Mapping[str, Value | list[str]] = field(default_factory=dict)

    def json_object(self) -> dict[str, Any]:
        """Return the object that ``--json`` prints.

        Returns
        -------
        dict
            ``study, seed, options, rows, notes``; plain Python values, every number finite, None
            in place of non-finite ones.
        """
        return {
            "study": self.study,
            "seed": int(self.seed),
            "options": {name: _plain(value) for name, value in self.options.items()},
            "rows": [{name: _plain(value) for name, value in row.items()} for row in self.rows],
            "notes": list(self.notes),
        }


def _plain(value: object) -> object:
    # NumPy numbers become Python's; JSON has no non-finite numbers.
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
