"""Columns, codes and identifiers that belong to other plots."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.model import Diagnosis
from support.inputs.mistaken import RADARS, Recording, recording

NAME, OTHERS = "2-10", ("1-10", "3-10")


def shifted(one: Recording, by: int, *columns: str) -> Recording:
    """Return a recording in which columns of a radar have the values of other rows."""
    own = pl.col("sensor_id") == NAME
    rows = one.frame.filter(own).with_columns(
        pl.col(columns).shift(by).fill_null(strategy="backward")
    )
    rest = one.frame.filter(~own)
    return Recording(pl.concat([rest, rows]).sort("time_s"), one.sensors)


@pytest.mark.parametrize(
    ("columns", "by", "words"),
    [
        (("range_m",), 1, "its ranges (range_m) probably belong to other rows: with those of the "
         "row after, "),
        (("azimuth_deg",), -2, "its azimuths (azimuth_deg) probably belong to other rows: with "
         "those of the 2 rows before, "),
        (("track_number",), 1, "the identities of its aircraft (track_number, mode_s_address, "
         "mode_3a) probably belong to other rows: with those of the row after, "),
    ],
)  # fmt: skip
@pytest.mark.parametrize("alone", [False, True])
def test_a_column_of_other_rows_is_named(
    columns: tuple[str, ...], by: int, words: str, *, alone: bool
) -> None:
    level = recording().changed(*RADARS, height_m=pl.lit(9000.0))
    one = shifted(level, by, *columns)
    found = (one.only(NAME, "1-10") if alone else one).diagnosed()
    (own,) = (one for one in found if one.sensor_id == NAME)
    assert (own.code, own.severity) == ("other_rows", "error")
    assert words in own.sentence
    assert all(one.sensor_id == NAME for one in found) or alone


def test_values_without_any_relation_are_reported_without_a_cause() -> None:
    rng = np.random.default_rng(3)
    one = recording()
    mixed = pl.Series("range_m", rng.permutation(one.frame["range_m"].to_numpy()))
    (found,) = one.changed(NAME, range_m=pl.lit(mixed)).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "other_rows")
    assert (
        "one of its columns (range, azimuth, time or identity) probably belongs" in found.sentence
    )


# Regression: with the sensors file of radars elsewhere that have the same names, nothing was said.
@pytest.mark.parametrize(
    ("column", "codes"), [("mode_s_address", [("1-10", "contradiction")]), ("mode_3a", [])]
)
def test_two_radars_that_contradict_each_other_are_reported(
    column: str, codes: list[tuple[str, str]]
) -> None:
    number = pl.col("track_number")
    names = {
        "mode_s_address": pl.format("4ca{}", number + 100),
        "mode_3a": pl.format("{}", number.map_elements(lambda one: f"{one + 512:04o}")),
    }
    one = recording().only("1-10", "2-10")
    frame = one.frame.with_columns(names[column].alias(column), track_number=pl.lit(None, pl.Int64))
    named = Recording(frame, one.sensors)
    assert named.codes() == []
    elsewhere = named.configured("2-10", latitude_deg=46.9, longitude_deg=7.6)
    turned = elsewhere.changed("2-10", azimuth_deg=(pl.col("azimuth_deg") + 30.0) % 360.0)
    assert turned.codes() == codes


def coded(seed: int = 1) -> Recording:
    """Return a recording whose aircraft have codes and no track numbers."""
    code = pl.col("track_number").map_elements(
        lambda number: f"{1303 + 37 * number:04o}", pl.String
    )
    one = recording(seed)
    return Recording(
        one.frame.with_columns(mode_3a=code, track_number=pl.lit(None, pl.Int64)), one.sensors
    )


def diagnosed(one: Recording, seed: int = 1) -> list[Diagnosis]:
    """Return the diagnoses where each track has the plots of one aircraft."""
    return one.diagnosed(recording(seed).frame["track_number"].to_numpy())


CODE = pl.col("mode_3a")
DECIMAL = CODE.str.to_integer(base=8).cast(pl.String).str.zfill(4)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (pl.when(~DECIMAL.str.contains("[89]")).then(DECIMAL), "probably decimal instead of"),
        (CODE.str.reverse(), "probably digits in reverse order"),
        (pl.lit("2000"), "all are 2000"),
        (CODE.sort(), "they are codes of other aircraft, and probably belong to other rows"),
    ],
)
def test_codes_that_are_not_those_of_the_same_tracks_are_named(code: pl.Expr, words: str) -> None:
    (found,) = diagnosed(coded().changed(NAME, mode_3a=code))
    assert (found.sensor_id, found.code) == (NAME, "codes")
    assert words in found.sentence


def test_codes_of_one_of_two_radars_are_named_with_both() -> None:
    one = coded()
    frame = one.frame.with_columns(
        mode_3a=pl.when(pl.col("sensor_id") == NAME).then(CODE.str.reverse()).otherwise(CODE)
    ).with_columns(mode_3a=pl.when(pl.col("sensor_id") != "3-10").then("mode_3a"))
    found = diagnosed(Recording(frame, one.sensors))
    assert [(one.sensor_id, one.code) for one in found] == [("1-10", "codes")]
    assert "differ from those of 2-10 for nearly all" in found[0].sentence
    assert "the codes of one of them" in found[0].sentence


@pytest.mark.parametrize("seed", [1, 2])
def test_right_codes_are_no_mistake(seed: int) -> None:
    assert diagnosed(coded(seed), seed) == []
    # A third of the plots of a radar is garbled.
    garbled = pl.when(pl.int_range(pl.len()) % 3 == 0).then(pl.lit("0042")).otherwise(CODE)
    assert diagnosed(coded(seed).changed(NAME, mode_3a=garbled), seed) == []


def divided(every: int, kept: int = 2) -> Recording:
    """Return a recording in which some scans of a radar come under another identifier."""
    one = recording()
    period_s = RADARS[NAME][1]
    scan = ((pl.col("time_s") - pl.col("time_s").min()) / period_s).floor().cast(pl.Int64)
    second = one.frame.filter((pl.col("sensor_id") == NAME) & (scan % every < kept - 1))
    kept_rows = one.frame.filter((pl.col("sensor_id") != NAME) | (scan % every >= kept - 1))
    again = one.sensors[1].model_copy(update={"id": "9-10"})
    frame = pl.concat([kept_rows, second.with_columns(sensor_id=pl.lit("9-10"))]).sort("time_s")
    return Recording(frame, (*one.sensors, again))


@pytest.mark.parametrize("every", [2, 4])
def test_one_radar_that_alternates_between_two_identifiers_is_named(every: int) -> None:
    (found,) = divided(every).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == ("9-10", "sensor_split", "warning")
    assert found.sentence.startswith("9-10 and 2-10 are at the same site and never detect an ")


def test_two_radars_on_one_antenna_are_no_mistake() -> None:
    """A primary and a secondary radar, each of which detects two thirds of the aircraft."""
    one = recording()
    index = pl.int_range(pl.len()).over("track_number")
    own = one.frame.filter(sensor_id=NAME)
    primary = own.filter(index % 3 != 0).with_columns(
        sensor_id=pl.lit("9-10"), range_m=pl.col("range_m") + 1.0
    )
    rest = one.frame.filter(pl.col("sensor_id") != NAME)
    again = one.sensors[1].model_copy(update={"id": "9-10"})
    frame = pl.concat([rest, own.filter(index % 3 != 1), primary]).sort("time_s")
    assert Recording(frame, (*one.sensors, again)).diagnosed() == []


@pytest.mark.parametrize("offset_m", [5000.0, -7000.0])
def test_a_range_offset_that_the_run_estimates_is_no_column_of_other_rows(offset_m: float) -> None:
    one = recording().changed(NAME, range_m=pl.col("range_m") + offset_m)
    assert one.diagnosed() == []


def scattered(one: Recording, share: float, seed: int = 3) -> Recording:
    """Return a recording in which some plots of `NAME` have the identity of another aircraft."""
    rng = np.random.default_rng(seed)
    numbers = one.frame["track_number"].to_numpy()
    other = rng.permutation(numbers)
    chosen = rng.uniform(size=len(numbers)) < share
    return one.changed(NAME, track_number=pl.lit(pl.Series(np.where(chosen, other, numbers))))


NUMBER = pl.col("track_number")


# Those of other aircraft, too, as each radar counts from one.
@pytest.mark.parametrize("number", [NUMBER + 1000, NUMBER + 7])
@pytest.mark.parametrize("level", [False, True])
def test_track_numbers_of_one_radar_are_named(number: pl.Expr, *, level: bool) -> None:
    one = recording().changed(NAME, track_number=number)
    one = one.changed(*RADARS, height_m=pl.lit(None)) if level else one
    (found,) = one.diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "track_numbers", "error")
    assert "are not those of 1-10, 3-10" in found.sentence or "1-10 and 3-10" in found.sentence


def test_track_numbers_of_each_radar_are_named() -> None:
    one = recording()
    for more, radar in enumerate(RADARS):
        one = one.changed(radar, track_number=NUMBER + 1000 * more)
    found = one.diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [
        (NAME, "track_numbers"), ("3-10", "track_numbers"),
    ]  # fmt: skip
    assert "are not those of 1-10 for the same" in found[0].sentence


# In whole or in part: the other radars do not agree, or they do with the rest.
@pytest.mark.parametrize("share", [0.05, 0.3, 0.6])
@pytest.mark.parametrize("alone", [False, True])
def test_identities_of_other_aircraft_are_named(share: float, *, alone: bool) -> None:
    one = scattered(recording(), share)
    (found,) = (one.only(NAME) if alone else one).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "other_rows", "error")
    assert "track_number probably belongs to other rows: " in found.sentence


def test_a_number_of_two_aircraft_is_no_mistake() -> None:
    one = recording()
    shared = pl.when(pl.col("track_number") == 1).then(0).otherwise(pl.col("track_number"))
    assert one.changed(*RADARS, track_number=shared).only(NAME).diagnosed() == []


# By two reflectors, in some of the scans: the reply comes later, from their direction.
@pytest.mark.parametrize(("share", "known"), [(0.3, True), (0.05, True), (0.005, False)])
def test_reflections_are_named(share: float, *, known: bool) -> None:
    one, rng = recording(), np.random.default_rng(5)
    own = one.frame.filter(sensor_id=NAME)
    own = own.filter(pl.Series(rng.uniform(size=len(own)) < share))
    towards = np.where(rng.uniform(size=len(own)) < 0.5, 40.0, 215.0)
    later_s = (towards - own["azimuth_deg"].to_numpy()) % 360.0 / 360.0 * RADARS[NAME][1]
    ghosts = own.with_columns(
        azimuth_deg=pl.Series(towards),
        range_m=pl.col("range_m") + pl.Series(rng.uniform(2e3, 9e3, len(own))),
        time_s=pl.col("time_s") + pl.Series(later_s),
    )
    both = Recording(pl.concat([one.frame, ghosts]).sort("time_s"), one.sensors)
    found = [(said.sensor_id, said.code, said.severity) for said in both.diagnosed()]
    assert found == ([(NAME, "reflections", "warning")] if known else [])


# Clutter or a wrong reply in place of the plot: on the path of no aircraft.
@pytest.mark.parametrize("share", [0.015, 0.05])
@pytest.mark.parametrize("alone", [False, True])
def test_gross_errors_of_single_plots_are_no_plots_of_other_rows(
    share: float, *, alone: bool
) -> None:
    one, rng = recording(), np.random.default_rng(6)
    wrong = (pl.col("sensor_id") == NAME) & pl.Series(rng.uniform(size=len(one.frame)) < share)
    error_m = pl.Series(rng.uniform(-40e3, 40e3, len(one.frame)))
    frame = one.frame.with_columns(
        range_m=pl.when(wrong)
        .then((pl.col("range_m") + error_m).abs() + 1e3)
        .otherwise(pl.col("range_m")),
        azimuth_deg=pl.when(wrong)
        .then((pl.col("azimuth_deg") + error_m / 2e3) % 360.0)
        .otherwise(pl.col("azimuth_deg")),
    )
    one = Recording(frame, one.sensors)
    assert (one.only(NAME) if alone else one).diagnosed() == []
