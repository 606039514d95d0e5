"""Recordings with missing rows, placeholders for codes, or a range limit that removes plots."""

from collections import Counter
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.losses import Losses, check_range_constant, check_range_max
from multiradar.diagnosis.model import Diagnosis
from support.inputs.mistaken import RADARS, Recording, recording

NAME = "1-10"


def thinned(every: int, *names: str) -> Recording:
    """Return a recording with one in so many rows of some radars."""
    # A number of aircraft that has no factor in common: otherwise some are seen more often.
    one = recording(aircraft=23)
    row = pl.int_range(pl.len()).over("sensor_id")
    kept = ~pl.col("sensor_id").is_in(names) | (row % every == 0)
    return replace(one, frame=one.frame.filter(kept))


@pytest.mark.parametrize("every", [6, 10])
def test_a_recording_of_which_most_rows_are_missing_is_named(every: int) -> None:
    found = thinned(every, *RADARS).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [
        (name, "plots_missing") for name in RADARS
    ]
    assert all("rows are probably missing from the recording" in one.sentence for one in found)


def test_the_radar_whose_rows_are_missing_is_named_with_its_period() -> None:
    (found,) = thinned(10, NAME).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "plots_missing", "error")
    assert "(of 4.9 s by " in found.sentence


@pytest.mark.parametrize("aircraft", [3, 25])
def test_a_radar_that_detects_half_of_the_aircraft_lacks_no_rows(aircraft: int) -> None:
    one = recording(aircraft=aircraft)
    detected = np.random.default_rng(1).random(len(one.frame)) < 0.5
    assert replace(one, frame=one.frame.filter(pl.Series(detected))).diagnosed() == []


def coded(code: str, *, height_m: float | None, addressed: bool) -> list[Diagnosis]:
    """Return the diagnoses of a recording in which all plots have one code."""
    one = recording()
    number = pl.col("track_number")
    address = pl.format("4B18{}", (number + 16).cast(pl.String).str.zfill(2))
    frame = one.frame.with_columns(
        mode_3a=pl.lit(code),
        mode_s_address=address if addressed else pl.lit(None, pl.String),
        height_m=pl.lit(height_m, pl.Float64) if height_m is None else height_m + 25.0 * number,
    )
    return replace(one, frame=frame).diagnosed()


@pytest.mark.parametrize("code", ["7000", "2000", "0000"])
@pytest.mark.parametrize("addressed", [True, False])
def test_one_code_of_all_high_aircraft_is_a_placeholder(code: str, *, addressed: bool) -> None:
    found = coded(code, height_m=9000.0, addressed=addressed)
    assert [(one.sensor_id, one.code) for one in found] == [(name, "identity") for name in RADARS]
    assert {one.severity for one in found} == {"warning" if addressed else "error"}
    assert f"mode_3a is probably a placeholder: the value is {code}" in found[0].sentence


# Low flights may all be under visual flight rules, and all aircraft with Mode S may have 1000.
@pytest.mark.parametrize(("code", "height_m"), [("7000", 4500.0), ("1000", 9000.0)])
def test_a_code_that_all_aircraft_may_have_is_no_placeholder(code: str, height_m: float) -> None:
    assert coded(code, height_m=height_m, addressed=True) == []


@pytest.mark.parametrize("in_metres", [True, False])
def test_a_range_limit_that_removes_plots_is_too_small(*, in_metres: bool) -> None:
    evidence = Evidence(recording().configured(NAME, range_max_m=100_000.0).table())
    evidence.record_rows(recording().frame)
    losses = Losses(100, Counter(OUT_OF_RANGE=60), 0)
    found = check_range_max(evidence, NAME, losses, in_metres=in_metres)
    assert found is not None
    assert ("in feet" in found.sentence) == (not in_metres)
    if in_metres:
        assert "range_max_m is probably too small: it is 100000" in found.sentence
        assert "% of the plots are farther away, up to " in found.sentence


@pytest.mark.parametrize("added_m", [400_000.0, 0.0])
def test_a_constant_in_the_ranges_is_named(added_m: float) -> None:
    end_m = 390_000.0 if added_m else 100_000.0
    one = recording().changed(NAME, range_m=pl.col("range_m") + added_m)
    evidence = Evidence(one.configured(NAME, range_max_m=end_m).table())
    evidence.record_rows(one.frame)
    found = check_range_constant(evidence, NAME, Losses(100, Counter(OUT_OF_RANGE=60), 0))
    assert (found is not None) == (added_m > 0.0)
    assert found is None or "probably contain a constant of up to 4" in found.sentence


@pytest.mark.parametrize("names", [(NAME,), tuple(RADARS)])
@pytest.mark.parametrize("origin", ["east", "north"])
def test_the_direction_from_which_azimuths_are_anticlockwise_is_named(
    names: tuple[str, ...], origin: str
) -> None:
    turn = {"east": 450.0, "north": 360.0}[origin]
    found = recording().changed(*names, azimuth_deg=(turn - pl.col("azimuth_deg")) % 360.0)
    diagnosed = found.diagnosed()
    assert [one.sensor_id for one in diagnosed] == [*names]
    assert {one.code for one in diagnosed} == {"azimuth_anticlockwise"}
    assert f"measured anticlockwise from {origin} (" in diagnosed[0].sentence
    assert ("mathematical convention" in diagnosed[0].sentence) == (origin == "east")


def test_an_antenna_that_rotates_anticlockwise_is_no_mistake() -> None:
    """Regression: its azimuths are those of the aircraft that other radars detect."""
    one = recording(anticlockwise=(NAME,))
    assert one.diagnosed() == []
    # It is examined as others are, and so are azimuths that advance with the antenna.
    feet = one.changed(NAME, height_m=pl.col("height_m") / 0.3048)
    assert [(two.sensor_id, two.code) for two in feet.diagnosed()] == [(NAME, "height_unit")]
    (found,) = one.changed(NAME, azimuth_deg=(360.0 - pl.col("azimuth_deg")) % 360.0).diagnosed()
    assert found.sensor_id == NAME
    assert "anticlockwise" in found.sentence


def test_a_radar_alone_shows_no_direction() -> None:
    one = recording().only(NAME)
    (found,) = one.changed(NAME, azimuth_deg=(450.0 - pl.col("azimuth_deg")) % 360.0).diagnosed()
    assert "if they are angles from east, as in mathematics" in found.sentence


def test_rejected_rows_are_not_missing() -> None:
    """Half of the azimuths are missing, at random, of a radar that identifies its aircraft."""
    address = pl.format("4B18{}", (pl.col("track_number") + 16).cast(pl.String))
    one = recording()
    one = replace(one, frame=one.frame.with_columns(mode_s_address=address))
    half = pl.Series(np.random.default_rng(2).random(len(one.frame)) < 0.5)
    some = one.changed(NAME, azimuth_deg=pl.when(half).then(pl.col("azimuth_deg")))
    (found,) = some.diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "measurements_lost")
    assert "azimuth_deg: missing" in found.sentence
    assert found.sentence.endswith("; fill it, or remove these rows")


def test_a_prefix_of_addresses_is_named() -> None:
    address = pl.format("0x4B18{}", (pl.col("track_number") + 16).cast(pl.String))
    one = recording()
    own = pl.when(pl.col("sensor_id") == NAME).then(address)
    (found,) = replace(one, frame=one.frame.with_columns(mode_s_address=own)).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "measurements_lost")
    assert "mode_s_address has the prefix 0x; write its six hexadecimal digits" in found.sentence
