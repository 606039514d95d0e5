"""When a fitted factor confirms another registration of a radar, and what is reported of it."""

import re

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.cross_sensor.registration import (
    FACTOR_WITHIN,
    SIGMAS,
    _is_confirmed,
)
from multiradar.diagnosis.cross_sensor.trimmed_fit import TrimmedFit
from multiradar.diagnosis.model import Diagnosis
from support.inputs.mistaken import DURATION_S, RADARS, START_S, Recording, recording


@pytest.mark.parametrize(
    ("factor", "sigma", "is_confirmed"),
    [
        (1.0, 0.01, True),
        (1.0 + 0.99 * FACTOR_WITHIN, 0.01, True),
        (1.0 - 0.99 * FACTOR_WITHIN, 0.01, True),
        # Far from 1 however accurate, or too inaccurate however near.
        (1.0 + 1.01 * FACTOR_WITHIN, 0.01, False),
        (1.0 - 1.01 * FACTOR_WITHIN, 0.01, False),
        (1.0, 0.99 / SIGMAS, True),
        (1.0, 1.01 / SIGMAS, False),
    ],
)
def test_a_factor_is_near_1_and_significant(
    factor: float, sigma: float, is_confirmed: bool
) -> None:
    nothing = np.zeros((0, 2))
    fit = TrimmedFit(
        np.array([0, 2]), np.array([5.0, factor]), np.diag([1.0, sigma**2]), nothing,
        nothing[:, 0], nothing[:, 0] > 0.0, scale=1.0,
    )  # fmt: skip
    assert _is_confirmed(fit) is is_confirmed


NAME, PERIOD_S = "1-10", RADARS["1-10"][1]
RANGE, TIME, HEIGHT = pl.col("range_m"), pl.col("time_s"), pl.col("height_m")


def said(one: Recording) -> Diagnosis:
    """Return the single diagnosis of the changed radar."""
    (found,) = one.diagnosed()
    assert found.sensor_id == NAME
    return found


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1.003, r" 0\.3% too long"), (0.997, r" 0\.3% too short")],
)
def test_a_range_gain_is_reported_as_such(factor: float, words: str) -> None:
    """It appeared as noise of four times its sigma."""
    found = said(recording().changed(NAME, range_m=RANGE * factor))
    assert (found.code, found.severity) == ("range_gain", "error")
    assert re.search(words, found.sentence) is not None


def test_a_range_gain_that_is_configured_is_not_reported() -> None:
    one = recording().changed(NAME, range_m=RANGE * 1.003)
    assert one.configured(NAME, bias={"range_gain": {"prior": 0.003}}).diagnosed() == []
    estimated = {"range_gain": {"estimate": True}}
    assert one.configured(NAME, bias=estimated).diagnosed() == []


def test_ground_ranges_on_a_flat_earth_are_ground_ranges() -> None:
    flat_m = (RANGE**2 - HEIGHT**2).clip(1.0).sqrt()
    assert said(recording().changed(NAME, range_m=flat_m)).code == "ground_ranges"


@pytest.mark.parametrize(("jump_s", "share"), [(1.5, 0.5), (-2.0, 0.3), (1.5, 0.65)])
def test_a_clock_that_jumps_is_reported_with_the_jump_and_its_time(
    jump_s: float, share: float
) -> None:
    """It appeared as a clock that is off by the mean."""
    at_s = START_S + share * DURATION_S
    found = said(recording().changed(NAME, time_s=TIME + jump_s * (at_s < TIME)))
    assert found.code == "clock"
    match = re.search(r"jumped by ([+-][\d.]+) s at about \S+ (\S+) UTC", found.sentence)
    assert match is not None
    assert float(match[1]) == pytest.approx(jump_s, abs=0.3)
    minutes, seconds = match[2].split(":")[1:]
    assert 60 * int(minutes) + int(seconds) == pytest.approx(share * DURATION_S, abs=15.0)


def test_a_clock_that_drifts_is_reported_with_its_drift() -> None:
    one = recording().changed(NAME, time_s=TIME + 0.012 * (TIME - START_S - 0.5 * DURATION_S))
    found = said(one)
    match = re.search(r"drifts by \+([\d.]+) ms per second", found.sentence)
    assert match is not None
    assert float(match[1]) == pytest.approx(12.0, abs=2.0)


def test_times_of_scans_are_not_taken_for_a_clock_error() -> None:
    floored = (TIME / PERIOD_S).floor() * PERIOD_S
    found = said(recording().changed(NAME, time_s=floored))
    assert found.code == "time_of_scan"
    assert "all plots of a scan have the same time" in found.sentence


# Regression: the clock of the other radar was said to be ahead, too.
def test_times_of_scans_are_no_clock_error_of_the_only_other_radar() -> None:
    floored = (TIME / PERIOD_S).floor() * PERIOD_S
    two = recording().only(NAME, "2-10").changed(NAME, time_s=floored)
    assert two.codes() == [(NAME, "time_of_scan")]


# The errors of an aircraft, such as that of its height, are common to its plots.
@pytest.mark.parametrize(("aircraft", "codes"), [(4, []), (25, [(NAME, "clock")])])
def test_few_aircraft_show_no_jump_of_a_clock(aircraft: int, codes: list[tuple[str, str]]) -> None:
    one = recording()
    one = Recording(one.frame.filter(pl.col("track_number") < aircraft), one.sensors)
    later = TIME > START_S + 0.5 * DURATION_S
    of_each_s = 2.4 + 1.5 * (pl.col("track_number") % 3 - 1)
    jumped = one.changed(NAME, time_s=TIME + pl.when(later).then(of_each_s).otherwise(0.0))
    assert [it for it in jumped.codes() if it[1] == "clock"] == codes
