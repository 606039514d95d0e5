"""A sensor that delivers more than it can costs the others nothing, and is named."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.measurement.plot_rates import (
    BURST_S,
    PLOTS_LEAST,
    PLOTS_MOST,
    plot_paces,
    plots_per_scan_max,
)
from multiradar.runtime.admission.admission_by_time import ACCEPTED, EXCESS, Admission
from multiradar.runtime.admission.reject_file import TimeRejects
from support.inputs.timed_batches import timed_batch
from support.processes.live_services import TABLE

#: 128 rows a second, and eight seconds of them at once.
PACE = [1.0 / 128.0, 8.0]
RIGHT, STORM = 0, 1


def _admission(sensors: int = 2) -> Admission:
    admission = Admission(6.0, sensors, paces=np.array([PACE] * sensors))
    # Both have been seen: the data clock is set.
    admission.admit(timed_batch([100.0] * sensors, list(range(sensors))))
    return admission


def _storm(first_s: float, last_s: float, rate: float) -> list[float]:
    return np.arange(first_s, last_s, 1.0 / rate).tolist()


@pytest.mark.fault(17)
def test_a_storm_passes_at_the_rate_of_its_sensor_and_costs_the_others_nothing() -> None:
    admission = _admission()
    accepted = {RIGHT: 0, STORM: 0}
    for second in range(100, 120):
        times = _storm(second + 0.001, second + 1.0, 1000.0)
        codes = admission.admit(timed_batch(times, STORM))
        assert set(codes.tolist()) <= {ACCEPTED, EXCESS}
        accepted[STORM] += int(np.count_nonzero(codes == ACCEPTED))
        codes = admission.admit(timed_batch(_storm(second, second + 1.0, 50.0), RIGHT))
        accepted[RIGHT] += int(np.count_nonzero(codes == ACCEPTED))
    assert accepted[RIGHT] == 20 * 50
    assert accepted[STORM] == pytest.approx(20 * 128 + 8 * 128, abs=5)
    assert admission.storms() == [STORM]


def test_the_alarm_ends_with_the_storm() -> None:
    admission = _admission()
    admission.admit(timed_batch([100.125] * 2000, STORM))
    assert admission.storms() == [STORM]
    admission.admit(timed_batch(_storm(100.0, 105.0, 50.0), RIGHT))
    assert not admission.storms()
    assert admission.admit(timed_batch([105.0], STORM)).tolist() == [ACCEPTED]


def test_storms_are_read_while_another_thread_adds_a_sensor() -> None:
    admission = _admission()
    admission.admit(timed_batch([100.125] * 2000, STORM))
    # One of the two that `use` sets, one after the other.
    admission._due = np.append(admission._due, -np.inf)
    assert admission.storms() == [STORM]
    admission._pace = np.array([PACE] * 4)
    assert admission.storms() == [STORM]


def test_a_sensor_alone_delivers_again_after_its_storm() -> None:
    admission = _admission(1)
    admission.admit(timed_batch([100.125] * 2000))
    assert admission.admit(timed_batch([100.126, 101.0, 102.0])).tolist() == [
        EXCESS, ACCEPTED, ACCEPTED,
    ]  # fmt: skip


def test_one_wrong_time_does_not_shut_its_sensor_out() -> None:
    admission = _admission()
    admission.admit(timed_batch([690.0], STORM))
    later = admission.admit(timed_batch(_storm(100.1, 101.0, 50.0), STORM))
    assert EXCESS not in later


def test_rows_that_are_rejected_for_their_time_are_not_counted() -> None:
    admission = _admission()
    admission.admit(timed_batch([50.0] * 1000, STORM))
    assert not admission.storms()


def test_the_reason_names_the_bound() -> None:
    admission = _admission()
    batch = timed_batch([100.125] * 2000, STORM)
    codes = admission.admit(batch)
    (first, *_) = TimeRejects(admission, admission.clock_s, batch, codes).rejections
    assert first[1:] == (
        "RATE_EXCEEDED",
        "the sensor exceeds 128 measurements per second of data time",
    )


def test_the_bound_follows_from_coverage_and_scan_period() -> None:
    count = len(TABLE)
    ranges = np.array([np.inf, 300e3, 5e3])
    table = replace(TABLE, range_max_m=ranges, rotation_period_s=np.array([np.nan, 4.0, 1.0]))
    assert count == 3
    assert plots_per_scan_max(table).tolist() == [PLOTS_MOST, 14137.0, PLOTS_LEAST]
    assert (1.0 / plot_paces(table)[:, 0]).tolist() == pytest.approx([20_000.0, 3534.25, 10_000.0])
    assert plot_paces(table)[:, 1].tolist() == [BURST_S] * 3
    given = replace(table, plots_per_scan_max=np.array([np.nan, 500.0, 2e6 / 4]))
    assert plots_per_scan_max(given).tolist() == [PLOTS_MOST, 500.0, 500_000.0]
