"""Late and future measurements, and a data clock that no wrong sensor carries away."""

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, JournalError
from multiradar.runtime.admission import _admission_kernels as kernels
from multiradar.runtime.admission.admission_by_time import ACCEPTED, EXCESS, FUTURE, LATE, Admission
from multiradar.runtime.admission.reject_file import TimeRejects
from multiradar.tracking.input.measurements import MeasurementBatch
from support.inputs.timed_batches import timed_batch
from support.kernels import plain as plain_form


def _codes(admission: Admission, times: list[float], sensor: int | list[int] = 0) -> list[int]:
    return [int(code) for code in admission.admit(timed_batch(times, sensor))]


@pytest.mark.fault(7)
def test_what_is_older_than_the_horizon_is_late() -> None:
    admission = Admission(6.0, 1)
    assert _codes(admission, [100.0, 94.0, 93.999, 106.0, 99.999, 100.0]) == [
        ACCEPTED, ACCEPTED, LATE, ACCEPTED, LATE, ACCEPTED,
    ]  # fmt: skip
    assert admission.data_clock_s == 106.0


def test_a_horizon_of_zero_accepts_ordered_rows_only() -> None:
    assert _codes(Admission(0.0, 1), [5.0, 5.0, 4.999, 6.0]) == [ACCEPTED, ACCEPTED, LATE, ACCEPTED]


def test_without_paces_no_row_is_excess() -> None:
    """A row behind one that the data clock did not follow was, and its reason divided by zero."""
    admission = Admission(6.0, 3)
    _codes(admission, [float(place) for place in range(9)], [0, 1, 2] * 3)
    assert _codes(admission, [12.0, 12.1, 10.9, 10.8]) == [ACCEPTED] * 4
    assert admission.storms() == []


def test_one_absurd_time_does_not_carry_the_data_clock_away() -> None:
    admission = Admission(6.0, 1)
    assert _codes(admission, [100.0, 1e10, 101.0, 700.0]) == [ACCEPTED, FUTURE, ACCEPTED, ACCEPTED]
    assert _codes(admission, [1300.001, 1e10, 699.0]) == [FUTURE, FUTURE, ACCEPTED]
    assert admission.data_clock_s == 700.0


@pytest.mark.fault(7)
def test_a_late_row_does_not_move_the_data_clock_back() -> None:
    admission = Admission(6.0, 1)
    assert _codes(admission, [100.0, -50.0, 99.0]) == [ACCEPTED, LATE, ACCEPTED]


def test_the_stream_goes_on_after_a_long_gap_when_rows_agree() -> None:
    admission = Admission(6.0, 1)
    codes = _codes(admission, [100.0, 9000.0, 9001.0, 9000.5, 9002.0, 9003.0, 9004.0, 101.0])
    assert codes == [ACCEPTED, FUTURE, FUTURE, FUTURE, FUTURE, ACCEPTED, ACCEPTED, LATE]


def test_absurd_times_that_differ_never_agree() -> None:
    admission = Admission(6.0, 1)
    times = [100.0, *(10_000.0 * place for place in range(1, 20))]
    assert _codes(admission, times)[1:] == [FUTURE] * 19
    assert admission.data_clock_s == 100.0


def test_a_row_in_time_ends_a_run_of_rows_from_the_future() -> None:
    admission = Admission(6.0, 1)
    times = [100.0] + [9000.0] * 4 + [101.0] + [9000.0] * 4 + [102.0]
    assert _codes(admission, times).count(FUTURE) == 8


def test_a_late_row_ends_a_run_of_rows_from_the_future_too() -> None:
    admission = Admission(6.0, 1)
    times = [100.0] + [9000.0] * 4 + [50.0] + [9000.0] * 4
    assert _codes(admission, times) == [ACCEPTED] + [FUTURE] * 4 + [LATE] + [FUTURE] * 4


def test_one_sensor_among_several_cannot_move_the_clock_with_one_batch() -> None:
    admission = Admission(6.0, 2)
    _codes(admission, [100.0, 100.0], [0, 1])
    tomorrow = [86_500.0 + 0.05 * place for place in range(1000)]
    assert set(_codes(admission, tomorrow, 1)) == {FUTURE}
    assert _codes(admission, [101.0, 101.5], [0, 1]) == [ACCEPTED, ACCEPTED]


def test_two_sensors_that_agree_move_the_clock() -> None:
    admission = Admission(6.0, 2)
    _codes(admission, [100.0, 100.0], [0, 1])
    assert _codes(admission, [9000.0] * 6, [0, 0, 1, 0, 0, 0]) == [FUTURE] * 4 + [ACCEPTED] * 2


def test_a_sensor_that_is_alone_for_long_moves_the_clock() -> None:
    admission = Admission(6.0, 2)
    _codes(admission, [100.0, 100.0], [0, 1])
    times = [9000.0 + 10.0 * place for place in range(10)]
    assert _codes(admission, times, 1) == [FUTURE] * 6 + [ACCEPTED] * 4


def test_no_row_is_accepted_before_the_end_of_a_stream() -> None:
    admission = Admission(6.0, 1)
    _codes(admission, [100.0])
    admission.flush()
    assert _codes(admission, [99.0, 100.0, 101.0, 99.5, 100.5]) == [
        LATE, ACCEPTED, ACCEPTED, LATE, ACCEPTED,
    ]  # fmt: skip


def test_the_end_of_an_empty_stream_changes_nothing() -> None:
    admission = Admission(6.0, 1)
    admission.flush()
    assert admission.data_clock_s is None
    assert _codes(admission, [-5.0]) == [ACCEPTED]


def _sentences(admission: Admission, times: list[float]) -> list[str]:
    batch = timed_batch(times)
    codes = admission.admit(batch)
    rejects = TimeRejects(admission, admission.clock_s, batch, codes)
    return [why for _, _, why in rejects.rejections]


def test_a_reject_reason_has_the_expected_and_the_actual_time() -> None:
    assert _sentences(Admission(6.0, 1), [100.0, 93.0, 1e10]) == [
        "expected a time at most 6 s before the data time 100.0 s, was 93.0 s",
        "expected a time at most 600 s after the data time 100.0 s, was 10000000000.0 s",
    ]


def test_measurements_after_the_end_of_their_stream_are_late() -> None:
    admission = Admission(6.0, 1)
    admission.admit(timed_batch([100.0]))
    admission.flush()
    assert _sentences(admission, [98.0, 103.0, 99.0, 107.0, 100.5]) == [
        "expected a time not before the end of the stream at 100.0 s, was 98.0 s",
        "expected a time not before the end of the stream at 100.0 s, was 99.0 s",
        "expected a time at most 6 s before the data time 107.0 s, was 100.5 s",
    ]


@pytest.mark.parametrize("state", ["", "{}", "[]", '{"clock": [], "run": []}', '{"clock": "x"}'])
def test_an_invalid_state_is_rejected(state: str) -> None:
    with pytest.raises(JournalError, match="expected an admission state"):
        Admission(6.0, 1).restore(state)


@pytest.mark.parametrize(("horizon_s", "jump_s"), [(-1.0, 600.0), (np.nan, 600.0), (6.0, 0.0)])
def test_invalid_bounds_are_rejected(horizon_s: float, jump_s: float) -> None:
    with pytest.raises(ConfigurationError, match="expected a reorder horizon"):
        Admission(horizon_s, 1, jump_s)


def test_the_compiled_loop_does_what_the_plain_one_does() -> None:
    random = np.random.default_rng(5)
    steps = random.choice([0.1, -3.0, -20.0, 4.0, 15.0, 700.0, 9000.0, 0.0], 5000)
    batch = timed_batch((1000.0 + np.cumsum(steps)).tolist(), random.integers(0, 3, 5000).tolist())
    paces = np.array([[0.0, 0.0], [40.0, 60.0], [0.0, 0.0]])
    compiled, plain = Admission(6.0, 3, paces=paces), Admission(6.0, 3, paces=paces)
    expected = np.empty(len(batch), np.int8)
    plain_form(kernels.admit)(
        batch.time_s, batch.sensor, np.nan, plain._bounds, plain._tolerance, plain._pace,
        plain._due, plain._clock, plain._run, plain._standing, plain._lead, plain._heard, expected,
        np.empty(len(batch)),
    )  # fmt: skip
    assert compiled.admit(batch).tolist() == expected.tolist()
    assert compiled.state() == plain.state()
    assert set(expected.tolist()) == {ACCEPTED, LATE, FUTURE, EXCESS}


def test_no_rows_change_nothing() -> None:
    admission = Admission(6.0, 1)
    before = admission.state()
    assert admission.admit(MeasurementBatch.empty()).tolist() == []
    assert admission.state() == before


@pytest.mark.parametrize("pace", [2.0, 30.0, 1000.0])
@pytest.mark.parametrize("is_merged", [True, False])
def test_senders_that_resend_in_step_after_an_outage_lose_nothing(
    pace: float, is_merged: bool
) -> None:
    """The first to resend alone takes the data time to the present, as the manual says."""
    admission, start_s = Admission(6.0, 3), 1_800_000_000.0
    rows = sorted((0.3 * n + 0.1 * sensor, sensor) for n in range(200) for sensor in range(3))
    before, kept = [one for one in rows if one[0] < 20.0], [one for one in rows if one[0] >= 20.0]
    for at_s, sensor in before:
        codes = admission.admit(timed_batch([start_s + at_s], sensor), start_s + at_s + 0.2)
        assert codes.tolist() == [ACCEPTED]
    if not is_merged:
        kept.sort(key=lambda one: (one[1], one[0]))
    lost = [0, 0, 0]
    for at_s, sensor in kept:
        received_s = start_s + 60.0 + (at_s - 20.0) / pace
        codes = admission.admit(timed_batch([start_s + at_s], sensor), received_s)
        lost[sensor] += int(codes[0] != ACCEPTED)
    assert lost[0] == 0
    assert (sum(lost) == 0) is is_merged
