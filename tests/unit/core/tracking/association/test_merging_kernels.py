"""Merging of duplicate tracks: never into one that may be based on a false plot."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from multiradar.estimation.filters.bank import FILTERS
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.shared_biases import SharedBiases
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.association._grid_kernels import fill_grid
from multiradar.tracking.association._merging_kernels import (
    MEETINGS_NEEDED,
    find_merges,
    seen_by_one,
)
from multiradar.tracking.association.track_grid import RULE_COUNT, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import CONFIRMED, TENTATIVE
from multiradar.tracking.pool import AircraftPool
from multiradar.tracking.settings import TrackingSettings
from support.kernels import plain

OLDER, YOUNGER = 0, 1


@pytest.mark.parametrize(
    ("stage", "hits", "merges"),
    [(TENTATIVE, 1, False), (TENTATIVE, 3, False), (CONFIRMED, 3, True)],
)
def test_a_confirmed_track_is_merged_into_confirmed_ones_alone(
    tmp_path: Path, stage: int, hits: int, merges: bool
) -> None:
    scene = builtin_scenario("newcomers")
    path = tmp_path / "sensors.toml"
    path.write_text(sensors_text(scene), encoding="utf-8")
    table, settings = load_sensor_table(path), TrackingSettings()
    definition = FILTERS["two-stage"]
    plane = SystemPlane(*scene.centre_rad)
    biases = SharedBiases(table, settings, definition, plane)
    columns = len(table.parameter_kind)
    pool = AircraftPool(definition, columns, len(table))
    pool.roster.track_id[[OLDER, YOUNGER]] = [1, 2]
    # The older one may be anywhere: its velocity is unknown.
    pool.aircraft.mean[[OLDER, YOUNGER]] = [[0.0, 0.0, 0.0, 0.0], [200.0, 0.0, 200.0, 0.0]]
    pool.aircraft.covariance[OLDER] = np.array([1e4, 0, 0, 0, 1e4, 0, 0, 9e4, 0, 9e4])
    pool.aircraft.covariance[YOUNGER] = np.array([1e4, 0, 0, 0, 1e4, 0, 0, 400, 0, 400])
    pool.aircraft.sensitivity[[OLDER, YOUNGER]] = 0.0
    pool.aircraft.time[[OLDER, YOUNGER]] = pool.aircraft.updated[[OLDER, YOUNGER]] = 100.0
    pool.aircraft.updates[[OLDER, YOUNGER]] = hits, 5
    pool.life.stage[[OLDER, YOUNGER]] = stage, CONFIRMED
    pool.life.hits[[OLDER, YOUNGER]] = hits, 5
    grid, room = TrackGrid.empty(len(pool.roster.track_id)), np.empty((2, 256), np.int64)
    rules = np.full(RULE_COUNT, 700.0)
    counts = []
    for step in range(MEETINGS_NEEDED + 2):
        time_s = 102.0 + 2.0 * step
        longest = fill_grid(
            time_s, biases.model, pool.aircraft, pool.roster, pool.life, rules, grid
        )
        counts.append(
            find_merges(
                time_s, longest, biases.model, pool.aircraft, pool.roster, pool.life,
                table.rotation_period_s, grid, 0, *room,
            )
        )  # fmt: skip
    assert max(counts) == int(merges)


@pytest.mark.parametrize(
    ("first", "second", "seen"),
    [
        # Within half of a scan of 4 s, the older one less than one and a half scans ago.
        ([99.0, -np.inf], [97.1, -np.inf], True),
        ([97.1, -np.inf], [99.0, -np.inf], True),
        ([99.0, -np.inf], [97.0, -np.inf], False),
        ([95.0, -np.inf], [94.1, -np.inf], True),
        ([95.0, -np.inf], [94.0, -np.inf], False),
        # By the other sensor, of 10 s.
        ([99.0, 90.0], [90.0, 86.0], True),
        ([-np.inf, -np.inf], [-np.inf, -np.inf], False),
    ],
)
def test_two_tracks_in_one_scan_of_a_sensor_are_two_aircraft(
    first: list[float], second: list[float], *, seen: bool
) -> None:
    life = SimpleNamespace(last_seen=np.array([first, second]))
    with np.errstate(invalid="ignore"):
        assert plain(seen_by_one)(100.0, OLDER, YOUNGER, np.array([4.0, 10.0]), life) == seen
