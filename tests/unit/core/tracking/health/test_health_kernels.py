"""Sums over rows for sensor health."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Result, Rows, result_arrays
from multiradar.estimation.filters.bank import Outcome
from multiradar.tracking.health._health_kernels import gather
from multiradar.tracking.health.health_sums import LAST_UPDATE, VALUES_MAX, HealthSums
from multiradar.tracking.lifecycle.lifecycle import CONFIRMED, TENTATIVE, Lifecycle
from multiradar.tracking.roster import RowIdentities

SLOTS, SENSORS, CONFIRM = 40, 2, 2
NOISES = np.array([[2500.0, 1e-6], [2500.0, 1e-6]])
PERIODS = np.array([4.0, 10.0])


class Scenario(NamedTuple):
    rows: Rows
    result: Result
    identities: RowIdentities
    life: Lifecycle


def scenario(count: int, seed: int = 1) -> Scenario:
    """Rows of aircraft that two radars see, in order of time."""
    random = np.random.default_rng(seed)
    slots = random.integers(-1, SLOTS, count)
    rows = Rows(
        slot=slots,
        time=np.sort(random.uniform(0.0, 300.0, count)),
        kind=np.where(random.uniform(size=count) < 0.95, 0, 1),
        sensor=random.integers(0, SENSORS, count),
        z=np.column_stack([random.uniform(1e4, 2e5, count), random.uniform(0.0, 6.28, count)]),
        height=np.full(count, 9000.0),
        seen=np.empty(0, np.int64),
        ground=np.empty(0, np.int64),
    )
    result = result_arrays(count, 1, 0)
    result.outcome[:] = random.choice([0, 0, 0, 0, 1, 4, 3], count)
    result.innovation[:] = random.normal(size=(count, 8)) * [60, 1e-3, 0, 0, 0, 0, 0, 0]
    result.innovation[:, 2:] = [4000.0, 0.0, 2e-6, 30.0, 0.0, 1e-8]
    result.innovation[random.uniform(size=count) < 0.5, 5:] = np.nan
    result.innovation[result.outcome == Outcome.STARTED, 0] = np.nan
    # A plot that restarts its track has an innovation, and not every other one has.
    result.outcome[random.uniform(size=count) < 0.05] = Outcome.RESTARTED
    result.innovation[random.uniform(size=count) < 0.05, 0] = np.nan
    identities = RowIdentities.empty(count)
    identities.track_id[:] = slots + 1
    life = Lifecycle.empty(SLOTS, SENSORS)
    life.stage[:5] = TENTATIVE
    life.stage[5:10] = CONFIRMED
    return Scenario(rows, result, identities, life)


def gathered(one: Scenario, cuts: list[int]) -> HealthSums:
    sums = HealthSums.empty(SLOTS, SENSORS)
    sums.settled[:] = 1
    for first, last in itertools.pairwise(cuts):
        gather(
            first, last, one.rows, one.result, one.identities, one.life, NOISES, PERIODS, CONFIRM,
            sums,
        )  # fmt: skip
    return sums


def assert_same(found: HealthSums, expected: HealthSums) -> None:
    for name, one, other in zip(found._fields, found, expected, strict=True):
        np.testing.assert_array_equal(one, other, err_msg=name)


def test_sums_are_the_same_however_the_rows_are_cut() -> None:
    one = scenario(2000)
    whole = gathered(one, [0, 2000])
    assert whole.hits.min() > 50
    assert whole.noises.min() > 100
    assert_same(gathered(one, [0, *range(7, 2000, 7), 2000]), whole)


def test_the_compiled_sums_are_those_of_the_plain_form() -> None:
    one = scenario(500)
    compiled = gathered(one, [0, 500])
    expected = plain(one)
    for name in ("hits", "scans"):
        np.testing.assert_array_equal(getattr(compiled, name), expected[name], err_msg=name)
    for name in ("pattern", "pattern_vector", "clipped"):
        np.testing.assert_allclose(
            getattr(compiled, name), expected[name], rtol=1e-12, err_msg=name
        )


def plain(one: Scenario) -> dict[str, NDArray[np.float64]]:
    """Return scans, noise and pattern, in readable form."""
    heard: dict[tuple[int, int], float] = {}
    updates = dict.fromkeys(range(SLOTS), 0)
    found = {
        "hits": np.zeros(SENSORS), "scans": np.zeros(SENSORS), "clipped": np.zeros((SENSORS, 2)),
        "pattern": np.zeros((SENSORS, 15)), "pattern_vector": np.zeros((SENSORS, 5)),
    }  # fmt: skip
    for row, slot in enumerate(one.rows.slot.tolist()):
        outcome = one.result.outcome[row]
        if one.rows.kind[row] != 0 or slot < 0 or outcome not in (0, 1, 2, 4):
            continue
        stage, sensor = one.life.stage[slot], one.rows.sensor[row]
        known = stage == CONFIRMED or (stage != TENTATIVE and updates[slot] >= CONFIRM)
        accepted = outcome != Outcome.REFUSED
        updates[slot] += accepted
        error, spread = one.result.innovation[row, :2], one.result.innovation[row, [2, 4]]
        compared = known and not np.isnan(error[0])
        if compared and outcome == Outcome.UPDATED:
            found["clipped"][sensor] += np.minimum(error**2 / spread, 1.0)
        if compared and outcome in (Outcome.UPDATED, Outcome.REFUSED):
            # Outliers are down-weighted, but not excluded.
            spread = spread * max(np.sqrt(np.max(error**2 / spread)) / 3.0, 1.0)
            range_m, azimuth = one.rows.z[row]
            away = np.array([np.sin(azimuth), np.cos(azimuth)])
            right = np.array([np.cos(azimuth), -np.sin(azimuth)])
            design = np.array(
                [[1.0, 0.0, range_m / 1e5, *-away], [0.0, 1.0, 0.0, *(-right / range_m)]]
            )
            weighted = design.T / spread
            found["pattern"][sensor] += (weighted @ design)[np.triu_indices(5)]
            found["pattern_vector"][sensor] += weighted @ error
        if accepted:
            scans = (one.rows.time[row] - heard.get((slot, sensor), -np.inf)) / PERIODS[sensor]
            if known and 0.5 < scans < 8.5:
                found["hits"][sensor] += 1
                found["scans"][sensor] += np.floor(scans + 0.5)
            heard[slot, sensor] = one.rows.time[row]
    return found


def test_scans_are_counted_between_two_updates_alone() -> None:
    one = scenario(4)
    one.rows.slot[:] = 7
    one.rows.kind[:] = one.rows.sensor[:] = 0
    one.rows.time[:] = [0.0, 4.1, 16.0, 300.0]
    one.result.outcome[:] = Outcome.UPDATED
    one.identities.track_id[:] = 1
    sums = gathered(one, [0, 4])
    # One scan, then three of which two were missed; then absence.
    assert (sums.hits[0], sums.scans[0]) == (2.0, 4.0)


def test_another_track_in_a_slot_inherits_nothing() -> None:
    one = scenario(4)
    one.rows.slot[:] = 7
    one.rows.kind[:] = one.rows.sensor[:] = 0
    one.rows.time[:] = [0.0, 4.0, 8.0, 12.0]
    one.result.outcome[:] = Outcome.UPDATED
    one.identities.track_id[:] = [1, 1, 2, 2]
    sums = gathered(one, [0, 4])
    assert (sums.hits[0], sums.scans[0]) == (2.0, 2.0)
    assert sums.seen[7, 0, LAST_UPDATE] == 12.0
    assert sums.owner[7] == 2


def test_each_aircraft_is_tested_once_per_window_up_to_the_capacity() -> None:
    one = scenario(3000)
    sums = gathered(one, [0, 3000])
    assert sums.tested.max() <= SLOTS
    crowd = scenario(3000)
    crowd.rows.slot[:] = np.arange(3000) % SLOTS
    # Every row is of a new track, so that every row counts.
    sums = HealthSums.empty(SLOTS, SENSORS)
    crowd.life.stage[:] = CONFIRMED
    crowd.identities.track_id[:] = np.arange(3000)
    crowd.rows.kind[:] = crowd.rows.sensor[:] = 0
    crowd.result.outcome[:] = Outcome.UPDATED
    crowd.result.innovation[:, 0] = 1.0
    gather(
        0, 3000, crowd.rows, crowd.result, crowd.identities, crowd.life, NOISES, PERIODS, CONFIRM,
        sums,
    )  # fmt: skip
    assert sums.tested.tolist() == [VALUES_MAX, 0]
