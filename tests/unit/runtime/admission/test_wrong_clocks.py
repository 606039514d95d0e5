"""A radar with a wrong clock costs the others no measurement, and is named."""

import numpy as np
import pytest

from multiradar.runtime.admission._admission_kernels import (
    HEARD_MAX,
    HEARD_MIN,
    RECEIVED,
    SAMPLES,
    _vote,
)
from multiradar.runtime.admission.admission_by_time import ACCEPTED, FUTURE, Admission
from support.inputs.timed_batches import timed_batch
from support.kernels import plain

#: Right sensors, and one with a wrong clock.
RIGHT, WRONG = (0, 1), 2
NOW_S = 1_800_000_000.0


def _stream(
    offset_s: float, *, duration_s: float = 120.0, order: int = 0
) -> list[tuple[float, float, int]]:
    """Return reception, time and sensor of plots in the order of their reception."""
    rows = []
    for sensor, period_s in ((RIGHT[0], 0.31), (RIGHT[1], 0.43), (WRONG, 0.37)):
        for at in np.arange(0.05 * ((sensor + order) % 3), duration_s, period_s).tolist():
            time_s = at + (offset_s if sensor == WRONG else 0.0)
            rows.append((at + 0.2, time_s, sensor))
    return sorted(rows)


def _lost(
    admission: Admission, stream: list[tuple[float, float, int]], start_s: float, *, live: bool
) -> dict[int, int]:
    lost = {sensor: 0 for sensor in (*RIGHT, WRONG)}
    for received_s, time_s, sensor in stream:
        codes = admission.admit(
            timed_batch([start_s + time_s], sensor), start_s + received_s if live else None
        )
        lost[sensor] += int(codes[0] != ACCEPTED)
    return lost


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("offset_s", [10.0, 60.0, 590.0, 1000.0, -10.0, -60.0, -590.0, -86_400.0])
@pytest.mark.parametrize("live", [True, False])
@pytest.mark.fault(8, 16)
@pytest.mark.fault(8)
def test_a_wrong_clock_costs_the_others_nothing_and_is_named(
    offset_s: float, live: bool, order: int
) -> None:
    admission = Admission(6.0, 3)
    lost = _lost(admission, _stream(offset_s, order=order), NOW_S, live=live)
    assert [lost[sensor] for sensor in RIGHT] == [0, 0]
    assert lost[WRONG] > 300
    leads = admission.clock_leads()
    assert list(leads) == [WRONG]
    assert leads[WRONG] == pytest.approx(offset_s, abs=1.5)


@pytest.mark.parametrize("rate", [0.1, 0.5, -0.1])
@pytest.mark.parametrize("live", [True, False])
def test_a_clock_that_drifts_away_costs_the_others_nothing_and_is_named(
    rate: float, live: bool
) -> None:
    admission = Admission(6.0, 3)
    stream = [
        (received_s, time_s * (1.0 + rate) if sensor == WRONG else time_s, sensor)
        for received_s, time_s, sensor in _stream(0.0)
    ]
    lost = _lost(admission, stream, NOW_S, live=live)
    assert [lost[sensor] for sensor in RIGHT] == [0, 0]
    assert list(admission.clock_leads()) == [WRONG]
    assert admission.data_clock_s == pytest.approx(NOW_S + 120.0, abs=3.5)


def _pair(rate: float = 0.0, *, duration_s: float = 120.0) -> list[tuple[float, float, int]]:
    """Return plots of one right sensor and one whose clock gains by a rate."""
    return [
        (received_s, time_s * (1.0 + rate) if sensor == WRONG else time_s, sensor)
        for received_s, time_s, sensor in _stream(0.0, duration_s=duration_s)
        if sensor != RIGHT[1]
    ]


@pytest.mark.parametrize("rate", [0.05, 0.1, 0.5, -0.1])
def test_one_of_two_clocks_that_drifts_away_costs_the_other_nothing(rate: float) -> None:
    admission = Admission(6.0, 3)
    lost = _lost(admission, _pair(rate), NOW_S, live=True)
    assert lost[RIGHT[0]] == 0
    assert lost[WRONG] > 100
    assert list(admission.clock_leads()) == [WRONG]
    assert admission.data_clock_s == pytest.approx(NOW_S + 120.0, abs=3.5)


def test_one_of_two_clocks_returns_once_it_is_corrected() -> None:
    admission = Admission(6.0, 3)
    _lost(admission, _pair(0.1), NOW_S, live=True)
    later = [(at_s + 120.0, time_s + 120.0, sensor) for at_s, time_s, sensor in _pair()]
    assert sum(_lost(admission, later, NOW_S, live=True).values()) == 0
    assert not admission.clock_leads()


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize("machine_s", [0.0, -10.0, 10.0])
def test_delays_of_one_of_two_sensors_cost_nothing(machine_s: float, live: bool) -> None:
    generator = np.random.default_rng(5)
    stream = [
        (received_s + (generator.uniform(0.0, 5.5) if sensor == WRONG else 0.0), time_s, sensor)
        for received_s, time_s, sensor in _pair()
    ]
    heard = [
        (received_s + machine_s, time_s, sensor) for received_s, time_s, sensor in sorted(stream)
    ]
    assert sum(_lost(Admission(6.0, 3), heard, NOW_S, live=live).values()) == 0


@pytest.mark.parametrize("delay_s", [0.0, 5.0])
@pytest.mark.parametrize("rate", [-0.1, -0.01, 0.0, 0.1])
def test_a_clock_of_the_machine_that_drifts_costs_two_sensors_nothing(
    rate: float, delay_s: float
) -> None:
    stream = sorted(
        (received_s + (delay_s if sensor == WRONG else 0.0), time_s, sensor)
        for received_s, time_s, sensor in _pair()
    )
    heard = [(received_s * (1.0 + rate), time_s, sensor) for received_s, time_s, sensor in stream]
    assert sum(_lost(Admission(6.0, 3), heard, NOW_S, live=True).values()) == 0


@pytest.mark.parametrize("live", [True, False])
def test_rows_that_follow_one_another_do_not_move_the_clock_alone(live: bool) -> None:
    admission = Admission(6.0, 3)
    _lost(admission, _stream(0.0, duration_s=20.0), NOW_S, live=live)
    # Within the tolerance of the row before, each.
    steps = [(20.2, 20.0 + 2.0 * step, WRONG) for step in range(1, 6)]
    _lost(admission, steps, NOW_S, live=live)
    late = [(20.4, 17.5, sensor) for sensor in RIGHT]
    assert sum(_lost(admission, late, NOW_S, live=live).values()) == 0
    assert admission.data_clock_s == pytest.approx(NOW_S + 22.0, abs=1.1)


@pytest.mark.parametrize("offset_s", [60.0, -60.0])
@pytest.mark.parametrize("live", [True, False])
@pytest.mark.fault(8)
def test_it_is_named_within_two_scans(live: bool, offset_s: float) -> None:
    admission = Admission(6.0, 3)
    lost = _lost(admission, _stream(offset_s, duration_s=8.0), NOW_S, live=live)
    assert list(admission.clock_leads()) == [WRONG]
    assert [lost[sensor] for sensor in RIGHT] == [0, 0]


def test_the_tolerance_of_a_sensor_is_its_own() -> None:
    tolerances_s = np.array([np.nan, 1.0, 5.0])
    admission = Admission(6.0, 3, tolerances_s=tolerances_s)
    _lost(admission, _stream(0.0, duration_s=5.0), NOW_S, live=False)
    clock_s = admission.released_to_s
    for sensor, lead_s, expected_s in ((0, 3.5, 0.0), (1, 1.5, 0.0), (2, 4.0, 4.0)):
        # Rows that are farther ahead than their sensors may be wait for others.
        admission.admit(timed_batch([clock_s + lead_s], sensor))
        admission._run[0] = 0
        assert admission.data_clock_s == clock_s + expected_s
    assert [admission.tolerance_of(sensor) for sensor in range(3)] == [3.0, 1.0, 5.0]


@pytest.mark.parametrize("step_s", [-600.0, 30.0])
def test_an_operator_sets_the_data_clock(step_s: float) -> None:
    admission = Admission(6.0, 3, paces=np.tile([0.2, 20.0], (3, 1)))
    _lost(admission, _stream(0.0, duration_s=30.0), NOW_S, live=False)
    state = admission.state()
    admission.set_clock(NOW_S + 30.0 + step_s)
    assert admission.released_to_s == NOW_S + 30.0 + step_s
    again = Admission(6.0, 3, paces=np.tile([0.2, 20.0], (3, 1)))
    again.restore(admission.state())
    assert state != admission.state() == again.state()
    later = [(30.0 + at, 30.0 + step_s + time, s) for at, time, s in _stream(0.0, duration_s=20.0)]
    for one in (admission, again):
        assert set(_lost(one, later, NOW_S, live=False).values()) == {0}
        assert one.data_clock_s == pytest.approx(NOW_S + 50.0 + step_s, abs=0.5)


def test_batches_of_whole_scans_do_not_move_the_clock_either() -> None:
    admission = Admission(6.0, 3)
    lost = 0
    for scan in range(20):
        for sensor in (WRONG, *RIGHT):
            times = 4.0 * scan + np.linspace(0.0, 3.9, 30) + (10.0 if sensor == WRONG else 0.0)
            codes = admission.admit(timed_batch(times.tolist(), sensor))
            lost += int(np.count_nonzero(codes != ACCEPTED)) if sensor != WRONG else 0
    assert lost == 0


@pytest.mark.fault(8, 20)
def test_a_forged_row_within_a_minute_is_rejected_at_once() -> None:
    admission = Admission(6.0, 3)
    _lost(admission, _stream(0.0, duration_s=20.0), NOW_S, live=True)
    forged = timed_batch([NOW_S + 79.0], RIGHT[0])
    assert admission.admit(forged, NOW_S + 20.2).tolist() == [FUTURE]
    later = [(20.0 + at, 20.0 + time, s) for at, time, s in _stream(0.0, duration_s=20.0)]
    assert set(_lost(admission, later, NOW_S, live=True).values()) == {0}


@pytest.mark.fault(8)
@pytest.mark.parametrize("wait_s", [0.0, 1.0, 2.0, 3.0])
def test_two_forged_rows_after_a_restart_cost_the_others_nothing(wait_s: float) -> None:
    """Of one sensor, they confirmed each other before the others had been heard again."""
    before, restart_s = Admission(6.0, 3), 40.0
    stream = _stream(0.0)
    admission = before
    lost, forged = {sensor: 0 for sensor in (*RIGHT, WRONG)}, False
    for received_s, time_s, sensor in stream:
        if received_s >= restart_s and admission is before:
            admission = Admission(6.0, 3)
            admission.restore(before.state())
        if received_s >= restart_s + wait_s and not forged:
            forged = True
            ahead = [NOW_S + received_s + lead_s for lead_s in (4.3, 58.0)]
            admission.admit(timed_batch(ahead, WRONG), NOW_S + received_s)
        codes = admission.admit(timed_batch([NOW_S + time_s], sensor), NOW_S + received_s)
        lost[sensor] += int(codes[0] != ACCEPTED)
    assert forged
    assert [lost[sensor] for sensor in RIGHT] == [0, 0]


def test_a_forged_row_of_the_only_radar_is_rejected() -> None:
    admission = Admission(6.0, 1)
    for at in range(20):
        assert not admission.admit(timed_batch([NOW_S + at]), NOW_S + at + 0.5).any()
    assert admission.admit(timed_batch([NOW_S + 79.0]), NOW_S + 20.0).tolist() == [FUTURE]
    assert admission.admit(timed_batch([NOW_S + 20.0]), NOW_S + 20.5).tolist() == [ACCEPTED]


@pytest.mark.parametrize("live", [True, False])
def test_after_a_gap_no_row_is_lost(live: bool) -> None:
    admission = Admission(6.0, 3)
    stream = [row for row in _stream(0.0) if not 30.0 <= row[0] < 75.0]
    assert set(_lost(admission, stream, NOW_S, live=live).values()) == {0}
    assert admission.data_clock_s == pytest.approx(NOW_S + 120.0, abs=0.5)
    assert not admission.clock_leads()


def test_the_clock_of_the_machine_alone_rejects_nothing() -> None:
    # It is 40 s slow; all sensors agree.
    admission = Admission(6.0, 3)
    stream = [(at - 40.0, time_s, sensor) for at, time_s, sensor in _stream(0.0)]
    assert set(_lost(admission, stream, NOW_S, live=True).values()) == {0}
    assert admission.data_clock_s == pytest.approx(NOW_S + 120.0, abs=0.5)


def test_a_radar_that_is_left_alone_goes_on() -> None:
    admission = Admission(6.0, 3)
    _lost(admission, _stream(0.0, duration_s=20.0), NOW_S, live=False)
    times = [NOW_S + 30.0 + 5.0 * at for at in range(10)]
    assert not admission.admit(timed_batch(times, RIGHT[0])).any()
    assert admission.data_clock_s == times[-1]


def test_a_replay_faster_than_real_time_loses_nothing() -> None:
    admission = Admission(6.0, 3)
    stream = [(at / 20.0, time_s, sensor) for at, time_s, sensor in _stream(0.0, duration_s=600.0)]
    stream = [row for row in stream if not 200.0 <= row[1] < 230.0]
    assert set(_lost(admission, stream, NOW_S - 700.0, live=True).values()) == {0}
    assert admission.data_clock_s == pytest.approx(NOW_S - 100.0, abs=0.5)
    assert not admission.clock_leads()


def test_a_radar_whose_clock_is_corrected_returns() -> None:
    admission = Admission(6.0, 3)
    _lost(admission, _stream(10.0, duration_s=30.0), NOW_S, live=False)
    assert list(admission.clock_leads()) == [WRONG]
    later = [(30.0 + at, 30.0 + time, s) for at, time, s in _stream(0.0, duration_s=30.0)]
    assert set(_lost(admission, later, NOW_S, live=False).values()) == {0}
    assert not admission.clock_leads()


# Ahead of the clock of the machine, which alone rejects nothing.
@pytest.mark.parametrize(("samples", "vote"), [(HEARD_MIN - 1, 0), (HEARD_MIN, -1)])
def test_a_sensor_votes_once_it_was_heard_often_enough(samples: int, vote: int) -> None:
    bounds, standing = np.full(6, 10.0), np.zeros((1, 3), np.int64)
    heard = np.zeros((1, HEARD_MAX, 2))
    standing[0, SAMPLES] = samples
    heard[0, :, RECEIVED] = NOW_S
    assert plain(_vote)(100.0, NOW_S, bounds, standing, heard) == vote


def test_after_a_full_disk_the_sensors_are_still_heard() -> None:
    """The clock of the machine would follow any step while none is."""
    admission = Admission(6.0, 3)
    _lost(admission, _pair(), NOW_S, live=True)
    end_s = NOW_S + 120.0
    before = admission.leads_s(end_s)
    assert len(before) == 2
    admission.restore(admission.state())
    assert admission.leads_s(end_s) == before
