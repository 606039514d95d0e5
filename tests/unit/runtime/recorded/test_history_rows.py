"""Rows of a history that are new, also while the engine processes the journal again."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from multiradar.runtime.memory.health_board import HealthBoard
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.offline.offline_job import BIASES_FILE, HEALTH_FILE, TRACKS_FILE
from multiradar.runtime.recorded.history_rows import new_rows, present_positions
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.fakes.fake_engine import FakeEngine
from support.fakes.health import health_records
from support.scenarios.live_scene import recording, sensors

TABLE = sensors()
#: The data time is set back in the second and third one, a flush closes an epoch in the fourth.
EPOCHS = (
    [*range(2, 12)], [*range(9000, 9006), *range(8100, 8104)], [*range(100, 105), *range(101, 106)],
    [100, 101, 102, 103, 103, 104, 104, 104, 105, 106],
)  # fmt: skip


def outputs(epochs: Sequence[int]) -> list[EngineOutput]:
    engine, frame = FakeEngine(), recording(10 * len(epochs))
    return [
        replace(
            engine.push(measurement_batch(frame[10 * k : 10 * (k + 1)], TABLE)[0]),
            health=health_records(epoch=[epoch], time_s=[4.0 * epoch], sensor=[0]),
        )
        for k, epoch in enumerate(epochs)
    ]


@pytest.mark.parametrize("epochs", EPOCHS)
@pytest.mark.parametrize("repeated", [1, 3, 6, 7])
def test_no_row_is_written_twice_when_the_journal_is_processed_again(
    epochs: list[int], repeated: int
) -> None:
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    journal, made = MemoryJournal(), outputs(epochs)
    positions: dict[str, Any] = present_positions(known, journal)
    written: dict[str, int] = dict.fromkeys((TRACKS_FILE, BIASES_FILE, HEALTH_FILE), 0)

    def write() -> None:
        for table, one in new_rows(known, journal, 0, positions).items():
            positions[table] = one.position
            if table in written:
                written[table] += len(one.rows)

    for output in made[:8]:
        known.absorb(output, None)
    write()
    known.clear()
    write()
    for number, output in enumerate(made):
        known.absorb(output, None)
        if number in (repeated, 9):
            write()
    assert written[HEALTH_FILE] == 10
    assert written[TRACKS_FILE] == 100
    assert written[BIASES_FILE] == known.logs["biases"].appended


def test_health_that_is_no_longer_retained_is_no_reason_to_wait() -> None:
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    journal = MemoryJournal()
    known._healths = HealthBoard(3)
    positions = present_positions(known, journal)
    for output in outputs([3, 4, 5, 6, 7]):
        known.absorb(output, None)
    found = new_rows(known, journal, 0, positions)[HEALTH_FILE]
    assert found.rows["time_s"].to_list() == [20.0, 24.0, 28.0]
    assert (found.position, found.lost) == (5, 2)


def test_health_after_a_step_back_is_written_as_often_as_it_was_published() -> None:
    """Only the rows after the second passage of the last written epoch were written."""
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    journal = MemoryJournal()
    made = outputs([*range(90, 101), *range(101, 151), *range(50, 121)])
    for output in made[:11]:
        known.absorb(output, None)
    positions = present_positions(known, journal)
    for output in made[11:]:
        known.absorb(output, None)
    assert len(new_rows(known, journal, 0, positions)[HEALTH_FILE].rows) == 121
