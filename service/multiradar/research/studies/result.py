"""What a study takes and what it gives: rows for programs, tables and plots for readers.

A study is a module with one function, ``run(options, progress) -> StudyResult``. It knows nothing
of terminals, files or HTML: `multiradar.report` and the command show what it gives.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from multiradar.report.content import Plot, Table, Value

#: Told how many steps of how many are done; the total may be told anew while it runs.
Progress = Callable[[int, int], None]


def step_counter(progress: Progress, total: int) -> Callable[[], None]:
    """Return what tells the progress of one step more each time it is called.

    Parameters
    ----------
    progress : callable
        Told how many steps of how many are done.
    total : int
        Steps in all.

    Returns
    -------
    callable
        To be called after each step.
    """
    done = count(1)
    return lambda: progress(next(done), total)


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """What may be chosen of a study.

    Attributes
    ----------
    runs : int, optional
        Independent realisations, at least 1; None takes the study's own number.
    seed : int
        Seed of everything random, not negative: the same seed gives the same result.
    filters : tuple of str, optional
        Names of the filters to judge, known to the study; None takes all of them.
    duration_s : float, optional
        Length of the scene, s, positive; None takes the study's own.
    """

    runs: int | None = None
    seed: int = 1
    filters: tuple[str, ...] | None = None
    duration_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StudyResult:
    """What a study found.

    Attributes
    ----------
    study : str
        Its name in the catalogue.
    title : str
        Heading of the report.
    seed : int
        The seed it ran with.
    rows : list of dict
        The figures for programs, one flat object a row; documented in ``docs/studies.md``.
    tables : list of Table
        For readers; the first is the main one.
    plots : list of Plot
        For readers; the first is the main one.
    notes : list of str
        Readings, limits and what to see, one plain paragraph each.
    summary : str
        What was studied, in one plain paragraph.
    options : mapping
        What it ran with: runs, filters, duration_s, where it takes them.
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
            in place of what is not.
        """
        return {
            "study": self.study,
            "seed": int(self.seed),
            "options": {name: _plain(value) for name, value in self.options.items()},
            "rows": [{name: _plain(value) for name, value in row.items()} for row in self.rows],
            "notes": list(self.notes),
        }


def _plain(value: object) -> object:
    # Numbers of numpy are told as Python's; JSON has no word for what is not finite.
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
