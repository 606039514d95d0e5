"""The compiled filters behind the verbs of the reference filters, one row at a time."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.estimator import BiasEstimator
from multiradar.estimation.filters._kernels import SEVERAL
from multiradar.estimation.filters.arrays import Rows, Work, result_arrays
from multiradar.estimation.filters.bank import Outcome, find_filter
from multiradar.estimation.filters.joint._joint_kernels import insert_aircraft
from multiradar.estimation.measurement.kinds import (
    KIND_BEARING,
    KIND_FLAT_POLAR,
    KIND_FLAT_POSITION,
    KIND_POSITION,
    KIND_RADAR,
)
from multiradar.estimation.measurement.linearised import cartesian_plot
from multiradar.tracking.delays import delays
from multiradar.tracking.model import bias_columns, filter_model, with_biases
from multiradar.tracking.settings import TrackingSettings
from support.references.reference_filters import Observation
from support.scenarios.scenes import Scene, flat_sites

Floats = NDArray[np.float64]
Form = Literal["ellipsoid", "polar", "place"]
KINDS: dict[Form, int] = {
    "ellipsoid": KIND_RADAR,
    "polar": KIND_FLAT_POLAR,
    "place": KIND_FLAT_POSITION,
}
UPPER = np.triu_indices(4)


def plain_settings(name: str, acceleration: float) -> TrackingSettings:
    """Settings that leave the textbook filter: no gate, no cone, exact heights, constant noise."""
    return TrackingSettings(
        filter_name=name,
        acceleration_density=acceleration,
        downweight_nis=np.inf,
        refuse_nis=np.inf,
        cone_ratio=0.0,
        exact_heights=True,
        manoeuvre_factor_max=1.0,
    )


class CompiledFilter:
    """One of the registered filters on a scene's sensors.

    With `by_epochs` biases are merged only by `publish`, else after each observation. `form` says
    how plots are read; the flat ones want a scene from `flattened`.
    """

    def __init__(
        self,
        scene: Scene,
        settings: TrackingSettings,
        *,
        by_epochs: bool = False,
        slots: int = 16,
        form: Form = "ellipsoid",
    ) -> None:
        self._form = form
        self._sites = flat_sites(scene.plane, scene.sensors)
        self._sensors = scene.sensors
        self._definition = find_filter(settings.filter_name)
        self._by_epochs = by_epochs
        self._book = BiasEstimator(scene.sensors, self._definition)
        columns, delayed = bias_columns(scene.sensors), bool(scene.sensors.delayed.any())
        self._information, self._vector = np.zeros((1, columns, columns)), np.zeros((1, columns))
        self._model = filter_model(scene.sensors, settings, scene.plane, self._book.state)
        if form != "ellipsoid":
            self._model.sites[:, :2] = self._sites
        modes = len(self._model.modes)
        self.arrays = self._definition.aircraft(slots, columns, len(scene.sensors), modes, delayed)

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        self.arrays.mean[aircraft] = mean
        self.arrays.covariance[aircraft] = covariance[UPPER]
        self.arrays.sensitivity[aircraft] = 0.0
        self.arrays.delay[aircraft] = 0.0
        self.arrays.time[aircraft] = time_s
        self.arrays.mode_probability[aircraft] = np.nan
        # A prior from elsewhere: every plot may speak about the biases.
        self.arrays.measured_from[aircraft] = SEVERAL
        insert_aircraft(self.arrays, len(self._sensors.parameter_kind), aircraft)

    def observe(self, observation: Observation) -> None:
        outcome = self.process(observation)
        assert outcome == Outcome.UPDATED, outcome

    def process(self, observation: Observation) -> Outcome:
        """Process a row and return its outcome."""
        rows = Rows(
            slot=np.array([observation.aircraft]),
            time=np.array([observation.time_s]),
            kind=np.array([self._kind(observation)]),
            sensor=np.array([observation.radar]),
            z=self._value(observation)[None, :].copy(),
            height=np.array([observation.height_m]),
            seen=np.array([observation.radar]),
            ground=np.array([-1]),
        )
        result = result_arrays(1, 0, 0)._replace(information=self._information, vector=self._vector)
        work = Work(partitions=np.array([0]), bounds=np.array([0, 1]), order=np.array([0]))
        self._definition.step(work, rows, self._model, self.arrays, result, want_readout=True)
        self.readout = result.readout[0]
        self.innovation = result.innovation[0]
        self._book.log(result.log, rows.sensor)
        if not self._by_epochs:
            self.publish()
        return Outcome(result.outcome[0])

    def publish(self) -> None:
        if self._definition.corrects_biases:
            self._book.set_state(self._model.bias, self._model.bias_covariance)
        else:
            used = np.flatnonzero(~np.isnan(self.arrays.time))
            self._definition.close(used, self._model, self.arrays, self._information, self._vector)
            self._book.merge(self._information, self._vector)
        self._information[:], self._vector[:] = 0.0, 0.0
        self._load()

    def walk(self, duration_s: float) -> None:
        self.publish()
        self._book.drift(duration_s, self.arrays)
        self._load()

    def end(self, aircraft: int) -> None:
        self.arrays.time[aircraft] = np.nan

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        covariance = np.zeros((4, 4))
        covariance[UPPER] = self.arrays.covariance[aircraft]
        covariance = covariance + np.triu(covariance, 1).T
        mean = self.arrays.mean[aircraft].copy()
        if self._definition.keeps_sensitivity:
            sensitivity = self.arrays.sensitivity[aircraft]
            mean += sensitivity @ self._model.bias
            root = sensitivity @ self._model.factor.T
            covariance = covariance + root @ root.T
        return mean, covariance

    def delay(self, aircraft: int) -> tuple[float, float]:
        """Delay of the transponder, and its variance."""
        found, sigma = delays(self.arrays.delay[[aircraft]], self._model)
        return float(found[0]), float(sigma[0]) ** 2

    def biases(self) -> tuple[Floats, Floats]:
        return self._book.state.estimate, self._book.state.covariance

    def _kind(self, observation: Observation) -> int:
        if observation.is_bearing:
            return KIND_BEARING
        return KIND_POSITION if observation.is_position else KINDS[self._form]

    def _value(self, observation: Observation) -> Floats:
        if observation.is_bearing:
            return np.array([0.0, observation.value[1]])
        if self._form != "place" or observation.is_position:
            return observation.value
        return cartesian_plot(self._sites[observation.radar], *observation.value)

    def _load(self) -> None:
        self._model = with_biases(self._model, self._book.state)
