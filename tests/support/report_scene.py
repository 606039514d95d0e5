"""The model problem of the IMM UrO RAN report (2016), section 1.6, on a flat plane."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from support.reference_filters import BiasPrior, Observation, ReferenceFilter

Floats = NDArray[np.float64]

# Table of section 1.6. The table lists north first; here it is (east, north).
SITES_M = np.array([[-20e3, -20e3], [-30e3, 230e3], [235e3, -35e3]])
RANGE_BIAS_M = np.array([400.0, 130.0, -300.0])
AZIMUTH_BIAS_DEG = np.array([-0.19, -0.16, 0.17])
RANGE_SIGMA_M = 15.0
AZIMUTH_SIGMA_RAD = float(np.radians(0.05))
BIASES = np.stack([RANGE_BIAS_M, np.radians(AZIMUTH_BIAS_DEG)], axis=-1).ravel()

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
    course, speed = rng.uniform(0, 2 * np.pi, tracks), rng.uniform(150, 250, tracks)
    states = np.stack(
        [*rng.uniform(-50e3, 250e3, (2, tracks)), speed * np.sin(course), speed * np.cos(course)],
        axis=-1,
    )
    scene = ReportScene(states, (), duration_s)
    return ReportScene(states, list(_plots(rng, scene, interval_s)), duration_s)


def _plots(rng: np.random.Generator, scene: ReportScene, interval_s: int) -> Iterator[Observation]:
    sigmas = np.array([RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD])
    for time_s in range(interval_s, int(scene.duration_s) + 1, interval_s):
        for aircraft in range(len(scene.states)):
            for radar, site in enumerate(SITES_M):
                line = scene.truth(aircraft, time_s)[:2] - site
                value = np.array([np.hypot(*line), np.arctan2(line[0], line[1])])
                value += BIASES[2 * radar : 2 * radar + 2] + sigmas * rng.normal(size=2)
                yield Observation(float(time_s), aircraft, radar, value)


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
