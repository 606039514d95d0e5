"""Registry of filters by name: each has a compiled step and a function that closes an epoch."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, UnknownFilterError
from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.filters._step_kernels import BLOM, INTERSECTION, TWO_STAGE, step
from multiradar.estimation.filters.arrays import (
    Aircraft,
    Model,
    Result,
    Rows,
    Work,
    aircraft_arrays,
)
from multiradar.estimation.filters.imm._imm_step_kernels import IMM, imm_step
from multiradar.estimation.filters.joint._joint_kernels import JOINT, joint_step
from multiradar.estimation.filters.separated._macro_kernels import MACRO, stack_all
from multiradar.estimation.measurement._kernels import PARAMETER_TIME_OFFSET

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: The joint filter has one covariance over all aircraft, and every plot updates all of it: with
#: this many aircraft a plot costs some 20 ms, and the matrix 134 MB.
JOINT_AIRCRAFT_MAX = 1024


class Outcome(IntEnum):
    """Outcome of a measurement in the filter."""

    UPDATED = kernels.UPDATED
    STARTED = kernels.STARTED
    RESTARTED = kernels.RESTARTED
    UNASSOCIATED = kernels.UNASSOCIATED
    REFUSED = kernels.REJECTED
    CONE_OF_SILENCE = kernels.CONE
    UNLOCATABLE = kernels.UNLOCATABLE
    SINGULAR = kernels.SINGULAR
    UNSUPPORTED = kernels.UNSUPPORTED
    NO_ROOM = kernels.NO_ROOM
    IMPLAUSIBLE = kernels.IMPLAUSIBLE


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
        Whether each aircraft stores its sensitivity to the biases (two-stage).
    folds_log : bool
        Whether logged measurements update the biases one by one (CI) instead of as a sum.
    corrects_biases : bool
        Whether the step itself updates the biases of the model, measurement by measurement (joint):
        one worker then processes all rows in canonical order, whatever their partition.
    stacks_plots : bool
        Whether aircraft store their plots until the end of the epoch (Blom's macro-filter).
    estimates_time_offsets : bool
        Whether a time offset may be among the bias parameters (see `_time_offset_kernels`).
    estimates_delays : bool
        Whether each aircraft may have a delay of its transponder (see `_delay_kernels`).
    keeps_modes : bool
        Whether each aircraft is in one of several modes of motion (IMM).
    accepts_bearings : bool
        Whether it supports bearings.
    bounds_bias_errors : bool
        Whether the sigma of a bias is consistent with its error.
    aircraft_max : int or None
        Maximum number of aircraft; None if limited by memory only.

    References
    ----------
    IMM UrO RAN report (2016), sections 1.3 (joint), 1.4 (both filters of Blom) and 1.5 (CI);
    Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367
    (two-stage).
    """

    name: str
    method: int
    keeps_sensitivity: bool = False
    folds_log: bool = False
    corrects_biases: bool = False
    stacks_plots: bool = False
    estimates_time_offsets: bool = False
    estimates_delays: bool = False
    keeps_modes: bool = False
    accepts_bearings: bool = False
    bounds_bias_errors: bool = True
    aircraft_max: int | None = None

    def aircraft(
        self, slots: int, columns: int, sensors: int, modes: int, delays: bool = False
    ) -> Aircraft:
        """Return arrays for aircraft, with the columns that this filter uses.

        Parameters
        ----------
        slots : int
            Maximum number of aircraft.
        columns : int
            Number of bias parameters, with that of the delay.
        sensors : int
            Number of sensors.
        modes : int
            Number of modes of motion.
        delays : bool
            Whether delays of transponders are estimated.

        Returns
        -------
        Aircraft
            None of them initiated.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.24): the blocks of P̂ that sections 1.3 to 1.5 use;
        Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, for
        the sensitivity.
        """
        return aircraft_arrays(
            slots,
            columns if self.keeps_sensitivity else 0,
            joint_columns=columns if self.corrects_biases else None,
            recent_sensors=sensors if self.stacks_plots else 0,
            modes=modes if self.keeps_modes else 0,
            delays=delays,
        )

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
        """Process rows of one epoch, in canonical order for each partition.

        Parameters
        ----------
        work : Work
            Which rows, in which order.
        rows : Rows
            The measurements.
        model : Model
            Common to all aircraft.
        aircraft : Aircraft
            Changed in place.
        result : Result
            Filled for these rows; the sums about the biases are accumulated.
        want_readout : bool
            Whether to write a readout after each row.

        References
        ----------
        IMM UrO RAN report (2016), equations (1.28) to (1.33) (joint), (1.34) to (1.38) (both
        filters of Blom) and (1.43) to (1.45) (CI); Friedland, B., "Treatment of bias in recursive
        filtering", IEEE TAC 14 (1969), 359-367 (two-stage).
        """
        if self.method == JOINT:
            joint_step(work, rows, model, aircraft, result, want_readout)
        elif self.method == IMM:
            imm_step(work, rows, model, aircraft, result, want_readout)
        else:
            step(self.method, work, rows, model, aircraft, result, want_readout)

    def close(
        self,
        slots: Integers,
        model: Model,
        aircraft: Aircraft,
        information: Floats,
        vector: Floats,
    ) -> None:
        """Close an epoch: add the information of the stored plots to the biases.

        Parameters
        ----------
        slots : (n,) int64
            Slots in use, ascending.
        model : Model
            Common to all aircraft.
        aircraft : Aircraft
            Their stored plots are cleared.
        information : (p, c, c) float64
            Sums of the information of each partition, upper triangle; accumulated.
        vector : (p, c) float64
            Sums of the information vector; accumulated.

        References
        ----------
        IMM UrO RAN report (2016), section 1.4, the macro-filter: Λ_ς with H, interpreted as the
        stacked measurement of the m′ radars.
        """
        if self.stacks_plots:
            stack_all(slots, model, aircraft, information, vector)


#: Filters by name.
FILTERS = {
    definition.name: definition
    for definition in (
        FilterDefinition(
            "two-stage",
            TWO_STAGE,
            keeps_sensitivity=True,
            estimates_time_offsets=True,
            estimates_delays=True,
            accepts_bearings=True,
        ),
        FilterDefinition(
            "imm",
            IMM,
            keeps_sensitivity=True,
            estimates_time_offsets=True,
            estimates_delays=True,
            keeps_modes=True,
            accepts_bearings=True,
        ),
        FilterDefinition("joint", JOINT, corrects_biases=True, aircraft_max=JOINT_AIRCRAFT_MAX),
        FilterDefinition("blom", BLOM, bounds_bias_errors=False),
        FilterDefinition("blom-macro", MACRO, stacks_plots=True),
        FilterDefinition("ci", INTERSECTION, folds_log=True),
    )
}


def find_filter_for(
    name: str, parameter_kinds: NDArray[np.integer[Any]], *, delays: bool = False
) -> FilterDefinition:
    """Return a filter by name if it can estimate these bias parameters.

    Parameters
    ----------
    name : str
        Name of the filter.
    parameter_kinds : (c,) ndarray of int
        Kinds of the bias parameters, as in `SensorTable.parameter_kind`.
    delays : bool
        Whether delays of transponders are to be estimated.

    Returns
    -------
    FilterDefinition
        The filter.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.
    ConfigurationError
        If a time offset is to be estimated by a filter that relinearises it at every plot. It would
        become certain of a common delay of all radars, which is unobservable. If delays of
        transponders are to be estimated by a filter without the sensitivity that they need.
    """
    definition = find_filter(name)
    if delays and not definition.estimates_delays:
        able = " or ".join(one.name for one in FILTERS.values() if one.estimates_delays)
        raise ConfigurationError(
            f"filter: expected {able} if transponder_delay_sigma_m is configured, was {name}"
        )
    timed = bool(np.any(parameter_kinds == PARAMETER_TIME_OFFSET))
    if timed and not definition.estimates_time_offsets:
        able = ", ".join(one.name for one in FILTERS.values() if one.estimates_time_offsets)
        raise ConfigurationError(
            f"filter: expected {able} if time_offset_s is estimated, was {name}"
        )
    return definition


def find_filter(name: str) -> FilterDefinition:
    """Return a filter by name.

    Parameters
    ----------
    name : str
        `two-stage`, `imm`, `joint`, `blom`, `blom-macro` or `ci`.

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
