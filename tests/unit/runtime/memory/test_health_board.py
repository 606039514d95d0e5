"""The health of radars at a past time."""

from multiradar.runtime.memory.health_board import HealthBoard
from multiradar.state import copied_state, encoded_state, restore_state
from support.fakes.health import health_records


def test_the_last_epoch_that_had_ended_applies() -> None:
    board = HealthBoard(2)
    board.append(health_records(epoch=[1, 1, 2], time_s=[4.0, 4.0, 8.0], sensor=[0, 1, 0]))
    assert len(board.at(3.999)) == 0
    assert board.at(4.0).epoch.tolist() == [1, 1]
    assert board.at(7.999).epoch.tolist() == [1, 1]
    assert board.at(8.0).epoch.tolist() == [2]
    # The oldest is discarded.
    board.append(health_records(epoch=[3], time_s=[12.0], sensor=[0]))
    assert len(board.at(7.999)) == 0
    assert board.at(100.0).epoch.tolist() == [3]


def test_a_restored_state_replaces_what_was_known() -> None:
    one, other = HealthBoard(5), HealthBoard(5)
    one.append(health_records(epoch=[1, 1, 2], time_s=[4.0, 4.0, 8.0], sensor=[0, 1, 0]))
    other.append(health_records(epoch=[7], time_s=[1.0], sensor=[0]))
    other._joined = one._joined
    assert len(other.at(3.999)) == 0
    assert other.at(4.0).sensor.tolist() == [0, 1]
    assert other.at(8.0).epoch.tolist() == [2]


def test_after_a_step_back_the_newest_epochs_are_complete() -> None:
    board = HealthBoard(3)
    for epoch in (80, 90, 100):
        board.append(health_records(epoch=[epoch], time_s=[4.0 * epoch], sensor=[0]))
    assert board.complete_from_s == -float("inf")
    board.set_back(200.0)
    board.append(health_records(epoch=[50], time_s=[204.0], sensor=[0]))
    assert board.complete_from_s == 200.0
    assert board.at(210.0).epoch.tolist() == [50]
    other = HealthBoard(3)
    restore_state(other, encoded_state(copied_state(board)))
    for one in (board, other):
        one.append(health_records(epoch=[60], time_s=[244.0], sensor=[0]))
        assert one.complete_from_s == 200.0
        one.append(health_records(epoch=[70], time_s=[284.0], sensor=[0]))
        # No record before the step is retained any more.
        assert one.complete_from_s == 204.0
    assert HealthBoard(3).complete_from_s == -float("inf")


def test_records_are_numbered_as_they_are_added() -> None:
    """An epoch that a flush closed, or that came again after a step back, was lost or repeated."""
    board = HealthBoard(4)
    for epoch, sensors in ((100, [0, 1]), (100, [0]), (50, [0, 1]), (100, [0])):
        board.append(
            health_records(
                epoch=[epoch for _ in sensors], time_s=[4.0] * len(sensors), sensor=sensors
            )
        )
    assert board.appended == 6
    restored = HealthBoard(4)
    restore_state(restored, encoded_state(copied_state(board)))
    for one in (board, restored):
        for number, expected in ((0, [100, 100, 100, 50, 50, 100]), (3, [50, 50, 100]), (6, [])):
            records, lost = one.after(number)
            assert (records.epoch.tolist(), lost) == (expected, 0)
        # As while the engine processes the journal again.
        assert len(one.after(9)[0]) == 0
        one.append(health_records(epoch=[101], time_s=[4.0], sensor=[0]))
        records, lost = one.after(1)
        assert (records.epoch.tolist(), lost) == ([100, 50, 50, 100, 101], 1)
