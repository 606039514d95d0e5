"""Mode 3/A codes as decimal numbers, of which those with the digits 8 and 9 are rejected."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.single_sensor.codes import check_decimal_codes
from multiradar.diagnosis.single_sensor.columns import check_codes
from support.inputs.mistaken import recording

RNG = np.random.default_rng(1)
CODES = RNG.integers(0, 4096, 500).tolist()


def test_decimal_codes_are_named_as_such() -> None:
    one = recording()
    code = pl.col("track_number") * 17 + 1000
    decimal = pl.format("{}", code).str.zfill(4)
    frame = one.frame.with_columns(mode_3a=decimal)
    found = [said for said in type(one)(frame, one.sensors).diagnosed() if said.code == "codes"]
    assert [said.sensor_id for said in found] == ["1-10", "2-10", "3-10"]
    assert "are probably decimal numbers" in found[0].sentence
    assert "have the digits 8 or 9" in found[0].sentence


@pytest.mark.parametrize("width", [0, 4])
def test_decimal_codes_with_and_without_leading_zeros(width: int) -> None:
    found = check_decimal_codes("1-10", pl.Series([str(one).zfill(width) for one in CODES]))
    assert found is not None


@pytest.mark.parametrize(
    "codes",
    [
        [f"{one:04o}" for one in CODES],
        # One code in a hundred has a wrong digit.
        [f"{one:04o}" for one in CODES[:495]] + ["1829"] * 5,
        # Not numbers of 12 bits: another mistake.
        [f"{2 * one + 1:04d}" for one in CODES],
        [f"{one:04x}" for one in CODES],
        [None] * 100,
        ["0819"] * 3,
    ],
)
def test_other_codes_are_not_decimal(codes: list[str | None]) -> None:
    assert check_decimal_codes("1-10", pl.Series(codes, dtype=pl.String)) is None


def test_codes_of_the_other_radar_are_not_blamed_beside_decimal_ones() -> None:
    """Regression: the right codes of the other radar were said to be in another form, too."""
    one = recording().only("1-10", "2-10")
    number = pl.col("track_number")
    octal = number.map_elements(lambda x: f"{x * 17 + 1000:04o}", pl.String)
    decimal = pl.format("{}", number * 17 + 1000).str.zfill(4)
    coded = one.frame.with_columns(
        mode_3a=pl.when(pl.col("sensor_id") == "1-10").then(octal).otherwise(decimal)
    )
    valid = ~coded["mode_3a"].str.contains("[89]")
    tracks = coded["track_number"].filter(valid).to_numpy()
    frame = coded.with_columns(track_number=pl.lit(None, pl.Int64))
    found = type(one)(frame, one.sensors).diagnosed(tracks)
    assert [said.sensor_id for said in found if said.code == "codes"] == ["2-10"]


def _found(*of_sensors: list[int], plots: int = 3) -> list[Diagnosis]:
    """Return what is found of the codes of each sensor by track."""
    rows = [
        (track, sensor, code)
        for sensor, codes in enumerate(of_sensors)
        for track, code in enumerate(codes)
        for _ in range(plots)
    ]
    track, sensor, code = (np.array(one, np.int64) for one in zip(*rows, strict=True))
    measured = SimpleNamespace(sensor=sensor, mode_3a=code)
    evidence: Any = SimpleNamespace(
        sensors=SimpleNamespace(ids=("1-10", "2-10", "3-10", "4-10")),
        tracked=lambda: SimpleNamespace(track_id=track, measured=measured),
    )
    return check_codes(evidence, ())


def _codes(*of_sensors: list[int], plots: int = 3) -> dict[str, str]:
    """Return what the codes of each sensor differ from."""
    found = _found(*of_sensors, plots=plots)
    words = (one.sentence.partition(" differ from ")[2].partition(" for ")[0] for one in found)
    return dict(zip((one.sensor_id for one in found), words, strict=True))


RIGHT = [0o4321 + one for one in range(8)]
WRONG = [0o2001 + one for one in range(8)]
OTHER = [0o6001 + one for one in range(8)]
OF_OTHERS = {"3-10": "those of the other sensors"}


@pytest.mark.parametrize(
    ("found", "named"),
    [
        (_codes(RIGHT, RIGHT, WRONG), OF_OTHERS),
        (_codes(RIGHT[:7], RIGHT[:7], WRONG[:7]), {}),
        (_codes(RIGHT, RIGHT, WRONG, plots=2), {}),
        # A quarter of the codes may be equal.
        (_codes(RIGHT, RIGHT, RIGHT[:2] + WRONG[2:]), OF_OTHERS),
        (_codes(RIGHT, RIGHT, RIGHT[:3] + WRONG[3:]), {}),
        # Of right codes more than three quarters are; none are right otherwise.
        (_codes(RIGHT, RIGHT[:7] + OTHER[7:], WRONG), OF_OTHERS),
        (_codes(RIGHT, RIGHT[:6] + OTHER[6:], WRONG), {}),
        # Of two either may be wrong; three that all differ show nothing.
        (_codes(RIGHT, WRONG), {"1-10": "those of 2-10"}),
        (_codes(RIGHT, WRONG, OTHER), {}),
        (_codes(RIGHT, RIGHT, WRONG, OTHER), OF_OTHERS | {"4-10": "those of the other sensors"}),
        # Codes of conspicuity show nothing.
        (_codes([0o7000] * 8, WRONG), {}),
    ],
)
def test_codes_differ_from_their_bounds_on(found: dict[str, str], named: dict[str, str]) -> None:
    assert found == named


@pytest.mark.parametrize(
    ("own", "cause"),
    [
        (WRONG, "they are probably in another form"),
        ([0o7777] * 8, "all are 7777"),
        # Five of eight.
        ([one % 2048 for one in RIGHT[:5]] + WRONG[5:], "truncated (modulo 2048, of 4096 codes)"),
        ([one % 2048 for one in RIGHT[:4]] + WRONG[4:], "they are probably in another form"),
        (RIGHT[1:6] + WRONG[5:], "they are codes of other aircraft, and"),
        (RIGHT[1:5] + WRONG[4:], "they are probably in another form"),
    ],
)
def test_the_form_of_most_wrong_codes_is_named(own: list[int], cause: str) -> None:
    (found,) = _found(RIGHT, RIGHT, own)
    assert f"common tracks: {cause}" in found.sentence.replace(": probably ", ": ")
