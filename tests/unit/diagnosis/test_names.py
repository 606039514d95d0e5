"""Unconfigured sources, and configured sensors without measurements."""

import polars as pl
import pytest

from support.inputs.mistaken import RADARS, Recording, recording


def test_an_unknown_source_is_named_with_its_count_and_the_likely_sensor() -> None:
    one = recording().configured("2-10", id="12-10")
    count = f"{len(one.frame.filter(sensor_id='2-10')):,}".replace(",", " ")
    found = one.diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [("2-10", "unknown_source")]
    assert found[0].sentence == (
        f"2-10 ({count} plots) is not in the sensors file (sensors.toml); the recording has no "
        "measurements of 12-10 in that file; did you mean 2-10 instead of 12-10?"
    )


def test_several_wrong_numbers_are_matched_by_similarity() -> None:
    one = recording().configured("2-10", id="22-10").configured("3-10", id="33-10")
    said = {found.sensor_id: found.sentence for found in one.diagnosed()}
    assert "did you mean 2-10 instead of 22-10" in said["2-10"]
    assert "did you mean 3-10 instead of 33-10" in said["3-10"]


def test_an_unknown_source_without_a_silent_sensor_is_to_be_added() -> None:
    one = recording()
    fewer = Recording(one.frame, one.sensors[:2])
    assert fewer.codes() == [("3-10", "unknown_source")]
    assert "add it, or remove its measurements" in fewer.diagnosed()[0].sentence


def test_a_sensors_file_without_any_recorded_sensor_is_of_another_recording() -> None:
    one = recording()
    for number, name in enumerate(RADARS):
        one = one.configured(name, id=f"9{number}-1")
    found = one.diagnosed()
    assert found[0].code == "sensors_of_another_recording"
    assert (
        "the measurements are from 1-10, 2-10, 3-10, the file contains 90-1, 91-1, 92-1"
        in found[0].sentence
    )


def test_a_silent_radar_is_reported_and_silent_adsb_is_not() -> None:
    one = recording()
    fewer = Recording(one.frame.filter(pl.col("sensor_id") != "3-10"), one.sensors)
    adsb = one.sensors[0].model_validate({"id": "adsb", "kind": "adsb"})
    with_adsb = Recording(fewer.frame, (*one.sensors, adsb))
    assert with_adsb.codes() == [("3-10", "no_measurements")]


def positions_of(one: Recording, name: str, kind: str) -> pl.DataFrame:
    """Return measurements of a kind of positions under a name."""
    return one.frame.filter(sensor_id="2-10").with_columns(
        sensor_id=pl.lit(name), kind=pl.lit(kind), latitude_deg=pl.lit(46.5),
        longitude_deg=pl.lit(7.0), range_m=pl.lit(None, pl.Float64),
        azimuth_deg=pl.lit(None, pl.Float64),
    )  # fmt: skip


def test_a_source_of_another_kind_is_not_matched_to_a_silent_radar() -> None:
    one = recording()
    wam = positions_of(one, "3-11", "mlat")
    frame = pl.concat([one.frame.filter(pl.col("sensor_id") != "3-10"), wam]).sort("time_s")
    said = {found.sensor_id: found for found in Recording(frame, one.sensors).diagnosed()}
    assert {name: found.code for name, found in said.items()} == {
        "3-11": "unknown_source",
        "3-10": "no_measurements",
    }
    assert said["3-11"].sentence.endswith(
        "is not in the sensors file (sensors.toml); add it, or remove its measurements"
    )


def test_a_radar_under_the_id_of_adsb_is_reported_with_both_ids() -> None:
    one = recording()
    frame = pl.concat([one.frame, positions_of(one, "adsb", "adsb")]).sort("time_s")
    found = Recording(frame, one.configured("3-10", id="adsb").sensors).diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [("adsb", "kind")]
    assert found[0].sentence.startswith(
        "adsb: the sensors file declares a radar under this id, but its measurements are of "
        "kind adsb, and the plots of 3-10 ("
    )
    assert found[0].sentence.endswith('declare the radar as 3-10, and adsb with kind = "adsb"')


def test_two_radars_under_one_identifier_are_named_with_their_scan_periods() -> None:
    one = recording()
    name = pl.col("sensor_id")
    mixed = Recording(one.frame.with_columns(sensor_id=name.replace({"2-10": "1-10"})), one.sensors)
    said, silent = sorted(mixed.diagnosed(), key=lambda found: found.sensor_id)
    assert (said.sensor_id, said.code) == ("1-10", "two_radars")
    assert "in 4.00 s, the others in 4.90 s; give each radar its own identifier" in said.sentence
    assert (silent.sensor_id, silent.code) == ("2-10", "no_measurements")


def test_the_losses_of_a_radar_are_reported_beside_a_sensor_without_measurements() -> None:
    """Regression: a sensor without measurements hid what was lost of the others."""
    half = pl.when(pl.int_range(pl.len()) % 2 == 0).then(pl.col("azimuth_deg"))
    one = recording().changed("1-10", azimuth_deg=half)
    silent = one.sensors[0].model_copy(update={"id": "9-10"})
    found = Recording(one.frame, (*one.sensors, silent)).codes()
    assert found == [("9-10", "no_measurements"), ("1-10", "measurements_lost")]


@pytest.mark.slow
def test_a_source_name_of_any_length_is_quoted_in_short_and_printable_form() -> None:
    one = recording()
    name = "\x1b[31m\n" + "x" * 100_000
    hostile = one.frame.with_columns(
        sensor_id=pl.when(pl.col("sensor_id") == "3-10")
        .then(pl.lit(name))
        .otherwise(pl.col("sensor_id"))
    )
    (said,) = Recording(hostile, one.sensors[:2]).diagnosed()
    assert said.code == "unknown_source"
    assert said.sentence.isprintable()
    assert len(said.sentence) < 300


@pytest.mark.parametrize(
    ("spelt", "what"), [("2-10 ", "by spaces only"), (" 2-10\t", "by spaces only")]
)
@pytest.mark.parametrize("every", [True, False])
def test_spaces_about_the_name_of_a_sensor_are_named(spelt: str, what: str, *, every: bool) -> None:
    one = recording()
    name = pl.col("sensor_id")
    other = name + " " if every else name
    frame = one.frame.with_columns(
        sensor_id=pl.when(name == "2-10").then(pl.lit(spelt)).otherwise(other)
    )
    found = {said.sensor_id: said for said in Recording(frame, one.sensors).diagnosed()}
    assert [*found] == ([*RADARS] if every else ["2-10"])
    assert found["2-10"].code == "unknown_source"
    assert f"measurements is {spelt!a}, which differs" in found["2-10"].sentence
    assert what in found["2-10"].sentence


def test_upper_and_lower_case_of_the_name_of_a_sensor_are_named() -> None:
    one = recording().configured("2-10", id="North")
    frame = one.frame.with_columns(pl.col("sensor_id").replace({"2-10": "NORTH"}))
    (found,) = Recording(frame, one.sensors).diagnosed()
    assert (found.sensor_id, found.code) == ("North", "unknown_source")
    assert "is NORTH, which differs from that of the sensors file by upper and lower case only" in (
        found.sentence
    )
