"""Small flat scenes for the sequential form, and the plain filters played on them."""

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from multiradar.research.sequential.plots import Form, Plots, Starts
from multiradar.research.sequential.sensors import BiasPrior, Sensors, flat_radars
from support.references.measurement_models import FlatCartesian, FlatPolar
from support.references.reference_filters import BiasPrior as PlainPrior
from support.references.reference_filters import (
    BlomMacro,
    BlomSeparated,
    CovarianceIntersection,
    JointKalman,
    Observation,
    ReferenceFilter,
    TwoStage,
)
from support.scenarios.report_scene import (
    AZIMUTH_SIGMA_RAD,
    BIAS_DEVIATION,
    BIASES,
    RANGE_SIGMA_M,
    SITES_M,
    report_scene,
)

Floats = NDArray[np.float64]
PLAIN = {
    "joint": JointKalman,
    "two-stage": TwoStage,
    "blom": BlomSeparated,
    "blom-macro": BlomMacro,
    "ci": CovarianceIntersection,
}
MODELS = {"polar": FlatPolar, "linearised": FlatCartesian}
NAMES = sorted(PLAIN)
DRIFT = np.tile([1.0, np.radians(0.02)], len(SITES_M))
START_SIGMA = np.array([1000.0, 1000.0, 300.0, 300.0])


@dataclass(frozen=True)
class SmallScene:
    """Plots of the report's radars, with some missing, and the inputs of the filters."""

    sensors: Sensors
    plots: Plots
    starts: Starts
    truth: Floats
    states: Floats

    def state(self, aircraft: int, time_s: float) -> Floats:
        """The true state (4,) of an aircraft, which flies straight."""
        first = self.states[aircraft]
        return np.concatenate([first[:2] + time_s * first[2:], first[2:]])


def small_scene(
    seed: int,
    *,
    tracks: int = 3,
    duration_s: int = 20,
    drift: float = 0.0,
    missing: float = 0.3,
    start_sigma: Floats = START_SIGMA,
    bias_sigma: Floats = BIAS_DEVIATION,
) -> SmallScene:
    rng = np.random.default_rng(seed)
    scene = report_scene(rng, tracks=tracks, duration_s=duration_s)
    rows = [one for one in scene.observations if rng.uniform() >= missing]
    starts = Starts(
        np.zeros(tracks),
        scene.states + start_sigma * rng.normal(size=scene.states.shape),
        np.tile(np.diag(start_sigma**2), (tracks, 1, 1)),
    )
    prior = BiasPrior(
        BIASES + bias_sigma * rng.normal(size=len(BIASES)), np.diag(bias_sigma**2), drift * DRIFT
    )
    plots = Plots(
        [one.time_s for one in rows],
        [one.aircraft for one in rows],
        [one.radar for one in rows],
        [one.value for one in rows],
    )
    truth = np.array([scene.truth(one.aircraft, one.time_s) for one in rows])
    sensors = flat_radars(SITES_M, RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD, prior)
    return SmallScene(sensors, plots, starts, truth, scene.states)


def plain_filter(name: str, form: Form, scene: SmallScene, acceleration: float) -> ReferenceFilter:
    """The plain form of a filter, with all aircraft initiated."""
    prior = scene.sensors.prior
    model = MODELS[form](SITES_M, RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD)
    one: ReferenceFilter = PLAIN[name](
        model, PlainPrior(prior.mean, prior.covariance, prior.drift), acceleration
    )
    for aircraft in range(len(scene.starts)):
        one.start(aircraft, 0.0, scene.starts.mean[aircraft], scene.starts.covariance[aircraft])
    return one


def play_plain(one: ReferenceFilter, scene: SmallScene, walk_s: float | None = None) -> None:
    """Give all plots to a plain filter; an epoch of the macro-filter is a moment of an aircraft."""
    walked = 0.0
    rows = range(len(scene.plots))
    plots = scene.plots
    for (time_s, aircraft), group in groupby(
        rows, key=lambda row: (float(plots.time_s[row]), int(plots.aircraft[row]))
    ):
        while walk_s is not None and time_s >= walked + walk_s:
            walked += walk_s
            one.walk(walk_s)
        for row in group:
            one.observe(Observation(time_s, aircraft, int(plots.sensor[row]), plots.value[row]))
        if isinstance(one, BlomMacro):
            one.publish()
