"""Mode 3/A codes as decimal numbers, of which those with the digits 8 and 9 are rejected."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.single_sensor.codes import check_decimal_codes
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
