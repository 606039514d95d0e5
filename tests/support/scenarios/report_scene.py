"""The model problem of the IMM UrO RAN report (2016), section 1.6, on a flat plane."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.flat import flat_plots
from multiradar.simulation.scenario.file import builtin_scenario
from support.references.reference_filters import BiasPrior, Observation, ReferenceFilter

Floats = NDArray[np.float64]

_SCENE = builtin_scenario("report-1-6")
_TRAFFIC = _SCENE.traffic[0]
SITES_M = np.array([[one.east_m, one.north_m] for one in _SCENE.sensors])
RANGE_SIGMA_M = _SCENE.sensors[0].range_sigma_m
AZIMUTH_SIGMA_RAD = _SCENE.sensors[0].azimuth_sigma_rad
BIASES = np.array([[bias.value for bias in one.biases[:2]] for one in _SCENE.sensors]).ravel()

POSITION_DEVIATION_M = 1_000.0
VELOCITY_DEVIATION_MPS = 300.0
BIAS_DEVIATION = np.tile([500.0, np.radians(0.3)], len(SITES_M))


@dataclass(frozen=True)
class ReportScene:
    """Straight tracks, states (n, 4) at time 0, and all plots in order."""

    states: Floats
    observations: Sequence[Observation]
    duration_s: float

    def truth(self, aircraft: int, time_s: float) -> Floats:
        state = self.states[aircraft]
        return np.concatenate([state[:2] + time_s * state[2:], state[2:]])


def report_scene(
    rng: np.random.Generator, *, tracks: int = 15, duration_s: int = 1000, interval_s: int = 1
) -> ReportScene:
    """Random straight tracks, each seen by each radar at every interval."""
    scene = replace(
        _SCENE,
        seed=int(rng.integers(2**32)),
        duration_s=float(duration_s),
        traffic=(replace(_TRAFFIC, count=tracks),),
        sensors=tuple(replace(one, interval_s=float(interval_s)) for one in _SCENE.sensors),
    )
    plots = flat_plots(scene, rng)
    values = np.stack([plots.range_m, plots.azimuth_rad], axis=-1)
    rows = zip(plots.time_s.tolist(), plots.aircraft.tolist(), plots.radar.tolist(), values,
               strict=True)  # fmt: skip
    return ReportScene(plots.states[0], [Observation(*row) for row in rows], duration_s)


def bias_prior(drift: float = 0.0) -> BiasPrior:
    """Biases unknown within 500 m and 0.3°; drift in units of 1 m/√s and 0.02°/√s."""
    rates = np.tile([1.0, np.radians(0.02)], len(SITES_M))
    return BiasPrior(np.zeros(len(BIASES)), np.diag(BIAS_DEVIATION**2), drift * rates)


def start_all(reference: ReferenceFilter, scene: ReportScene, rng: np.random.Generator) -> None:
    """Give the filter every track within the report's initial deviations."""
    sigma = np.repeat([POSITION_DEVIATION_M, VELOCITY_DEVIATION_MPS], 2)
    for aircraft, state in enumerate(scene.states):
        guess = state + sigma * rng.normal(size=4)
        reference.start(aircraft, 0.0, guess, np.diag(sigma**2))
