"""Periods of scans from times and azimuths."""

import numpy as np
import pytest

from multiradar.diagnosis.scans import coherence_at, rotation, windows_of


def plots(period_s: float, *, seconds: float = 200.0, seed: int = 3) -> tuple[np.ndarray, ...]:
    """Return times and azimuths of plots anywhere in the scans of a radar."""
    rng = np.random.default_rng(seed)
    time_s = np.sort(rng.uniform(0.0, seconds, int(4 * seconds)))
    azimuth = 2.0 * np.pi * time_s / period_s + 0.3 + rng.normal(0.0, 0.002, len(time_s))
    return time_s + 1e9, azimuth % (2.0 * np.pi)


@pytest.mark.parametrize("period_s", [1.0, 2.41, 4.0, 4.9, 6.0, 12.0])
def test_the_period_is_found(period_s: float) -> None:
    found = rotation(*plots(period_s))
    # A hundredth of a scan in the 48 s of a window.
    assert found.period_s == pytest.approx(period_s, rel=0.01 * period_s / 48.0 * 2.0)
    assert found.coherence > 0.999


def test_a_period_below_zero_is_a_rotation_against_the_clock() -> None:
    time_s, azimuth = plots(5.0)
    assert rotation(time_s, -azimuth).period_s == pytest.approx(-5.0, rel=0.005)


def test_another_period_is_not_coherent_with_the_azimuths() -> None:
    time_s, azimuth = plots(4.0)
    assert coherence_at(time_s, azimuth, 4.0) > 0.999
    assert coherence_at(time_s, azimuth, 12.0) < 0.5
    assert coherence_at(time_s, azimuth, 2.0) < 0.5


def test_azimuths_that_do_not_rotate_have_no_period() -> None:
    rng = np.random.default_rng(5)
    time_s = np.sort(rng.uniform(0.0, 200.0, 800))
    assert rotation(time_s, rng.uniform(0.0, 2.0 * np.pi, 800)).coherence < 0.6


def test_too_few_plots_give_no_period() -> None:
    time_s, azimuth = plots(4.0, seconds=5.0)
    found = rotation(time_s, azimuth)
    assert np.isnan(found.period_s)
    assert found.coherence == 0.0
    assert coherence_at(time_s, azimuth, 4.0) == 0.0
    assert coherence_at(time_s[:0], azimuth[:0], 4.0) == 0.0


@pytest.mark.parametrize(
    ("last", "sizes"),
    [(24, [100, 100]), (25, [100, 100, 25]), (100, [100, 100, 100]), (101, [100, 100, 100])],
)
def test_a_window_needs_25_plots_and_uses_100(last: int, sizes: list[int]) -> None:
    """The windows start with the first plot, 48 s each; their plots are spread over them."""
    parts = [np.linspace(0.0, 47.99, 110), np.linspace(48.0, 95.99, 300)]
    time_s = 1e9 + np.concatenate([*parts, np.linspace(96.0, 100.0, last)])
    found = windows_of(time_s, np.arange(time_s.size, dtype=np.float64))
    assert [len(times) for times, _ in found] == sizes
    for times, _ in found[:2]:
        assert (times[0], times[-1]) == (0.0, pytest.approx(47.99))


def test_five_windows_are_spread_over_a_recording() -> None:
    time_s = np.arange(0.0, 9 * 48.0)
    found = windows_of(time_s, time_s)
    assert [int(azimuths[0] // 48.0) for _, azimuths in found] == [0, 2, 4, 6, 8]


@pytest.mark.parametrize(("off", "coherent"), [(0.029, True), (-0.029, True), (0.05, False)])
def test_coherence_is_that_within_3_per_cent_of_a_period(off: float, *, coherent: bool) -> None:
    time_s, azimuth = plots(4.0)
    assert (coherence_at(time_s, azimuth, 4.0 * (1.0 + off)) > 0.99) is coherent
