"""Bias estimation by epochs: collects information, updates the biases at the end of an epoch."""

from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias._kernels import fold_biases
from multiradar.estimation.bias._matrix_kernels import multiply
from multiradar.estimation.bias.store import (
    BiasState,
    add_information,
    drift,
    multiplied,
    prior,
    symmetric_inverse,
    widened,
)
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.estimation.filters.two_stage._two_stage_kernels import apply_bias_drift
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)
from multiradar.state import Fields

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class BiasEstimator:
    """The published biases, and the log that waits for the end of the epoch.

    Parameters
    ----------
    sensors : SensorTable
        The sensors and their bias parameters.
    definition : FilterDefinition
        Decides how measurements update the biases.

    References
    ----------
    IMM UrO RAN report (2016), sections 1.3 to 1.5, for the bias part; Friedland, B., "Treatment of
    bias in recursive filtering", IEEE TAC 14 (1969), 359-367, for the sums of information over
    aircraft. Adding them by epochs is the project's own.
    """

    STATE: ClassVar[Fields] = {
        "_log": list[tuple[np.ndarray, np.ndarray]],
        "state": BiasState,
    }

    def __init__(self, sensors: SensorTable, definition: FilterDefinition) -> None:
        self._sensors = sensors
        self._definition = definition
        self._starts = column_starts(sensors)
        self._log: list[tuple[Floats, Integers]] = []
        self.state: BiasState = prior(sensors)

    def log(self, log: Floats, sensors: Integers) -> None:
        """Store logged measurements of the epoch, in canonical order, if the filter uses the log.

        Parameters
        ----------
        log : (n, LOG_COUNT) float64
            As `multiradar.estimation.filters.arrays.Result.log`.
        sensors : (n,) int64
            Index of the sensor of each.

        References
        ----------
        IMM UrO RAN report (2016), the text after equation (1.46): each measurement corrects ς_j by
        covariance intersection, one after the other.
        """
        if self._definition.folds_log:
            informs = log[:, 5] > 0.0
            self._log.append((log[informs], sensors[informs]))

    def merge(self, information: Floats, vector: Floats) -> None:
        """Update the biases by the information of the epoch: sums by partition, or the log by row.

        Parameters
        ----------
        information : (p, c, c) float64
            Sums of the information of each partition, upper triangle.
        vector : (p, c) float64
            Sums of the information vector.

        References
        ----------
        Friedland, B., "Treatment of bias in recursive filtering", IEEE TAC 14 (1969), 359-367, in
        information form; IMM UrO RAN report (2016), equation (1.37) for the separated filters, and
        the text after (1.46) for covariance intersection.
        """
        if self._definition.folds_log:
            self._fold()
            return
        count = len(self.state.estimate)
        total = np.zeros((count, count))
        total_vector = np.zeros(count)
        # One after the other: the sum must not depend on a library's order of summation. The column
        # of the delays of transponders has no information.
        for part, part_vector in zip(
            information[:, :count, :count], vector[:, :count], strict=True
        ):
            total += part
            total_vector += part_vector
        upper, above = _triangles(count)
        total = np.where(upper, total, 0.0) + np.where(above, total, 0.0).T
        self.state = add_information(self.state, total, total_vector)

    def set_state(self, estimate: Floats, covariance: Floats) -> None:
        """Set the biases to those the filter has corrected itself (joint).

        Parameters
        ----------
        estimate : (c,) float64
            The estimates.
        covariance : (c, c) float64
            Their covariance.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.32), within the step of the filter.
        """
        self.state = BiasState(estimate.copy(), covariance.copy(), self.state.scale)

    def drift(self, duration_s: float, aircraft: Aircraft) -> bool:
        """Apply the drift of the biases, and adjust the aircraft that depend on them.

        Parameters
        ----------
        duration_s : float
            How long, s of data time.
        aircraft : Aircraft
            Changed in place if the filter stores the sensitivity.

        Returns
        -------
        bool
            Whether any bias drifts.

        References
        ----------
        IMM UrO RAN report (2016), equations (1.6) and (1.25). The adjustment of the aircraft is the
        project's own: see `multiradar.estimation.bias.store.drift`.
        """
        rates = self._sensors.drift
        if not rates.any():
            return False
        self._walk(rates, duration_s, aircraft)
        return True

    def reset_offsets(self, sensor: int, aircraft: Aircraft) -> bool:
        """Reset the offsets of a sensor to their prior uncertainty after a jump.

        Parameters
        ----------
        sensor : int
            The sensor.
        aircraft : Aircraft
            Changed in place if the filter stores the sensitivity.

        Returns
        -------
        bool
            Whether any offset of it is estimated.

        References
        ----------
        The project's own: one drift step with the prior variance, equation (1.25) of the IMM UrO
        RAN report (2016), so that the aircraft keep their information.
        """
        offsets = np.isin(
            self._sensors.parameter_kind, (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET)
        )
        opened = offsets & (self._sensors.parameter_sensor == sensor)
        if not opened.any():
            return False
        self._walk(np.where(opened, self._sensors.prior_sigma, 0.0), 1.0, aircraft)
        return True

    def discard(self, columns: NDArray[np.bool_], aircraft: Aircraft) -> None:
        """Remove what is known about some biases, and keep all that is known about the others.

        Parameters
        ----------
        columns : (c,) bool
            The biases. Their estimates have no meaning afterwards, until a prior replaces them.
        aircraft : Aircraft
            Changed in place: their uncertainty by these biases becomes one of their own.

        References
        ----------
        The project's own: equation (1.25) of the IMM UrO RAN report (2016) with an infinite drift
        of these biases. With K the others and J these, G = [[I, 0], [P_JK P_KK⁻¹, 0]], and G Q_ς
        has the block P_JJ - P_JK P_KK⁻¹ P_KJ only.
        """
        if not columns.any():
            return
        estimate, covariance = self.state.estimate, self.state.covariance.copy()
        lost, kept = np.flatnonzero(columns), np.flatnonzero(~columns)
        if self._definition.keeps_sensitivity:
            scaled = covariance / np.outer(self.state.scale, self.state.scale)
            inner = symmetric_inverse(np.ascontiguousarray(scaled[np.ix_(kept, kept)]))
            cross = np.ascontiguousarray(scaled[np.ix_(lost, kept)])
            regression = multiply(cross, inner)
            own = scaled[np.ix_(lost, lost)] - multiply(regression, np.ascontiguousarray(cross.T))
            regression *= np.divide.outer(self.state.scale[lost], self.state.scale[kept])
            own *= np.outer(self.state.scale[lost], self.state.scale[lost])
            gain, spread = np.diag((~columns).astype(np.float64)), np.zeros_like(covariance)
            gain[np.ix_(lost, kept)] = regression
            spread[np.ix_(lost, lost)] = 0.5 * (own + own.T)
            self._adjust(estimate - multiplied(gain, estimate), gain, spread, aircraft)
        covariance[np.ix_(lost, kept)] = covariance[np.ix_(kept, lost)] = 0.0
        if self._definition.corrects_biases:
            aircraft.joint[lost] = aircraft.joint[:, lost] = 0.0
        self.state = BiasState(estimate, covariance, self.state.scale)

    def carry(self, old: "BiasEstimator", change: SensorChange) -> None:
        """Continue the estimates of an estimator for other sensors, without those that are reset.

        The epoch is closed: there is no log.
        """
        same = np.flatnonzero(~change.reset[old._sensors.parameter_sensor])
        self.state.estimate[same] = old.state.estimate[same]
        self.state.covariance[np.ix_(same, same)] = old.state.covariance[np.ix_(same, same)]

    def _walk(self, rates: Floats, duration_s: float, aircraft: Aircraft) -> None:
        self.state, gain = drift(self.state, rates, duration_s)
        if self._definition.keeps_sensitivity:
            complement = self.state.estimate - multiplied(gain, self.state.estimate)
            self._adjust(complement, gain, gain * (rates**2 * duration_s), aircraft)

    # Express the aircraft by the biases after a change, of which G is the regression.
    def _adjust(self, complement: Floats, gain: Floats, spread: Floats, aircraft: Aircraft) -> None:
        columns = aircraft.sensitivity.shape[2]
        apply_bias_drift(
            np.flatnonzero(~np.isnan(aircraft.time)), aircraft,
            np.append(complement, np.zeros(columns - len(complement))),
            widened(gain, columns, 1.0), widened(spread, columns, 0.0),
        )  # fmt: skip

    def _fold(self) -> None:
        if not self._log:
            return
        estimate = self.state.estimate.copy()
        covariance = self.state.covariance.copy()
        fold_biases(
            np.concatenate([log for log, _ in self._log]),
            np.concatenate([sensors for _, sensors in self._log]),
            self._starts,
            self.state.scale**-2.0,
            estimate,
            covariance,
        )
        self._log.clear()
        self.state = BiasState(estimate, covariance, self.state.scale)


def column_starts(sensors: SensorTable) -> Integers:
    """Return the first column of each sensor in the bias vector.

    Parameters
    ----------
    sensors : SensorTable
        The sensors; their parameters are grouped by sensor.

    Returns
    -------
    (m + 1,) int64
        Sensor j has the columns from item j up to item j + 1.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.8): the order of ς in the stacked vector.
    """
    return np.searchsorted(sensors.parameter_sensor, np.arange(len(sensors) + 1)).astype(np.int64)


# Which elements of a square matrix are in its upper triangle, with and without the diagonal.
@cache
def _triangles(count: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    return ~np.tri(count, k=-1, dtype=np.bool_), ~np.tri(count, dtype=np.bool_)
