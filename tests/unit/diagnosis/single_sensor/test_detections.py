"""Aircraft that a radar detects once in several scans."""

import numpy as np
import pytest

from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Plots
from multiradar.diagnosis.single_sensor.detections import (
    _detected,
    _Followed,
    check_detections,
)

SITE = (0.87, 0.26, 0.0)
PERIOD_S, EVERY = 4.0, 3


def _found(sizes: list[int], *, speed_mps: float = 0.0, rotating: bool = True) -> Diagnosis | None:
    """Return what is found of aircraft with so many plots each, one in every third scan."""
    random = np.random.default_rng(3)
    number = np.arange(len(sizes)).repeat(sizes)
    scan = EVERY * np.concatenate([np.arange(one) for one in sizes])
    azimuth_deg = np.linspace(7.0, 331.0, len(sizes))[number]
    within = azimuth_deg / 360.0 if rotating else random.uniform(0.0, 1.0, len(sizes))[number]
    time_s = PERIOD_S * (scan + within)
    missing = np.full(len(number), np.nan)
    keys = np.full((len(number), 3), -1, np.int64)
    keys[:, 0] = number
    order = np.argsort(time_s)
    plots = Plots(
        time_s, 20e3 + speed_mps * time_s, azimuth_deg, missing, missing,
        np.zeros(len(number)), keys,
    ).select(order)  # fmt: skip
    return check_detections("1-10", plots, SITE, PERIOD_S)


@pytest.mark.parametrize(
    ("found", "known"),
    [
        (_found([30] * 10), True),
        (_found([3] * 10), True),
        (_found([3] * 9 + [2]), False),
        # At such a speed plots are of different aircraft.
        (_found([30] * 10, speed_mps=399.0), True),
        (_found([30] * 10, speed_mps=401.0), False),
    ],
)
def test_missing_plots_show_between_twenty_plots_of_aircraft(
    found: Diagnosis | None, *, known: bool
) -> None:
    assert (found is not None) is known
    assert found is None or "detected only once in about 3 scans (of 4 s by " in found.sentence


@pytest.mark.parametrize("rotating", [True, False])
def test_the_source_of_the_scan_period_is_named(*, rotating: bool) -> None:
    found = _found([30] * 10, rotating=rotating)
    assert found is not None
    source = "the azimuths of its plots" if rotating else "rotation_period_s in the sensors file"
    assert f"(of 4 s by {source}): rows are probably missing" in found.sentence
    assert (", or rotation_period_s is wrong; record" in found.sentence) is not rotating


# Twenty plots of each aircraft: once in three scans, or in each scan.
@pytest.mark.parametrize(
    ("rare", "aircraft", "known"),
    [(7, 10, True), (6, 10, False), (3, 3, True), (2, 2, False)],
)
def test_seven_tenths_of_the_aircraft_and_three_are_rarely_detected(
    rare: int, aircraft: int, *, known: bool
) -> None:
    number = np.arange(aircraft).repeat(20)
    scans = np.where(number < rare, 3.0, 1.0)
    found = _detected(_Followed(number, scans, np.zeros(len(number))))
    assert found == (len(number) / scans.sum() if known else None)
