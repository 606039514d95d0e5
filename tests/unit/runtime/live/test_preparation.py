"""Messages that are translated together are decided as if each had come alone."""

import json
import time

import polars as pl
import pytest

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.live.intake import Submission
from multiradar.runtime.live.preparation import Prepared, prepare
from multiradar.storage.entries import EntryKind
from multiradar.tracking.input.measurements import MeasurementBatch
from support.scenarios.live_scene import cut, recording, sensors

TABLE = sensors()
#: A row of the message whose translation raises an unexpected error.
POISON_M = 123_456.0


def message(frame: pl.DataFrame) -> Submission:
    return Submission(EntryKind.BATCH, frame, "test", None, ())


@pytest.mark.parametrize("poisoned", [0, 1, 2])
def test_a_message_that_cannot_be_translated_fails_alone(
    monkeypatch: pytest.MonkeyPatch, poisoned: int
) -> None:
    translate = wire.measurement_batch

    def failing(frame: pl.DataFrame, table: SensorTable) -> tuple[MeasurementBatch, wire.Rejected]:
        if (frame["range_m"] == POISON_M).any():
            raise ZeroDivisionError
        return translate(frame, table)

    monkeypatch.setattr(wire, "measurement_batch", failing)
    pieces = cut(recording(60).filter(pl.col("kind") == "radar")[:30], [10, 10])
    pieces[poisoned] = pieces[poisoned].with_columns(range_m=pl.lit(POISON_M))
    found = prepare([message(piece) for piece in pieces], TABLE, Admission(10.0, len(TABLE)))
    assert isinstance(found[poisoned], ZeroDivisionError)
    others = [one for place, one in enumerate(found) if place != poisoned]
    assert [len(one.batch) for one in others if isinstance(one, Prepared)] == [10, 10]


def test_a_rejected_row_takes_about_as_long_as_its_text() -> None:
    """One source of rows out of range made all other sources wait for seconds."""
    frame = pl.concat([recording(500).filter(pl.col("kind") == "radar")] * 20)
    far = frame.with_columns(range_m=pl.lit(-1.0))
    rows = list(far.iter_rows(named=True))
    ratios = []
    for _ in range(5):
        begin = time.process_time()
        (one,) = prepare([message(far)], TABLE, Admission(10.0, len(TABLE)))
        middle = time.process_time()
        texts = [json.dumps(row) for row in rows]
        ratios.append((middle - begin) / (time.process_time() - middle))
        assert isinstance(one, Prepared)
        assert len(one.entry.rejects) == len(texts) == len(far)
    # It was 3.4.
    assert min(ratios) < 2.6
