"""The sensor biases shared by all tracks of an engine: merge, drift, publication."""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.drift_steps import drift_steps
from multiradar.estimation.bias.estimator import BiasEstimator
from multiradar.estimation.bias.observability import UnobservableBias, unobservable_combinations
from multiradar.estimation.bias.site_use import UNTOUCHED_RATIO_MIN, SiteUse
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters._kernels import RESTARTED
from multiradar.estimation.filters.arrays import RECENT_TIME, Model, Result, Rows
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.state import Fields, carry_state
from multiradar.tracking.model import bias_columns, filter_model, with_biases
from multiradar.tracking.outputs import BiasRecords
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]


class SharedBiases:
    """The published biases of an engine, and the information gathered since.

    Parameters
    ----------
    sensors : SensorTable
        The sensors and their bias parameters.
    settings : TrackingSettings
        Settings of the tracker.
    definition : FilterDefinition
        Determines how measurements are merged.
    plane : SystemPlane
        The system plane.

    Attributes
    ----------
    model : Model
        The model shared by all tracks, with the published biases.
    information : (p, c, c) float64
        Bias information of each partition since the last merge; steps add to it.
    vector : (p, c) float64
        Its information vector.
    walked_s : float
        Data time up to which the biases have drifted.
    """

    STATE: ClassVar[Fields] = {
        "_estimator": BiasEstimator,
        "information": np.ndarray,
        "vector": np.ndarray,
        "model": Model,
        "_started_s": float,
        "drifted_s": float,
        "_site_use": SiteUse,
    }

    def __init__(
        self,
        sensors: SensorTable,
        settings: TrackingSettings,
        definition: FilterDefinition,
        plane: SystemPlane,
    ) -> None:
        self._sensors, self._filter = sensors, definition
        self._epoch_s = settings.epoch_s
        self._estimator = BiasEstimator(sensors, definition)
        columns = bias_columns(sensors)
        self.information = np.zeros((PARTITIONS, columns, columns))
        self.vector = np.zeros((PARTITIONS, columns))
        self.model: Model = filter_model(sensors, settings, plane, self._estimator.state)
        self._started_s = self.drifted_s = 0.0
        self._site_use = SiteUse(sensors)

    @property
    def state(self) -> BiasState:
        """The published biases."""
        return self._estimator.state

    def start_from(self, biases: BiasState) -> None:
        """Start from the end of an earlier run in place of the priors; nothing was processed."""
        self._estimator.set_state(biases.estimate, biases.covariance)
        self._publish()

    def start(self, time_s: float) -> None:
        """Set the time of the prior: the start of the first epoch."""
        self._started_s = self.drifted_s = time_s

    def log(self, log: Floats, sensors: NDArray[np.int64]) -> None:
        """Log measurements, in canonical order, where the filter folds them."""
        self._estimator.log(log, sensors)

    def record_sites(
        self, rows: Rows, result: Result, pool: AircraftPool, *, first: int, last: int
    ) -> None:
        """Record from which sites the aircraft of the rows first…last were measured."""
        if self._site_use.is_settled:
            return
        accepted = first + np.flatnonzero(result.outcome[first:last] <= RESTARTED)
        self._site_use.record(
            rows.sensor[accepted], pool.aircraft.measured_from[rows.slot[accepted]]
        )

    def without_bias_sums(self, result: Result) -> Result:
        """Return a view of a result with separate, discarded sums for the biases."""
        return result._replace(
            information=np.zeros_like(self.information), vector=np.zeros_like(self.vector)
        )

    def merge(self, pool: AircraftPool) -> None:
        """Merge the gathered information into the biases, and publish them."""
        if self._filter.corrects_biases:
            self._estimator.set_state(self.model.bias, self.model.bias_covariance)
        else:
            self._filter.close(
                pool.bias_contributors(), self.model, pool.aircraft, self.information, self.vector
            )
            self._estimator.merge(self.information, self.vector)
        if self._filter.stacks_plots:
            # Plots retained by tracks that do not contribute must not wait for a later epoch.
            pool.aircraft.recent[:, :, RECENT_TIME] = np.nan
        self.information[:] = 0.0
        self.vector[:] = 0.0
        self._publish()

    def drift(self, until_s: float, pool: AircraftPool) -> None:
        """Drift the biases up to a time, and publish them."""
        if until_s > self.drifted_s and self._estimator.drift(
            until_s - self.drifted_s, pool.aircraft
        ):
            self._publish()
        self.drifted_s = until_s

    def reset_offsets(self, sensor: int, pool: AircraftPool) -> None:
        """Reset the offsets of a sensor to their prior uncertainty, and publish them."""
        if self._estimator.reset_offsets(sensor, pool.aircraft):
            self._publish()

    def discard(self, change: SensorChange, pool: AircraftPool) -> None:
        """Remove what is known about the biases that are reset; the epoch is closed."""
        self._estimator.discard(change.reset[self._sensors.parameter_sensor], pool.aircraft)

    def carry(self, old: "SharedBiases", change: SensorChange) -> None:
        """Continue the biases for other sensors; the epoch is closed."""
        self._started_s, self.drifted_s = old._started_s, old.drifted_s
        carry_state(old._site_use, self._site_use, change)
        carry_state(old._estimator, self._estimator, change)
        self._publish()

    def steps(self, epoch_s: float) -> int:
        """Return the number of steps of the next epoch."""
        if self._filter.stacks_plots:  # Its stacks are of a whole epoch.
            return 1
        return drift_steps(self._estimator.state, self._sensors.drift, epoch_s)

    def enter_steps(
        self, time_s: Floats, rows: tuple[int, int], steps: int, pool: AircraftPool
    ) -> Iterator[tuple[int, int]]:
        """Yield the rows of one epoch step by step, with bias drift from each step to the next.

        Steps are numbered from time zero, as epochs are. The number of steps in an epoch is a power
        of two, so that their bounds are exact.
        """
        (first, last), epoch_s = rows, self._epoch_s
        number = np.floor(time_s[first:last] / epoch_s * steps).astype(np.int64)
        cuts = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), last - first]
        for begin, end in itertools.pairwise(cuts):
            start_s = int(number[begin]) * epoch_s / steps
            if start_s > self.drifted_s:
                self.merge(pool)
                self.drift(start_s, pool)
            yield first + begin, first + end

    def records(self, epoch: int, end_s: float) -> BiasRecords:
        """Return the bias estimates at the end of an epoch."""
        state, count = self._estimator.state, len(self._sensors.parameter_kind)
        # Includes the drift since the last measurements.
        drifted = self._sensors.drift**2 * max(end_s - self.drifted_s, 0.0)
        return BiasRecords(
            epoch=np.full(count, epoch, np.int64),
            time_s=np.full(count, end_s),
            sensor=self._sensors.parameter_sensor,
            parameter=self._sensors.parameter_kind,
            estimate=state.estimate,
            sigma=np.sqrt(np.diagonal(state.covariance) + drifted),
        )

    def unobservable_biases(self) -> tuple[UnobservableBias, ...]:
        """Return the combinations of biases that are not observable so far, with the reasons."""
        found = unobservable_combinations(
            self._sensors, self._estimator.state.covariance, self.drifted_s - self._started_s
        )
        return tuple(replace(one, reason=self._reason(one)) for one in found)

    def _reason(self, one: UnobservableBias) -> str:
        if one.prior_ratio < UNTOUCHED_RATIO_MIN:
            return ""
        return self._site_use.reason(
            int(self._sensors.parameter_sensor[np.argmax(np.abs(one.weights))])
        )

    def _publish(self) -> None:
        self.model = with_biases(self.model, self._estimator.state)
