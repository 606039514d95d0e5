"""Addresses and track numbers in another form, or of other rows."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from support.inputs.mistaken import Recording, recording, with_reports

NAME, OTHERS = "1-10", ("2-10", "3-10")


def addressed(of: dict[str, list[int]] | None = None, *, numbered: bool = False) -> Recording:
    """Return a recording with addresses, and others for some sensors."""
    one = recording()
    known = np.random.default_rng(5).integers(0x400000, 0x4FFFFF, 25).tolist()
    by_sensor = {name: (of or {}).get(name, known) for name in (NAME, *OTHERS)}
    rows = zip(one.frame["sensor_id"], one.frame["track_number"], strict=True)
    texts = [f"{by_sensor[name][number]:06X}" for name, number in rows]
    frame = one.frame.with_columns(pl.Series("mode_s_address", texts))
    if not numbered:
        frame = frame.with_columns(track_number=pl.lit(None, pl.Int64))
    return replace(one, frame=frame)


KNOWN = np.random.default_rng(5).integers(0x400000, 0x4FFFFF, 25).tolist()


@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ([int.from_bytes(one.to_bytes(3, "little"), "big") for one in KNOWN],
         "with their octets in reverse order"),
        ([int(f"{one:024b}"[::-1], 2) for one in KNOWN], "with their bits in reverse order"),
        ([int(str(one)[-6:], 16) for one in KNOWN], "decimal instead of hexadecimal numbers"),
        ([one << 4 & 0xFFFFFF for one in KNOWN], "shifted by a digit"),
        ([one + 1 for one in KNOWN], "all 1 too large"),
        ([one % 65_536 for one in KNOWN], "truncated (modulo 65536)"),
        ([one >> 4 for one in KNOWN], "without their last digit"),
        ([(7919 * one) % (1 << 24) for one in KNOWN], "of other aircraft or in another form"),
    ],
)  # fmt: skip
def test_addresses_of_one_radar_in_another_form_are_named(
    wrong: list[int], words: str, *, numbered: bool
) -> None:
    (found,) = addressed({NAME: wrong}, numbered=numbered).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "addresses", "error")
    assert words in found.sentence


def test_addresses_of_two_radars_do_not_show_which_are_wrong() -> None:
    (found,) = addressed({NAME: [one + 1 for one in KNOWN]}).only(NAME, "2-10").diagnosed()
    assert found.code == "addresses"
    assert "(or those of 1-10 are wrong)" in found.sentence


def test_right_addresses_are_no_mistake() -> None:
    assert addressed(numbered=True).codes() == []


@pytest.mark.parametrize("alone", [True, False])
def test_plot_numbers_are_no_track_numbers(*, alone: bool) -> None:
    """Regression: an internal error beside ADS-B, and nothing was said without."""
    one = with_reports(recording(positions=True))
    one = one.only(NAME) if alone else one
    names = (NAME,) if alone else (NAME, *OTHERS)
    found = one.changed(*names, track_number=pl.int_range(pl.len())).diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [
        (name, "track_numbers") for name in names
    ]
    assert "are probably the numbers of its plots" in found[0].sentence


def test_one_scan_has_one_plot_of_each_track_number() -> None:
    one = recording(1, 150).only(NAME)
    scan = one.frame.filter(pl.int_range(pl.len()).over("track_number") < 1)
    found = replace(one, frame=scan).diagnosed()
    assert "track_numbers" not in [said.code for said in found]


def test_a_number_of_few_plots_each_is_a_track_number() -> None:
    one = recording(1, 60).only(NAME)
    # A radar that sees each aircraft twice.
    first = one.frame.filter(pl.int_range(pl.len()).over("track_number") < 2)
    found = replace(one, frame=first).diagnosed()
    assert "track_numbers" not in [said.code for said in found]


def test_truncated_track_numbers_are_named() -> None:
    one = recording()
    number = 2000 + 301 * pl.col("track_number")
    frame = one.frame.with_columns(
        track_number=pl.when(sensor_id=NAME).then(number % 4096).otherwise(number)
    )
    (found,) = replace(one, frame=frame).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "track_numbers")
    assert "truncated (modulo 4096)" in found.sentence
