"""Aircraft are found by identity, keep their slots, and are dropped when old."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.filters._kernels import NO_ROOM_SLOT
from multiradar.estimation.filters.arrays import LINES_BYTES, partition_of
from multiradar.estimation.filters.bank import FILTERS, JOINT_AIRCRAFT_MAX
from multiradar.tracking import pool as pool_module
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.lifecycle.transitions import SILENT
from multiradar.tracking.pool import CAPACITY_FIRST, PARTITIONS, AircraftPool
from multiradar.tracking.roster import RowIdentities
from support.inputs.batches import batch_of


def assigned(pool: AircraftPool, batch: MeasurementBatch) -> RowIdentities:
    identities = RowIdentities.empty(len(batch))
    pool.assign(batch, batch.mode_3a.astype(np.int64), 0, len(batch), identities)
    return identities


def test_rows_of_one_track_number_are_one_track() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    rows = assigned(pool, batch_of([0.0] * 5, track_number=[7, 9, 7, 9, 7]))
    assert rows.track_id.tolist() == [1, 2, 1, 2, 1]


def test_an_address_and_a_number_received_together_are_one_track() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    rows = assigned(
        pool,
        batch_of([0.0] * 4, track_number=[5, -1, 5, -1], mode_s_address=[0xABC, 0xABC, -1, 0xDEF]),
    )
    assert rows.track_id.tolist() == [1, 1, 1, 2]
    assert rows.mode_s_address.tolist() == [0xABC, 0xABC, 0xABC, 0xDEF]


def test_one_address_under_two_numbers_is_two_tracks() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    rows = assigned(pool, batch_of([0.0] * 3, track_number=[1, 2, 1], mode_s_address=[9, 9, 9]))
    assert rows.track_id.tolist() == [1, 2, 1]


def test_a_row_without_identity_has_no_track() -> None:
    rows = assigned(AircraftPool(FILTERS["blom"], 0, 1), batch_of([0.0, 0.0], track_number=[-1, 3]))
    assert rows.slot.tolist()[0] == -1
    assert rows.track_id.tolist() == [-1, 1]


def test_a_track_keeps_its_last_callsign() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    rows = batch_of([0.0] * 6, track_number=[1, 1, 2, 1, 1, 2])
    callsigns = np.array([-1, 11, -1, 12, -1, -1])
    known = assigned(pool, replace(rows, callsign=callsigns)).callsign
    assert known.tolist() == [-1, 11, -1, 12, 12, -1]
    pool.grow()
    later = assigned(pool, batch_of([1.0, 1.0], track_number=[1, 2])).callsign
    assert later.tolist() == [12, -1]


def test_a_new_track_has_no_callsign_of_the_previous_one_in_its_slot() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    slot = assigned(pool, replace(batch_of([0.0], track_number=[1]), callsign=np.array([7]))).slot
    pool.terminate(slot, np.array([SILENT]))
    after = assigned(pool, batch_of([1.0], track_number=[2]))
    assert after.slot.tolist() == slot.tolist()
    assert after.callsign.tolist() == [-1]


def test_the_pool_grows_when_slots_are_used_up_without_losing_aircraft() -> None:
    pool = AircraftPool(FILTERS["two-stage"], 3, 1)
    numbers = np.arange(5 * CAPACITY_FIRST)
    first = assigned(pool, batch_of([0.0] * len(numbers), track_number=numbers.tolist()))
    again = assigned(pool, batch_of([1.0] * len(numbers), track_number=numbers.tolist()))
    assert first.track_id.tolist() == (numbers + 1).tolist()
    assert again.track_id.tolist() == first.track_id.tolist()
    assert pool.aircraft.sensitivity.shape[1:] == (4, 3)


def test_a_full_pool_marks_rows_and_keeps_its_aircraft(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pool_module, "CAPACITY_MAX", CAPACITY_FIRST)
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    numbers = list(range(CAPACITY_FIRST + 2))
    rows = assigned(pool, batch_of([0.0] * len(numbers), track_number=numbers))
    assert rows.slot[-2:].tolist() == [NO_ROOM_SLOT, NO_ROOM_SLOT]
    again = assigned(pool, batch_of([1.0], track_number=[0]))
    assert again.track_id.tolist() == [1]


def test_the_joint_filter_has_a_capacity_and_keeps_the_joint_covariance() -> None:
    pool = AircraftPool(FILTERS["joint"], 2, 1)
    before = pool.aircraft.joint
    before[:] = np.random.default_rng(1).normal(size=before.shape)
    numbers = list(range(JOINT_AIRCRAFT_MAX + 1))
    rows = assigned(pool, batch_of([0.0] * len(numbers), track_number=numbers))
    assert rows.slot[-1] == NO_ROOM_SLOT
    assert (rows.slot[:-1] >= 0).all()
    # Biases first, then aircraft by slot: existing ones keep their position.
    np.testing.assert_array_equal(pool.aircraft.joint[: len(before), : len(before)], before)
    assert len(pool.aircraft.joint) == 2 + 4 * JOINT_AIRCRAFT_MAX


def test_rows_for_a_filter_that_corrects_the_biases_stay_in_order() -> None:
    pool = AircraftPool(FILTERS["joint"], 2, 1)
    used, work = pool.work(np.array([5, 21, 3, 5, -1], np.int64), np.arange(10, 15))
    assert used.tolist() == [0]
    assert work.order[work.bounds[0] : work.bounds[1]].tolist() == [10, 11, 12, 13, 14]


def test_an_old_track_is_dropped_and_its_number_initiates_another() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    rows = assigned(pool, batch_of([0.0, 0.0, 0.0], track_number=[1, 2, 3]))
    pool.aircraft.time[rows.slot] = 50.0
    # State time changed by rejected measurements, but updated long ago.
    pool.aircraft.updated[rows.slot] = [10.0, 50.0, 10.0]
    old = pool.silent(40.0)
    ends = pool.terminate(old, np.full(len(old), SILENT))
    assert ends.track_id.tolist() == [1, 3]
    assert ends.updated_s.tolist() == [10.0, 10.0]
    assert ends.slot.tolist() == rows.slot[[0, 2]].tolist()
    assert np.isnan(pool.aircraft.time[rows.slot[[0, 2]]]).all()
    later = assigned(pool, batch_of([60.0, 60.0], track_number=[3, 2]))
    assert later.track_id.tolist() == [4, 2]
    assert np.isnan(pool.aircraft.time[later.slot[0]])


def test_an_aircraft_without_a_position_is_freed_without_a_terminated_track() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    assigned(pool, batch_of([0.0], track_number=[1]))
    old = pool.silent(1e9)
    assert len(pool.terminate(old, np.full(len(old), SILENT)).track_id) == 0
    assert len(pool.used()) == 0


def test_work_keeps_the_order_within_a_partition_and_contains_every_row_once() -> None:
    pool = AircraftPool(FILTERS["blom"], 0, 1)
    slots = np.array([80, 336, 3, 90, -1, 592, 7], np.int64)
    used, work = pool.work(slots, 100 + np.arange(len(slots)))
    assert sorted(work.order.tolist()) == list(range(100, 107))
    shares = [work.order[work.bounds[p] : work.bounds[p + 1]].tolist() for p in range(PARTITIONS)]
    # Sixteen consecutive slots share a partition, and those at a distance of 256.
    assert shares[5] == [100, 101, 103, 105]
    assert shares[0] == [102, 106]
    assert used.tolist() == [0, 5, 15]


def test_states_begin_on_a_pair_of_cache_lines_also_after_growing() -> None:
    pool = AircraftPool(FILTERS["two-stage"], 6, 3)
    pool.grow()
    assert {array.ctypes.data % LINES_BYTES for array in pool.aircraft if array.size} == {0}


def test_the_sums_of_an_aircraft_are_those_of_the_partition_that_takes_its_rows() -> None:
    pool = AircraftPool(FILTERS["blom-macro"], 0, 1)
    slots = np.array([5, 16, 31, 250], np.int64)
    _, work = pool.work(slots, np.arange(len(slots)))
    taken = {
        int(slots[row]): p
        for p in range(PARTITIONS)
        for row in work.order[work.bounds[p] : work.bounds[p + 1]]
    }
    assert taken == {slot: partition_of(slot, PARTITIONS) for slot in slots.tolist()}
