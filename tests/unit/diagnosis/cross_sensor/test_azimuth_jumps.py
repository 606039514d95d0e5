"""Azimuths that are off by another angle from some time on."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from support.inputs.mistaken import DURATION_S, RADARS, START_S, Recording, recording

NAME = "1-10"
AZIMUTH, TIME = pl.col("azimuth_deg"), pl.col("time_s")


def jumped(one: Recording, angle_deg: float, share: float = 0.5, *names: str) -> Recording:
    """Return a recording in which azimuths jump after a part of it."""
    later = pl.col("time_s") >= START_S + share * DURATION_S
    turned = pl.when(later).then((AZIMUTH + angle_deg) % 360.0).otherwise(AZIMUTH)
    return one.changed(*(names or (NAME,)), azimuth_deg=turned)


@pytest.mark.parametrize("angle_deg", [1.5, -3.0, 10.0])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_a_jump_is_named_with_its_time_and_angle(angle_deg: float, share: float) -> None:
    (found,) = jumped(recording(), angle_deg, share).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "azimuth_jump", "error")
    assert f"its azimuths probably jumped by {angle_deg:+.1f}° at about 2018-08-01 08:0" in (
        found.sentence
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_a_jump_is_found_by_the_tracks_of_plots_without_identity(seed: int) -> None:
    numbers = recording(seed).frame["track_number"].to_numpy()
    found = jumped(recording(seed, named=False), 3.0).diagnosed(numbers)
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "azimuth_jump")]


def test_of_two_radars_at_two_sites_the_one_that_jumped_is_named() -> None:
    found = jumped(recording().only(NAME, "2-10"), 3.0).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "azimuth_jump")]


def test_a_steady_drift_is_no_jump() -> None:
    drift = (AZIMUTH + 6.0 * (TIME - START_S) / DURATION_S) % 360.0
    found = recording().changed(NAME, azimuth_deg=drift).diagnosed()
    assert "azimuth_jump" not in {one.code for one in found}


@pytest.mark.parametrize("aircraft", [4, 25])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_right_azimuths_and_a_small_jump_are_no_mistake(aircraft: int, seed: int) -> None:
    assert recording(seed, aircraft).diagnosed() == []
    noisy = np.random.default_rng(seed).normal(0.0, 0.1, len(recording(seed, aircraft).frame))
    one = recording(seed, aircraft)
    frame = one.frame.with_columns(azimuth_deg=(AZIMUTH + pl.Series(noisy)) % 360.0)
    found = jumped(replace(one, frame=frame), 0.4).diagnosed()
    assert "azimuth_jump" not in {two.code for two in found}


def test_the_site_of_a_radar_is_no_jump() -> None:
    found = recording().configured(NAME, latitude_deg=RADARS[NAME][0][0] + 0.03).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "site")]
