"""Measurements of a journal are admitted by time as they were when it was written."""

import json

import numpy as np
import pytest

from multiradar.errors import JournalError
from multiradar.runtime.admission.admission_by_time import (
    ACCEPTED,
    EXCESS,
    LATE,
    Admission,
    data_clock_of,
)
from multiradar.runtime.admission.past_admission import PastAdmission
from multiradar.tracking.input.measurements import MeasurementBatch
from support.inputs.timed_batches import timed_batch

NOW_S = 1_800_000_000.0
HORIZON_S = 6.0
Journal = list[tuple[MeasurementBatch, str]]


def _live(step_s: float) -> tuple[Journal, Admission]:
    """Return what a journal has of a time in which the data clock was set or the machine's was."""
    live, journal = Admission(HORIZON_S, 2), Journal()
    offset_s = 0.0
    for number in range(60):
        if number == 30:
            offset_s = step_s
            if step_s < 0.0:
                live.set_clock(NOW_S + number + step_s)
                journal.append((timed_batch([]), live.state()))
        at_s = NOW_S + number + offset_s
        batch = timed_batch([at_s, at_s + 0.1], [0, 1])
        code = live.admit(batch, at_s + 0.3)
        journal.append((batch.select(code == ACCEPTED), live.state()))
    return journal, live


def _again(past: PastAdmission, journal: Journal) -> list[int]:
    codes = []
    for batch, state in journal:
        if not len(batch):
            past.set_clock(data_clock_of(state))
        codes += past.admit(batch).tolist()
        past.use_clock_of(state)
    return codes


@pytest.mark.parametrize("step_s", [-3600.0, -30.0, -3.0, 0.0, 4.0, 30.0, 3600.0])
def test_what_was_accepted_is_accepted_again(step_s: float) -> None:
    journal, live = _live(step_s)
    past = PastAdmission(HORIZON_S, 2)
    codes = _again(past, journal)
    assert len(codes) > 100
    assert set(codes) == {ACCEPTED}
    assert past.data_clock_s == live.data_clock_s
    assert past.floor_s == live.floor_s


def test_the_journal_of_a_host_whose_clock_jumps_needs_the_old_data_clock() -> None:
    journal, _ = _live(3600.0)
    without = Admission(HORIZON_S, 2)
    codes = [code for batch, _ in journal for code in without.admit(batch).tolist()]
    assert set(codes) != {ACCEPTED}


def test_a_shorter_horizon_rejects_what_is_late_by_it() -> None:
    live, past = Admission(HORIZON_S, 1), PastAdmission(1.0, 1)
    journal = Journal()
    for times in ([NOW_S], [NOW_S + 2.0], [NOW_S + 0.5, NOW_S + 1.5]):
        batch = timed_batch(times)
        assert not live.admit(batch).any()
        journal.append((batch, live.state()))
    assert _again(past, journal) == [ACCEPTED, ACCEPTED, LATE, ACCEPTED]
    assert past.clock_s.tolist() == [NOW_S + 2.0] * 2


def test_a_lower_rate_rejects_what_is_beyond_it() -> None:
    paces = np.array([[10.0, 15.0]])
    past, live = (kind(HORIZON_S, 1, paces=paces) for kind in (PastAdmission, Admission))
    batch = timed_batch((NOW_S + 0.1 * np.arange(4)).tolist())
    codes = past.admit(batch).tolist()
    assert codes == live.admit(batch).tolist()
    assert set(codes) == {ACCEPTED, EXCESS}


def test_the_clock_is_taken_from_a_state_with_other_sensors_or_of_an_older_version() -> None:
    journal, live = _live(0.0)
    past = PastAdmission(HORIZON_S, 1)
    state = json.loads(journal[-1][1]) | {"contradicted": [[1, 2]], "due": [[1, "0x1p0"]]}
    past.use_clock_of(json.dumps(state))
    assert past.data_clock_s == live.data_clock_s
    past.use_clock_of(json.dumps({"clock": state["clock"][:4], "run": [0] * 5}))
    assert past.data_clock_s == live.data_clock_s


@pytest.mark.parametrize("state", ["{}", "[]", "no", '{"clock": ["1"]}', '{"clock": ["x"] }'])
def test_a_clock_is_not_taken_from_something_else(state: str) -> None:
    with pytest.raises(JournalError, match="expected an admission state"):
        PastAdmission(HORIZON_S, 1).use_clock_of(state)
