"""Rows leave the reorder buffer in an order that depends on the rows alone."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from multiradar.tracking.measurements import MeasurementBatch
from multiradar.tracking.order import ReorderBuffer, canonical_order
from support.batches import batch_of, rows_of

HORIZON_S = 5.0


def released(buffer: ReorderBuffer, batches: list[MeasurementBatch]) -> list[tuple[object, ...]]:
    parts = [buffer.push(batch) for batch in batches] + [buffer.flush()]
    return [row for part in parts if part is not None for row in rows_of(part)]


# Times on a coarse grid, so that ties and duplicates are common.
times = st.lists(st.integers(0, 400).map(lambda step: step / 4.0), min_size=1, max_size=60)


@given(times, st.randoms(use_true_random=False), st.integers(1, 20))
@settings(max_examples=60, deadline=None)
def test_order_depends_neither_on_batches_nor_on_disorder_within_the_horizon(
    at: list[float], random: object, size: int
) -> None:
    ordered = batch_of(sorted(at), track_number=[int(4 * t) % 3 for t in sorted(at)])
    shuffled_keys = [t + random.uniform(0.0, HORIZON_S * 0.99) for t in sorted(at)]  # type: ignore[attr-defined]
    disordered = ordered.take(np.argsort(np.array(shuffled_keys), kind="stable"))
    batches = [disordered.take(slice(i, i + size)) for i in range(0, len(at), size)]
    assert released(ReorderBuffer(HORIZON_S), batches) == released(
        ReorderBuffer(HORIZON_S), [ordered]
    )


def test_duplicates_within_the_horizon_leave_once_and_are_counted() -> None:
    once = batch_of([1.0, 2.0, 3.0])
    buffer = ReorderBuffer(HORIZON_S)
    assert released(buffer, [once, once.take(np.array([1]))]) == released(
        ReorderBuffer(HORIZON_S), [once]
    )
    assert buffer.duplicates == 1


def test_rows_that_differ_in_one_column_are_no_duplicates() -> None:
    buffer = ReorderBuffer(HORIZON_S)
    rows = batch_of([1.0, 1.0], height_m=[100.0, np.nan])
    assert len(released(buffer, [rows])) == 2
    assert buffer.duplicates == 0


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
    shuffled = rows.take(rng.permutation(40))
    expected = rows_of(rows.take(canonical_order(rows)))
    assert rows_of(shuffled.take(canonical_order(shuffled))) == expected
