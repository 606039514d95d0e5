"""Rows are released by the reorder buffer in an order that depends on the rows alone."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.estimation.measurement.aircraft_data import AircraftData
from multiradar.tracking.input._order_kernels import TIED_MAX
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.input.order import PIECE_ROWS, ReorderBuffer, canonical_order
from support.inputs.batches import batch_of, rows_of

HORIZON_S = 5.0


def released(buffer: ReorderBuffer, batches: list[MeasurementBatch]) -> list[tuple[object, ...]]:
    parts = [buffer.push(batch) for batch in batches] + [buffer.flush()]
    return [row for part in parts if part is not None for row in rows_of(part)]


# Times on a coarse grid, so that ties and duplicates are common.
times = st.lists(st.integers(0, 400).map(lambda step: step / 4.0), min_size=1, max_size=60)


@given(times, st.randoms(use_true_random=False), st.integers(1, 20))
@settings(max_examples=60)
@pytest.mark.fault(6)
def test_order_is_independent_of_batches_and_of_disorder_within_the_horizon(
    at: list[float], random: object, size: int
) -> None:
    ordered = batch_of(sorted(at), track_number=[int(4 * t) % 3 for t in sorted(at)])
    shuffled_keys = [t + random.uniform(0.0, HORIZON_S * 0.99) for t in sorted(at)]  # type: ignore[attr-defined]
    disordered = ordered.select(np.argsort(np.array(shuffled_keys), kind="stable"))
    batches = [disordered.select(slice(i, i + size)) for i in range(0, len(at), size)]
    assert released(ReorderBuffer(HORIZON_S), batches) == released(
        ReorderBuffer(HORIZON_S), [ordered]
    )


@pytest.mark.fault(5)
def test_duplicates_within_the_horizon_are_released_once_and_counted() -> None:
    once = batch_of([1.0, 2.0, 3.0])
    buffer = ReorderBuffer(HORIZON_S)
    assert released(buffer, [once, once.select(np.array([1]))]) == released(
        ReorderBuffer(HORIZON_S), [once]
    )
    assert buffer.duplicates == 1


def test_rows_that_differ_in_one_column_are_no_duplicates() -> None:
    buffer = ReorderBuffer(HORIZON_S)
    rows = batch_of([1.0, 1.0], height_m=[100.0, np.nan])
    assert len(released(buffer, [rows])) == 2
    assert buffer.duplicates == 0


def test_rows_that_differ_in_the_ground_status_are_no_duplicates() -> None:
    rows = replace(batch_of([1.0, 1.0, 1.0]), on_ground=np.array([1, 0, 1], np.int8))
    buffer = ReorderBuffer(HORIZON_S)
    buffer.push(rows)
    ordered = buffer.flush()
    assert ordered is not None
    assert ordered.on_ground is not None
    assert ordered.on_ground.tolist() == [0, 1]
    assert buffer.duplicates == 1


def test_rows_that_differ_in_aircraft_derived_data_are_no_duplicates() -> None:
    data = AircraftData(*np.full((len(AircraftData._fields), 3), np.nan))
    data = data._replace(mach=np.array([0.8, 0.7, 0.8]))
    buffer = ReorderBuffer(HORIZON_S)
    buffer.push(replace(batch_of([1.0, 1.0, 1.0]), aircraft_data=data))
    ordered = buffer.flush()
    assert ordered is not None
    assert ordered.aircraft_data is not None
    assert ordered.aircraft_data.mach.tolist() == [0.7, 0.8]
    assert buffer.duplicates == 1


def test_rows_wait_until_the_horizon_has_passed() -> None:
    buffer = ReorderBuffer(HORIZON_S)
    assert buffer.push(batch_of([10.0])) is None
    assert buffer.push(batch_of([14.0])) is None
    ready = buffer.push(batch_of([15.5]))
    assert ready is not None
    assert ready.time_s.tolist() == [10.0]


def test_a_row_before_what_was_flushed_is_counted_as_late_and_not_released() -> None:
    buffer = ReorderBuffer(HORIZON_S)
    buffer.push(batch_of([10.0]))
    buffer.flush()
    buffer.push(batch_of([9.0, 10.0, 11.0]))
    rest = buffer.flush()
    assert rest is not None
    assert rest.time_s.tolist() == [11.0]
    assert buffer.late == 2


def test_canonical_order_is_total() -> None:
    rng = np.random.default_rng(1)
    rows = batch_of(
        rng.integers(0, 3, 40).astype(float).tolist(), track_number=rng.integers(0, 9, 40).tolist()
    )
    shuffled = rows.select(rng.permutation(40))
    expected = rows_of(rows.select(canonical_order(rows)))
    assert rows_of(shuffled.select(canonical_order(shuffled))) == expected


@pytest.mark.parametrize("rows_of_one_time", [TIED_MAX // 2, 3 * TIED_MAX])
def test_rows_of_one_time_are_ordered_by_every_column_few_or_many(rows_of_one_time: int) -> None:
    rng = np.random.default_rng(2)
    n = rows_of_one_time

    rows = replace(
        batch_of([7.0] * n),
        sensor=rng.integers(0, 2, n, np.int32),
        track_number=rng.integers(-1, 2, n),
        range_m=rng.choice([1e3, 2e3, np.nan], n),
        azimuth_rad=rng.choice([-0.0, 0.0, 1.0], n),
        height_m=rng.choice([100.0, np.nan], n),
        mode_3a=rng.integers(-1, 1, n, np.int32),
        kind=rng.integers(0, 2, n, np.int8),
    )
    # Most significant last, as `lexsort` has it; it puts NaN last too.
    keys = ("kind", "mode_3a", "height_m", "azimuth_rad", "range_m", "track_number")
    expected = np.lexsort([*(getattr(rows, name) for name in keys), rows.sensor])
    assert canonical_order(rows).tolist() == expected.tolist()
    buffer = ReorderBuffer(HORIZON_S)
    alike = set(rows_of(rows))
    assert len(released(buffer, [rows])) == len(alike)
    assert buffer.duplicates == n - len(alike)
    assert buffer.duplicates > 0


def test_buffered_pieces_of_any_size_are_released_whole() -> None:
    rng = np.random.default_rng(3)
    times = np.sort(rng.uniform(0.0, 60.0, 3 * PIECE_ROWS))
    rows = batch_of(times.tolist())
    sizes = [1, 2, PIECE_ROWS - 1, 5, PIECE_ROWS + 1, 1]
    cuts = np.cumsum([0, *sizes, len(times) - sum(sizes)]).tolist()
    pieces = [rows.select(slice(*cut)) for cut in itertools.pairwise(cuts)]
    assert released(ReorderBuffer(HORIZON_S), pieces) == rows_of(rows)
