"""Plays a scene to a reference filter: births at the first plot, deaths after the last."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from support.references.reference_filters import BiasPrior, Observation, ReferenceFilter
from support.scenarios.scenes import Scene

Floats = NDArray[np.float64]

#: Standard deviations of the initial state given to a filter: m, m, m/s, m/s.
START_SIGMA = np.array([500.0, 500.0, 40.0, 40.0])


def observations(scene: Scene) -> list[Observation]:
    """The plots of a scene, in order, by index of aircraft and radar."""
    batch = scene.batch
    return [
        Observation(
            float(batch.time_s[row]),
            int(scene.aircraft[row]),
            int(batch.sensor[row]),
            np.array([batch.range_m[row], batch.azimuth_rad[row]]),
            float(batch.height_m[row]),
        )
        for row in range(len(batch))
    ]


def bias_prior(scene: Scene) -> BiasPrior:
    """The prior of the sensor table."""
    sensors = scene.sensors
    return BiasPrior(sensors.prior_mean, np.diag(sensors.prior_sigma**2), sensors.drift)


def start_guesses(rng: np.random.Generator, scene: Scene) -> dict[int, tuple[float, Floats]]:
    """For each aircraft the time of its first plot, and its true state then, off by START_SIGMA."""
    first = {int(one): int(np.argmax(scene.aircraft == one)) for one in np.unique(scene.aircraft)}
    return {
        aircraft: (
            float(scene.batch.time_s[row]),
            scene.truth[row] + START_SIGMA * rng.normal(size=4),
        )
        for aircraft, row in first.items()
    }


def play(
    scene: Scene,
    filters: list[ReferenceFilter],
    guesses: dict[int, tuple[float, Floats]],
    *,
    walk_s: float | None = None,
    ends: bool = False,
) -> Iterator[tuple[int, Observation]]:
    """Feed all filters plot by plot; yield each row after it was taken.

    The biases walk every `walk_s` seconds. With `ends` an aircraft is ended after the row of its
    last plot has been yielded.
    """
    started: set[int] = set()
    last = {int(one): int(np.flatnonzero(scene.aircraft == one)[-1]) for one in guesses}
    walked = float(scene.batch.time_s[0])
    for row, observation in enumerate(observations(scene)):
        while walk_s is not None and observation.time_s >= walked + walk_s:
            walked += walk_s
            for one in filters:
                one.walk(walk_s)
        for one in filters:
            if observation.aircraft not in started:
                time_s, guess = guesses[observation.aircraft]
                one.start(observation.aircraft, time_s, guess, np.diag(START_SIGMA**2))
            one.observe(observation)
        started.add(observation.aircraft)
        yield row, observation
        if ends and row == last[observation.aircraft]:
            for one in filters:
                one.end(observation.aircraft)
