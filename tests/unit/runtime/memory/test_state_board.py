"""States of past times remain when a sensor is added, which widens them."""

from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import SnapshotError
from multiradar.runtime.memory.state_board import StateBoard
from multiradar.storage.snapshots import SnapshotFolder, joined_rows
from multiradar.tracking.outputs import StateSample, TrackStates

TRACKS = 3


def _sample(number: int, columns: int) -> StateSample:
    random = np.random.default_rng(number)
    states = TrackStates(
        np.arange(TRACKS) + TRACKS * number, np.full(TRACKS, 10.0 * number),
        random.normal(size=(TRACKS, 4)), random.normal(size=(TRACKS, 4, 4)),
        random.normal(size=TRACKS), None, random.normal(size=(TRACKS, 4, columns)), None,
    )  # fmt: skip
    return StateSample(number, 10.0 * number, states)


def _board() -> StateBoard:
    board = StateBoard(1 << 20)
    board.append([_sample(1, 4), _sample(2, 4), _sample(3, 6)])
    return board


def test_states_before_and_after_a_sensor_was_added_are_rows_of_one_table() -> None:
    board, other = _board(), StateBoard(1 << 20)
    rows = board.rows(0, 3 * TRACKS)
    assert rows["shared"].shape == (3 * TRACKS, 4, 6)
    assert not rows["shared"][: 2 * TRACKS, :, 4:].any()
    other.refill(0, rows)
    found, expected = other.at(0.0, 40.0), board.at(0.0, 40.0)
    assert found is not None
    assert expected is not None
    assert found.shared is not None
    np.testing.assert_array_equal(found.shared, expected.shared)
    np.testing.assert_array_equal(found.mean, expected.mean)


def test_files_of_rows_before_and_after_it_are_read_as_one_table(tmp_path: Path) -> None:
    board, folder = _board(), SnapshotFolder(tmp_path / "journal.sqlite")
    cuts = ((0, TRACKS), (TRACKS, 3 * TRACKS))
    files = [folder.write_rows("states", first, board.rows(first, end)) for first, end in cuts]
    rows = folder.read_rows(files)
    np.testing.assert_array_equal(rows, board.rows(0, 3 * TRACKS))
    other = folder.write_rows("states", 3 * TRACKS, np.zeros(1, [("another", "f8")]))
    with pytest.raises(SnapshotError, match="the rows are of different types"):
        folder.read_rows([*files, other])


def test_rows_of_other_fields_are_not_joined() -> None:
    parts = [np.zeros(1, [("a", "f8", (2,))]), np.zeros(1, [("a", "f8", (2, 2))])]
    with pytest.raises(ValueError, match="different types"):
        joined_rows(parts)
