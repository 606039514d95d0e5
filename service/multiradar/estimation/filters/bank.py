"""The registry of filters: each a compiled step and a way to close an epoch, found by name."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from multiradar.errors import UnknownFilterError
from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.filters._separated_kernels import step_blom, step_intersection
from multiradar.estimation.filters._two_stage_kernels import step_two_stage
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work

Step = Callable[[Work, Rows, Model, Aircraft, Result, bool], None]


class Outcome(IntEnum):
    """What became of a measurement in the filter."""

    UPDATED = kernels.UPDATED
    STARTED = kernels.STARTED
    RESTARTED = kernels.RESTARTED
    UNASSOCIATED = kernels.UNASSOCIATED
    REFUSED = kernels.REFUSED
    CONE_OF_SILENCE = kernels.CONE
    UNLOCATABLE = kernels.UNLOCATABLE
    SINGULAR = kernels.SINGULAR
    UNSUPPORTED = kernels.UNSUPPORTED


@dataclass(frozen=True, slots=True)
class FilterDefinition:
    """A filter.

    Attributes
    ----------
    name : str
        Its name on the command line and in reports.
    step : Step
        Compiled: takes rows of one epoch, in canonical order for each partition.
    keeps_sensitivity : bool
        Whether each aircraft keeps its dependence on the biases (two-stage).
    folds_log : bool
        Whether the biases take the logged measurements one by one (CI) rather than their sum.
    """

    name: str
    step: Step
    keeps_sensitivity: bool
    folds_log: bool


#: Filters by name.
FILTERS = {
    definition.name: definition
    for definition in (
        FilterDefinition("two-stage", step_two_stage, keeps_sensitivity=True, folds_log=False),
        FilterDefinition("blom", step_blom, keeps_sensitivity=False, folds_log=False),
        FilterDefinition("ci", step_intersection, keeps_sensitivity=False, folds_log=True),
    )
}


def find_filter(name: str) -> FilterDefinition:
    """Return the filter of a name.

    Parameters
    ----------
    name : str
        `two-stage`, `blom` or `ci`.

    Returns
    -------
    FilterDefinition
        The filter.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.
    """
    try:
        return FILTERS[name]
    except KeyError:
        raise UnknownFilterError(name, list(FILTERS)) from None
