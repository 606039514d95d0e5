"""The registry of filters: each a compiled step and a way to close an epoch, found by name."""

from dataclasses import dataclass
from enum import IntEnum

from multiradar.errors import UnknownFilterError
from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.filters._step_kernels import BLOM, INTERSECTION, TWO_STAGE, step
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Rows, Work


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
    NO_ROOM = kernels.NO_ROOM


@dataclass(frozen=True, slots=True)
class FilterDefinition:
    """A filter.

    Attributes
    ----------
    name : str
        Its name on the command line and in reports.
    method : int
        Its number in the compiled loop.
    keeps_sensitivity : bool
        Whether each aircraft keeps its dependence on the biases (two-stage).
    folds_log : bool
        Whether the biases take the logged measurements one by one (CI) rather than their sum.
    """

    name: str
    method: int
    keeps_sensitivity: bool
    folds_log: bool

    def step(
        self,
        work: Work,
        rows: Rows,
        model: Model,
        aircraft: Aircraft,
        result: Result,
        *,
        want_readout: bool,
    ) -> None:
        """Take rows of one epoch, in canonical order for each partition.

        Parameters
        ----------
        work : Work
            Which rows, in which order.
        rows : Rows
            The measurements.
        model : Model
            What all aircraft share.
        aircraft : Aircraft
            Changed in place.
        result : Result
            Filled for these rows; sums about the biases are added to.
        want_readout : bool
            Whether to read the aircraft out after each row.
        """
        step(self.method, work, rows, model, aircraft, result, want_readout)


#: Filters by name.
FILTERS = {
    definition.name: definition
    for definition in (
        FilterDefinition("two-stage", TWO_STAGE, keeps_sensitivity=True, folds_log=False),
        FilterDefinition("blom", BLOM, keeps_sensitivity=False, folds_log=False),
        FilterDefinition("ci", INTERSECTION, keeps_sensitivity=False, folds_log=True),
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
