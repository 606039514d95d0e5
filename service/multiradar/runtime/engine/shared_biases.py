"""The biases as all aircraft of an engine share them: merged, walked on, published."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.drift_steps import drift_steps
from multiradar.estimation.bias.estimator import BiasEstimator
from multiradar.estimation.bias.observability import UnobservableBias, unobservable_combinations
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters.arrays import RECENT_TIME, Model, Result
from multiradar.estimation.filters.bank import FilterDefinition
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.model import filter_model, with_biases
from multiradar.tracking.outputs import BiasRecords
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]


class SharedBiases:
    """The published biases of an engine, and what its partitions have said of them since.

    Parameters
    ----------
    sensors : SensorTable
        The sensors and their bias parameters.
    settings : TrackingSettings
        Settings of the tracker.
    definition : FilterDefinition
        Decides how measurements are merged.
    plane : SystemPlane
        The system plane.

    Attributes
    ----------
    model : Model
        What all aircraft share, the published biases in it.
    information : (p, c, c) float64
        What each partition said of the biases since they were merged; steps add to it.
    vector : (p, c) float64
        Its information vector.
    walked_s : float
        Data time up to which the biases have walked.
    """

    def __init__(
        self,
        sensors: SensorTable,
        settings: TrackingSettings,
        definition: FilterDefinition,
        plane: SystemPlane,
    ) -> None:
        self._sensors, self._filter = sensors, definition
        self._book = BiasEstimator(sensors, definition)
        columns = len(sensors.parameter_kind)
        self.information = np.zeros((PARTITIONS, columns, columns))
        self.vector = np.zeros((PARTITIONS, columns))
        self.model: Model = filter_model(sensors, settings, plane, self._book.state)
        self._began_s = self.walked_s = 0.0

    @property
    def state(self) -> BiasState:
        """The biases as they are published."""
        return self._book.state

    def begin(self, time_s: float) -> None:
        """Say when the prior held: the begin of the first epoch."""
        self._began_s = self.walked_s = time_s

    def log(self, log: Floats, sensors: NDArray[np.int64]) -> None:
        """Keep logged measurements, in canonical order, where the filter folds them."""
        self._book.log(log, sensors)

    def unheard(self, result: Result) -> Result:
        """Return a result that shares all with another but the sums about the biases."""
        return result._replace(
            information=np.zeros_like(self.information), vector=np.zeros_like(self.vector)
        )

    def merge(self, pool: AircraftPool) -> None:
        """Merge what was measured into the biases, and publish them."""
        if self._filter.corrects_biases:
            self._book.set_state(self.model.bias, self.model.bias_covariance)
        else:
            self._filter.close(
                pool.bias_contributors(), self.model, pool.aircraft, self.information, self.vector
            )
            self._book.merge(self.information, self.vector)
        if self._filter.stacks_plots:
            # What unheeded aircraft kept must not wait for a later epoch.
            pool.aircraft.recent[:, :, RECENT_TIME] = np.nan
        self.information[:] = 0.0
        self.vector[:] = 0.0
        self._publish()

    def walk(self, until_s: float, pool: AircraftPool) -> None:
        """Let the biases walk until a time, and publish them."""
        if until_s > self.walked_s and self._book.drift(until_s - self.walked_s, pool.aircraft):
            self._publish()
        self.walked_s = until_s

    def open(self, sensor: int, pool: AircraftPool) -> None:
        """Let the offsets of a sensor be found anew, and publish how uncertain they are."""
        if self._book.reset_offsets(sensor, pool.aircraft):
            self._publish()

    def steps(self, epoch_s: float) -> int:
        """Return into how many steps the epoch that begins is divided."""
        if self._filter.stacks_plots:  # Its stacks are of a whole epoch.
            return 1
        return drift_steps(self._book.state, self._sensors.drift, epoch_s)

    def records(self, epoch: int, end_s: float) -> BiasRecords:
        """Return what is said of the biases at the end of an epoch."""
        state, count = self._book.state, len(self._sensors.parameter_kind)
        # The walk since the last measurements included.
        walked = self._sensors.drift**2 * max(end_s - self.walked_s, 0.0)
        return BiasRecords(
            epoch=np.full(count, epoch, np.int64),
            time_s=np.full(count, end_s),
            sensor=self._sensors.parameter_sensor,
            parameter=self._sensors.parameter_kind,
            estimate=state.estimate,
            sigma=np.sqrt(np.diagonal(state.covariance) + walked),
        )

    def untold(self) -> tuple[UnobservableBias, ...]:
        """Return the combinations of biases that the measurements so far have told nothing of."""
        return unobservable_combinations(
            self._sensors, self._book.state.covariance, self.walked_s - self._began_s
        )

    def _publish(self) -> None:
        self.model = with_biases(self.model, self._book.state)
