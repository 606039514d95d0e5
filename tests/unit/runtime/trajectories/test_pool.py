"""Bundles share scratch memory only; rejected plots are counted and affect no other bundle."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from multiradar.errors import CovarianceError
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    LocatedPlot,
    NotLocated,
    PlotLocator,
    Published,
)
from multiradar.runtime.trajectories.pool import ACCEPTED, BundlePool, warm_up
from multiradar.runtime.trajectories.roster import Sampled
from multiradar.runtime.trajectories.waiting import NextPlots
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios import live_scene
from support.scenarios.flown import S_SHAPE, flight, plots_of

TABLE = live_scene.sensors()
NOTHING = Published(np.zeros((len(TABLE), 4)), np.zeros((len(TABLE), 4)))
SETTINGS = BundleSettings()
NOISE = 2500.0 * np.eye(2)


class Given(PlotLocator):
    """Lays plots where the test says: latitude and longitude are east and north, m."""

    def __init__(self) -> None:
        super().__init__(TABLE, TrackingSettings())

    def locate(self, plot: np.void, published: Published) -> LocatedPlot | NotLocated:
        if plot["range_m"] < 0.0:
            raise ZeroDivisionError
        covariance = NOISE.copy() if plot["azimuth_rad"] == 0.0 else -NOISE
        position = np.array([plot["latitude_rad"], plot["longitude_rad"]])
        return LocatedPlot(position, covariance, np.zeros((2, 2)))


def rows(seed: int, end_s: float = 60.0) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    flown = plots_of(flight(S_SHAPE), end_s, np.random.default_rng(seed))
    found = np.zeros(len(flown), PLOT_DTYPE)
    found["time_s"] = flown.time_s
    found["latitude_rad"], found["longitude_rad"] = flown.position_m.T
    found["track_height_m"] = 9000.0 + seed
    return found


def fed(*seeds: int) -> BundlePool:
    """Bundles by seed, with their plots interleaved."""
    pool = BundlePool(Given(), SETTINGS)
    for plots in zip(*(rows(seed) for seed in seeds), strict=True):
        for seed, plot in zip(seeds, plots, strict=True):
            pool.push(seed, plot, NOTHING)
    return pool


def batches_of(*seeds: int) -> Iterator[list[NextPlots]]:
    """Rounds of plots of all seeds; after 20 s those of the last one were lost."""
    plots = {seed: rows(seed) for seed in seeds}
    for first in range(0, len(plots[seeds[0]]), 3):
        part = {seed: one[first : first + 3].copy() for seed, one in plots.items()}
        yield [
            NextPlots(seed, first == 9 and seed == seeds[-1], one, NOTHING)
            for seed, one in part.items()
        ]


def alone(seed: int) -> Bundle:
    bundle = Bundle(SETTINGS)
    for plot in rows(seed):
        place = np.array([plot["latitude_rad"], plot["longitude_rad"]])
        bundle.push(float(plot["time_s"]), place, NOISE)
    return bundle


def said(bundle: Bundle) -> tuple[list[float], list[float]]:
    return bundle.weights().tolist(), bundle.estimate().state.tolist()


def test_bundles_with_shared_scratch_equal_separate_ones() -> None:
    pool = fed(1, 2, 3)
    for seed in (1, 2, 3):
        reading = pool.read(seed)
        assert reading is not None
        assert said(reading.bundle) == said(alone(seed))
        assert (reading.plots, reading.height_m) == (len(rows(seed)), 9000.0 + seed)
    assert pool.outcomes == {ACCEPTED: 3 * len(rows(1))}
    assert len(pool) == 3


def test_what_was_read_stays_as_it_was_and_may_go_on() -> None:
    pool = fed(1)
    reading = pool.read(1)
    assert reading is not None
    before = said(reading.bundle)
    time_s = float(rows(1)["time_s"][-1]) + 3.0
    later = rows(1)[-1].copy()
    later["time_s"] = time_s
    pool.push(1, later, NOTHING)
    assert said(reading.bundle) == before
    place = np.array([later["latitude_rad"], later["longitude_rad"]])
    reading.bundle.push(time_s, place, NOISE)
    now = pool.read(1)
    assert now is not None
    assert said(now.bundle) == said(reading.bundle) != before


def test_rejects_are_counted_and_change_nothing() -> None:
    pool, plots = fed(1), rows(1)
    reading = pool.read(1)
    assert reading is not None
    for name, value in (("time_s", 0.0), ("latitude_rad", np.nan), ("azimuth_rad", 1.0)):
        wrong = plots[-1].copy()
        wrong["time_s"] += 5.0
        wrong[name] = value
        pool.push(1, wrong, NOTHING)
    assert pool.outcomes == {
        ACCEPTED: len(plots), "TIME_NOT_ASCENDING": 1, "NOT_FINITE": 1, "NO_COVARIANCE": 1,
    }  # fmt: skip
    now = pool.read(1)
    assert now is not None
    assert said(now.bundle) == said(reading.bundle)
    with pytest.raises(CovarianceError):
        now.bundle.push(1e9, [0.0, 0.0], -NOISE)


def test_a_bug_affects_one_bundle_only(caplog: pytest.LogCaptureFixture) -> None:
    pool = fed(1, 2)
    wrong = rows(1)[-1].copy()
    wrong["range_m"] = -1.0
    pool.push(1, wrong, NOTHING)
    assert pool.outcomes["FAILED"] == 1
    assert pool.read(1) is None
    assert "track 1" in caplog.text
    reading = pool.read(2)
    assert reading is not None
    assert said(reading.bundle) == said(alone(2))
    pool.push(1, rows(1)[0], NOTHING)
    again = pool.read(1)
    assert again is not None
    assert again.plots == 1


def learnt(workers: int) -> tuple[object, ...]:
    """Bundles of five aircraft that were updated in rounds, with rejects, bugs and forecasts."""
    pool = BundlePool(Given(), SETTINGS, workers)
    for number, batches in enumerate(batches_of(1, 2, 3, 4, 5)):
        if number == 4:
            batches[1].plots["range_m"][1] = -1.0
            batches[2].plots["azimuth_rad"][0] = 1.0
        pool.push_all(batches)
        pool.sample(Sampled(number, float(batches[0].plots["time_s"][-1])))
    pool.close()
    readings = [pool.read(seed) for seed in (1, 2, 3, 4, 5)]
    states = [
        (said(one.bundle), one.plots, one.height_m, one.bundle.restarts)
        for one in readings
        if one is not None and len(one.bundle)
    ]
    calibration = pool._scores.heard.tolist(), pool._scores.waiting, pool._since
    return states, dict(pool.outcomes), pool.restarts, pool.tracks, calibration


@pytest.mark.slow
def test_the_number_of_threads_changes_nothing(caplog: pytest.LogCaptureFixture) -> None:
    one = learnt(1)
    states, outcomes, *_ = one
    assert isinstance(states, list)
    assert isinstance(outcomes, dict)
    assert len(states) == 5
    assert {"FAILED": 1, "NO_COVARIANCE": 1}.items() <= outcomes.items()
    assert [record.getMessage() for record in caplog.records] == [
        "reinitialising the bundle for track 2"
    ]
    for workers in (2, 3):
        assert learnt(workers) == one


def test_threads_share_the_bundles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of three threads holds one plot until all have one."""
    pool, together = BundlePool(Given(), SETTINGS, 3), threading.Barrier(3)
    push, memories = Bundle.push, []

    def watched(bundle: Bundle, *plot: Any) -> None:
        memories.append(id(bundle._memory))
        together.wait(WAIT_TIMEOUT_S)
        push(bundle, *plot)

    monkeypatch.setattr(Bundle, "push", watched)
    for first in range(2):
        pool.push_all(
            [NextPlots(seed, False, rows(seed)[first:][:1], NOTHING) for seed in (1, 2, 3)]
        )
    pool.close()
    assert pool.outcomes == {ACCEPTED: 6}
    # Scratch memory is never used by two of them.
    assert len(set(memories[:3])) == len(set(memories[3:])) == 3


def test_a_track_that_ends_lets_its_bundle_go() -> None:
    pool = fed(1, 2)
    pool.drop(1)
    pool.drop(7)
    assert pool.read(1) is None
    assert len(pool) == 1


class Laid(PlotLocator):
    """Keeps where plots were laid."""

    placed: list[LocatedPlot | NotLocated]

    def locate(self, plot: np.void, published: Published) -> LocatedPlot | NotLocated:
        self.placed.append(super().locate(plot, published))
        return self.placed[-1]


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("radar", LocatedPlot), ("mlat", LocatedPlot), ("direction-finder", None)],
)
def test_warming_up_locates_plots_of_any_sensor_with_positions(
    kind: str, expected: type[LocatedPlot] | None
) -> None:
    """Without a radar the first aircraft, and its readers, would wait for the kernels."""
    site = "latitude_deg = 50\nlongitude_deg = 15\nheight_m = 300"
    table = sensor_table(parse_sensors(f'[[sensor]]\nid = "one"\nkind = "{kind}"\n{site}'))
    places = Laid(table, TrackingSettings())
    places.placed = []
    warm_up(places, SETTINGS, table)
    assert {type(one) for one in places.placed} == ({expected} if expected else set())
    bundle = Bundle(SETTINGS)
    for number, one in enumerate(places.placed):
        assert isinstance(one, LocatedPlot)
        bundle.push(10.0 * number, one.position_m, one.covariance_m2)
    assert bool(len(bundle)) == bool(expected)
