"""Mistakes in a recording of three radars are diagnosed at the right sensor."""

import re

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.diagnosis.cross_sensor.offsets import check_offsets
from multiradar.diagnosis.cross_sensor.registration import Registration
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.diagnosis.losses import check_repeated
from multiradar.diagnosis.plots import geodetic, located
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET
from multiradar.tracking.outputs import TrackPlots
from support.inputs.mistaken import (
    METRES_PER_DEGREE,
    RADARS,
    Edit,
    Recording,
    on_the_ground,
    recording,
)

RANGE, AZIMUTH, TIME, HEIGHT = (
    pl.col(name) for name in ("range_m", "azimuth_deg", "time_s", "height_m")
)
NAME = "1-10"
SITE = RADARS[NAME][0]


def biased(one: Recording, **bias: dict[str, float]) -> Recording:
    """Return a recording with biases of `NAME` in its sensors file."""
    return one.configured(NAME, bias=bias)


def addressed(one: Recording, **identity: str) -> Recording:
    """Return a recording without track numbers; the plots of `NAME` have an identity."""
    texts = {name: pl.lit(text) for name, text in identity.items()}
    empty = [pl.lit(None, pl.String).alias(name) for name in identity]
    numbers = one.frame["track_number"].cast(pl.String).alias("number")
    frame = one.frame.with_columns(numbers, *empty, track_number=pl.lit(None, pl.Int64))
    return Recording(frame, one.sensors).changed(NAME, **texts)


#: The mistake, and the code of the diagnosis of `NAME`.
MISTAKES: dict[str, tuple[Edit, str]] = {
    "kilometres": (lambda one: one.changed(NAME, range_m=RANGE / 1e3), "range_unit"),
    "nautical miles": (lambda one: one.changed(NAME, range_m=RANGE / 1852.0), "range_unit"),
    "feet": (lambda one: one.changed(NAME, range_m=RANGE / 0.3048), "range_unit"),
    "ground ranges": (lambda one: on_the_ground(one, NAME), "ground_ranges"),
    "site height in feet": (
        lambda one: one.configured(NAME, height_m=SITE[2] / 0.3048), "site_height",
    ),
    "site 1.1 km off": (
        lambda one: one.configured(NAME, latitude_deg=SITE[0] + 0.01), "site",
    ),
    "site 0.4 km off": (
        lambda one: one.configured(NAME, longitude_deg=SITE[1] + 0.005), "site",
    ),
    "ranges 2 % too long": (lambda one: one.changed(NAME, range_m=RANGE * 1.02), "range_gain"),
    "azimuths 1 % too small": (
        lambda one: one.changed(NAME, azimuth_deg=AZIMUTH * 0.99), "azimuth_scale",
    ),
    "361 counts for 360": (
        lambda one: one.changed(NAME, azimuth_deg=AZIMUTH * (360.0 / 361.0)), "azimuth_scale",
    ),
    "range offset of 180 m held at 0": (
        lambda one: biased(one, range_offset_m={"prior": 0.0, "prior_sigma": 1.0}), "bias",
    ),
    "range offset fixed at 1 km": (
        lambda one: biased(one, range_offset_m={"prior": 1000.0, "estimate": False}), "bias",
    ),
    "azimuth offset fixed": (
        lambda one: biased(one, azimuth_offset_deg={"prior": 0.5, "estimate": False}), "bias",
    ),
    "range offset with a narrow prior": (
        lambda one: biased(one, range_offset_m={"prior": -300.0, "prior_sigma": 20.0}), "bias",
    ),
    "one track number": (lambda one: one.changed(NAME, track_number=pl.lit(7)), "identity"),
    "one address": (lambda one: addressed(one, mode_s_address="4B1805"), "identity"),
    "one code": (lambda one: addressed(one, mode_3a="4321"), "identity"),
    "radians": (
        lambda one: one.changed(NAME, azimuth_deg=AZIMUTH * np.pi / 180.0), "azimuth_unit",
    ),
    "azimuth for height": (
        lambda one: one.changed(NAME, azimuth_deg=pl.col("height_m"), height_m=AZIMUTH),
        "columns_exchanged",
    ),
    "range for height": (
        lambda one: one.changed(NAME, range_m=pl.col("height_m"), height_m=pl.col("range_m")),
        "columns_exchanged",
    ),
    "revolutions": (lambda one: one.changed(NAME, azimuth_deg=AZIMUTH / 360.0), "azimuth_unit"),
    "gradians": (lambda one: one.changed(NAME, azimuth_deg=AZIMUTH / 0.9), "azimuth_unit"),
    "anticlockwise": (
        lambda one: one.changed(NAME, azimuth_deg=360.0 - AZIMUTH), "azimuth_anticlockwise",
    ),
    "off by 90 degrees": (
        lambda one: one.changed(NAME, azimuth_deg=(AZIMUTH + 90.0) % 360.0), "azimuth_offset",
    ),
    "magnetic north": (
        lambda one: one.changed(NAME, azimuth_deg=(AZIMUTH + 4.0) % 360.0), "azimuth_offset",
    ),
    "columns exchanged": (
        lambda one: one.changed(NAME, range_m=AZIMUTH, azimuth_deg=RANGE), "columns_exchanged",
    ),
    "site exchanged": (
        lambda one: one.configured(NAME, latitude_deg=SITE[1], longitude_deg=SITE[0]), "site",
    ),
    "site of the wrong sign": (
        lambda one: one.configured(NAME, longitude_deg=-SITE[1]), "site",
    ),
    "site off by 5 km": (
        lambda one: one.configured(NAME, latitude_deg=SITE[0] + 5000.0 / METRES_PER_DEGREE), "site",
    ),
    "site off by 60 km": (
        lambda one: one.configured(NAME, longitude_deg=SITE[1] + 0.8), "site",
    ),
    "heights in feet": (lambda one: one.changed(NAME, height_m=HEIGHT / 0.3048), "height_unit"),
    "flight levels": (lambda one: one.changed(NAME, height_m=HEIGHT / 30.48), "height_unit"),
    "units of 25 ft": (lambda one: one.changed(NAME, height_m=HEIGHT / 7.62), "height_unit"),
    "no heights, written as 0": (
        lambda one: one.changed(NAME, height_m=pl.lit(0.0)), "column_constant",
    ),
    "metres converted from feet": (
        lambda one: one.changed(NAME, height_m=HEIGHT * 0.3048), "height_unit",
    ),
    "hundreds of metres": (lambda one: one.changed(NAME, height_m=HEIGHT / 100.0), "height_unit"),
    "clock 3 s ahead": (lambda one: one.changed(NAME, time_s=TIME + 3.0), "clock"),
    "clock 2 s behind": (lambda one: one.changed(NAME, time_s=TIME - 2.0), "clock"),
    "clock 0.5 s ahead": (lambda one: one.changed(NAME, time_s=TIME + 0.5), "clock"),
    "whole degrees": (
        lambda one: one.changed(NAME, azimuth_deg=AZIMUTH.round() % 360.0), "resolution",
    ),
    "whole kilometres": (
        lambda one: one.changed(NAME, range_m=(RANGE / 1e3).round() * 1e3), "resolution",
    ),
    "azimuths from -180 to 180": (
        lambda one: one.changed(
            NAME, azimuth_deg=pl.when(AZIMUTH > 180.0).then(AZIMUTH - 360.0).otherwise(AZIMUTH)
        ),
        "azimuth_signed",
    ),
    "clock an hour ahead": (lambda one: one.changed(NAME, time_s=TIME + 3600.0), "times_apart"),
    "no date": (lambda one: one.changed(NAME, time_s=TIME % 86_400.0), "times_apart"),
    "scan period": (lambda one: one.configured(NAME, rotation_period_s=12.0), "rotation_period"),
    "range sigma": (lambda one: one.configured(NAME, range_sigma_m=4000.0), "noise"),
    "azimuth sigma": (lambda one: one.configured(NAME, azimuth_sigma_deg=6.0), "noise"),
    "kind": (
        lambda one: one.configured(
            NAME, kind="adsb", bias={}, latitude_deg=None, longitude_deg=None, height_m=None
        ),
        "kind",
    ),
    "instrumented range in kilometres": (
        lambda one: one.configured(NAME, range_max_m=1000.0), "range_max",
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("positions", "named"), [(False, True), (True, True), (True, False)])
def test_a_correct_recording_has_no_diagnosis(seed: int, *, positions: bool, named: bool) -> None:
    assert recording(seed, positions=positions, named=named).diagnosed() == []


# Every track is a candidate of each plot, and the positions by a wrong radar are left out.
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_wrong_radar_is_named_by_the_tracks_of_the_others(seed: int) -> None:
    numbers = recording(seed).frame["track_number"].to_numpy()
    turned = recording(seed, named=False).changed(NAME, azimuth_deg=(AZIMUTH + 180.0) % 360.0)
    assert [(one.sensor_id, one.code) for one in turned.diagnosed(numbers)] == [
        (NAME, "azimuth_offset")
    ]


@pytest.mark.parametrize("aircraft", [1, 2])
def test_one_identity_of_one_aircraft_or_two_is_no_mistake(aircraft: int) -> None:
    chosen = pl.col("number").cast(pl.Int64) < aircraft
    one = addressed(recording(), mode_s_address="4B1805", mode_3a="4321")
    few = Recording(one.frame.filter(chosen), one.sensors)
    assert few.codes() == []


# The true offsets of `NAME` are 180 m and −0.19°.
@pytest.mark.parametrize(
    "bias",
    [
        {
            "range_offset_m": {"prior": 180.0, "estimate": False},
            "azimuth_offset_deg": {"prior": -0.19, "estimate": False},
        },
        {"range_offset_m": {"prior": 0.0, "prior_sigma": 40.0}},
        {"range_offset_m": {"prior": 600.0, "prior_sigma": 200.0}},
        # A range offset and a gain cannot be distinguished.
        {"range_offset_m": {"prior": 1000.0, "estimate": False}, "range_gain": {"estimate": True}},
    ],
)
@pytest.mark.parametrize("others", [("2-10",), ("2-10", "3-10")])
def test_offsets_configured_about_right_are_no_mistake(
    bias: dict[str, dict[str, float]], others: tuple[str, ...]
) -> None:
    assert biased(recording(), **bias).only(NAME, *others).diagnosed() == []


def test_a_wrong_offset_is_reported_with_the_estimate_from_named_others() -> None:
    wrong = biased(recording(), range_offset_m={"prior": 1000.0, "estimate": False})
    said = wrong.diagnosed()[0].sentence
    assert said.startswith(
        "1-10: bias.range_offset_m is probably wrong: the sensors file specifies the fixed value "
        "1000 m (estimate = false), but 2-10, 3-10 indicate 1"
    )
    assert said.endswith(" m; correct prior, or remove estimate = false")
    alone = wrong.only(NAME, "2-10").diagnosed()[0].sentence
    assert "(or 2-10 is wrong; there is no third sensor to decide)" in alone


def test_one_radar_under_two_identifiers_is_named() -> None:
    one = recording()
    copied = one.frame.filter(sensor_id=NAME).with_columns(sensor_id=pl.lit("9-10"))
    again = one.sensors[0].model_copy(update={"id": "9-10"})
    both = Recording(pl.concat([one.frame, copied]).sort("time_s"), (*one.sensors, again))
    (said,) = both.diagnosed()
    assert (said.sensor_id, said.code) == ("9-10", "sensor_twice")
    assert f"100% of its plots are also plots of {NAME}, with the same times" in said.sentence


def test_one_address_is_not_taken_for_times_in_minutes() -> None:
    """Regression: plots of many aircraft with one address follow each other quickly."""
    one = addressed(recording(2, 18), mode_s_address="4B1805")
    assert one.codes() == [(NAME, "identity")]


def test_plots_without_an_azimuth_are_not_compared() -> None:
    """Regression: warnings of NumPy were shown."""
    every_second = pl.when(pl.int_range(pl.len()) % 2 == 0).then(AZIMUTH)
    (said,) = recording().changed(NAME, azimuth_deg=every_second).diagnosed()
    assert "azimuth_deg: missing; expected a value" in said.sentence


def test_negative_ranges_are_not_taken_for_a_wrong_height() -> None:
    (said,) = recording().changed(NAME, range_m=-RANGE).diagnosed()
    assert said.code == "measurements_lost"
    assert "range_m is negative (-" in said.sentence


@pytest.mark.parametrize(("copies", "known"), [(0.5, True), (0.2, False)])
def test_two_feeds_of_a_radar_are_named(copies: float, *, known: bool) -> None:
    evidence = Evidence(recording().table())
    evidence.record_rows(recording().frame)
    read = evidence.sources[NAME].read
    evidence.duplicates[NAME] = int(copies * read)
    said = check_repeated(evidence, NAME)
    assert (said is not None) == known
    if said is not None:
        assert said.code == "measurements_twice"
        assert said.severity == "warning"
        assert "in the recording twice, from two feeds: 50% repeat" in said.sentence
    evidence.renamed[NAME] = read // 2
    assert check_repeated(evidence, NAME) is None


# Pressure heights on a hot or a cold day: they resemble other site heights.
@pytest.mark.parametrize("factor", [0.85, 0.93, 1.07])
def test_heights_of_a_hot_or_a_cold_day_are_no_mistake_of_a_site(factor: float) -> None:
    assert recording().changed(*RADARS, height_m=HEIGHT * factor).diagnosed() == []


def test_ground_ranges_of_two_radars_are_named_at_both() -> None:
    one = on_the_ground(on_the_ground(recording(), NAME), "2-10")
    assert one.codes() == [(NAME, "ground_ranges"), ("2-10", "ground_ranges")]


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("positions", [False, True])
def test_a_mistake_of_one_radar_is_named(mistake: str, *, positions: bool) -> None:
    edit, code = MISTAKES[mistake]
    assert edit(recording(positions=positions)).codes() == [(NAME, code)]


@pytest.mark.parametrize("seed", [4, 5])
@pytest.mark.parametrize("mistake", ["kilometres", "off by 90 degrees", "clock 3 s ahead"])
def test_no_other_radar_is_diagnosed_with_few_aircraft(mistake: str, seed: int) -> None:
    edit, code = MISTAKES[mistake]
    assert edit(recording(seed, 12, positions=True)).codes() == [(NAME, code)]


def test_the_sentence_has_the_cause_its_support_and_what_to_do() -> None:
    one = recording().changed(NAME, range_m=RANGE / 1e3)
    sentence = one.diagnosed()[0].sentence
    mistake = "1-10: its ranges are probably in kilometres: with ranges interpreted as "
    assert sentence.startswith(mistake)
    support = re.search(r"(\d+)% of its plots lie where other sensors detect aircraft", sentence)
    assert support is not None
    assert int(support[1]) > 90
    assert sentence.endswith("; convert them to metres")


def test_the_site_that_is_found_is_the_true_one() -> None:
    far = recording().configured(NAME, longitude_deg=SITE[1] + 0.8)
    said = far.diagnosed()[0].sentence
    place = said.partition("with the site at ")[2].partition(", 1")[0]
    latitude, longitude = (float(text) for text in place.split(", ")[:2])
    # The biases of 180 m and 0.19° (330 m at 100 km) remain in it.
    assert latitude == pytest.approx(SITE[0], abs=800.0 / METRES_PER_DEGREE)
    assert longitude == pytest.approx(SITE[1], abs=1200.0 / METRES_PER_DEGREE)


def test_an_offset_of_the_clock_is_measured() -> None:
    said = recording().changed(NAME, time_s=TIME + 3.0).diagnosed()[0].sentence
    found = re.search(r"clock is probably ([\d.]+) s ahead", said)
    assert found is not None
    assert float(found[1]) == pytest.approx(3.0, abs=0.3)


@pytest.mark.parametrize("estimate", [True, False])
def test_an_offset_of_the_clock_that_is_configured_is_no_mistake(*, estimate: bool) -> None:
    late = recording().changed(NAME, time_s=TIME + 3.0)
    bias = {"time_offset_s": {"prior": 3.0, "estimate": estimate}}
    assert late.configured(NAME, bias=bias).diagnosed() == []


def test_an_offset_of_the_clock_that_is_configured_wrong_is_named() -> None:
    bias = {"time_offset_s": {"prior": 3.0, "estimate": False}}
    said = recording().configured(NAME, bias=bias).diagnosed()[0].sentence
    assert re.search(r"clock is probably (2\.[7-9]|3\.[0-3]) s behind", said) is not None
    assert said.endswith("correct its times, or bias.time_offset_s (3 s in the sensors file)")


def test_sites_of_two_radars_that_are_exchanged_are_both_named() -> None:
    other = RADARS["2-10"][0]
    one = recording()
    for name, site in ((NAME, other), ("2-10", SITE)):
        one = one.configured(name, latitude_deg=site[0], longitude_deg=site[1], height_m=site[2])
    said = {found.sensor_id: found.sentence for found in one.diagnosed()}
    assert "its site is probably the site of 2-10" in said[NAME]
    assert "its site is probably the site of 1-10" in said["2-10"]


def test_a_unit_that_all_radars_have_wrong_is_found_without_positions() -> None:
    one = recording().changed(*RADARS, range_m=RANGE / 1e3)
    assert one.codes() == [(name, "range_unit") for name in RADARS]


def test_two_radars_that_contradict_each_other_are_both_named_in_one_sentence() -> None:
    one = recording().only("1-10", "2-10").configured(NAME, longitude_deg=SITE[1] + 0.8)
    found = one.diagnosed()
    assert [said.code for said in found] == ["site"]
    assert "1-10 and 2-10 disagree" in found[0].sentence


@pytest.mark.parametrize("mistake", ["radians", "gradians", "anticlockwise", "kilometres"])
def test_a_radar_alone_shows_wrong_units(mistake: str) -> None:
    edit, code = MISTAKES[mistake]
    assert edit(recording().only(NAME)).codes() == [(NAME, code)]


def test_a_correct_radar_alone_has_no_diagnosis() -> None:
    assert recording().only(NAME).diagnosed() == []


def test_positions_computed_from_the_plots_are_not_used_for_the_noise() -> None:
    one = recording().only(NAME)
    columns = (one.frame[name].to_numpy() for name in ("range_m", "azimuth_deg", "height_m"))
    ranges, azimuths, heights = columns
    site = float(np.radians(SITE[0])), float(np.radians(SITE[1])), SITE[2]
    latitude, longitude, _ = geodetic(located(site, ranges, np.radians(azimuths), heights))
    made = one.frame.with_columns(
        latitude_deg=pl.Series(np.degrees(latitude)), longitude_deg=pl.Series(np.degrees(longitude))
    )
    assert Recording(made, one.sensors).diagnosed() == []


@pytest.mark.parametrize(("height_m", "why"), [(3.5, "in kilometres"), (250.0, "wrong")])
def test_a_wrong_site_height_is_reported(
    monkeypatch: pytest.MonkeyPatch, height_m: float, why: str
) -> None:
    monkeypatch.setitem(RADARS, NAME, ((*SITE[:2], 3500.0), *RADARS[NAME][1:]))
    on_a_mountain = recording.__wrapped__(1)
    assert on_a_mountain.diagnosed() == []
    (said,) = on_a_mountain.configured(NAME, height_m=height_m).diagnosed()
    assert said.code == "site_height_off"
    assert f"height_m of its site is probably {why}: it is {height_m:g} in" in said.sentence
    found = float(said.sentence.partition("with about ")[2].partition(" m")[0])
    assert found == pytest.approx(3500.0, abs=500.0)


def test_a_low_site_height_in_feet_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(RADARS, NAME, ((*SITE[:2], 310.0), *RADARS[NAME][1:]))
    low = recording.__wrapped__(2, 60)
    assert low.diagnosed() == []
    (said,) = low.configured(NAME, height_m=310.0 / 0.3048).diagnosed()
    assert (said.sensor_id, said.code) == (NAME, "site_height")
    assert "it is 1017.06 in the sensors file, but with 310 m" in said.sentence


@pytest.mark.parametrize(("offset_m", "count"), [(4900.0, 1), (5100.0, 0)])
def test_an_impossible_offset_is_not_reported(offset_m: float, count: int) -> None:
    found = Registration(offset=(offset_m, 0.0), offset_sigma=(10.0, 0.001))
    said = check_offsets(recording().table(), 0, found, ["2-10"])
    assert (said is not None) == bool(count)


@pytest.mark.parametrize("late_s", [0.5, -0.4])
def test_a_small_offset_of_the_clock_is_a_warning(late_s: float) -> None:
    (said,) = recording().changed(NAME, time_s=TIME + late_s).diagnosed()
    assert (said.sensor_id, said.code, said.severity) == (NAME, "clock", "warning")
    found = re.search(r"clock is probably ([\d.]+) s (ahead|behind)", said.sentence)
    assert found is not None
    assert float(found[1]) == pytest.approx(abs(late_s), abs=0.1)
    assert found[2] == ("ahead" if late_s > 0.0 else "behind")


def test_a_clock_that_is_estimated_has_no_warning() -> None:
    late = recording().changed(NAME, time_s=TIME + 0.5)
    bias = {"time_offset_s": {"prior": 0.0, "estimate": True}}
    assert late.configured(NAME, bias=bias).diagnosed() == []


def test_rounding_below_the_configured_sigma_is_no_mistake() -> None:
    one = recording().changed(NAME, azimuth_deg=AZIMUTH.round() % 360.0)
    assert one.configured(NAME, azimuth_sigma_deg=0.3).codes() == []


def turned(offsets_deg: tuple[float, ...], sigma_deg: float) -> list[tuple[str, str, str]]:
    """Return the diagnoses of a run that estimated these azimuth offsets of the radars."""
    evidence = Evidence(recording().table())
    evidence.confirmed = True
    for number, offset in enumerate(offsets_deg):
        estimate = float(np.radians(offset)), float(np.radians(sigma_deg))
        evidence.biases[number, PARAMETER_AZIMUTH_OFFSET] = estimate
    evidence.record_rows(recording().frame)
    measured, _ = wire.measurement_batch(recording().frame, evidence.sensors)
    evidence.record_plots(TrackPlots(measured.track_number, measured))
    return [(one.sensor_id, one.code, one.severity) for one in diagnose(evidence)]


def test_azimuths_of_all_radars_off_by_one_angle_are_named_at_all() -> None:
    found = turned((2.3, 2.7, 2.4), 0.01)
    assert found == [(name, "azimuth_offset", "error") for name in RADARS]


@pytest.mark.parametrize(
    ("offsets_deg", "sigma_deg", "large"),
    [((2.3, -2.7, 2.4), 0.01, (0, 1, 2)), ((0.9, 1.4, 1.2), 0.01, (1, 2)),
     ((1.1, 2.3, 1.2), 0.01, (0, 1, 2)), ((2.3, 2.7, 2.4), 0.4, ()), ((2.3,), 0.01, (0,))],
)  # fmt: skip
def test_other_azimuth_offsets_have_no_common_cause(
    offsets_deg: tuple[float, ...], sigma_deg: float, large: tuple[int, ...]
) -> None:
    # Each that is larger than radars are is a warning of its own.
    found = turned(offsets_deg, sigma_deg)
    assert found == [(list(RADARS)[number], "azimuth_offset", "warning") for number in large]


@pytest.mark.parametrize("offset_deg", [5.0, -90.0])
def test_azimuths_of_all_radars_are_compared_without_identity(offset_deg: float) -> None:
    numbers = recording().frame["track_number"].to_numpy()
    sensor = recording().frame["sensor_id"].str.slice(0, 1).cast(pl.Int64).to_numpy()
    one = recording(named=False).changed(*RADARS, azimuth_deg=(AZIMUTH + offset_deg) % 360.0)
    # No plot of one radar falls into a track of another.
    found = one.diagnosed(10 * numbers + sensor)
    assert [said.code for said in found] == ["azimuth_offset"] * 3
    assert f"off by about {offset_deg:+.0f}°, like those of all radars" in found[0].sentence


# Regression: the sentence of a live diagnosis alternated between two forms.
@pytest.mark.parametrize("offset_deg", [0.018, 0.05])
def test_small_and_large_errors_of_a_site_are_described_in_one_form(offset_deg: float) -> None:
    one = recording().configured(NAME, latitude_deg=SITE[0] + offset_deg)
    (said,) = one.diagnosed()
    found = re.search(
        r"probably ([\d.]+) km south of the configured site.*? at ([\d.]+), ([\d.]+)", said.sentence
    )
    assert found is not None
    assert float(found[1]) == pytest.approx(offset_deg * METRES_PER_DEGREE / 1e3, rel=0.1)
    assert float(found[2]) == pytest.approx(SITE[0], abs=0.006)
    assert float(found[3]) == pytest.approx(SITE[1], abs=0.006)
