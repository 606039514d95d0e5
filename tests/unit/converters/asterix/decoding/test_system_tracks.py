"""Accuracies and heights of system tracks: items 062/500, 135 and 136."""

from pathlib import Path

import pytest

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.framing.containers import read_blocks
from support.asterix.octets import block, record

# 60 degrees north: 2/3 of the way to 90, in 180/2^25 degrees.
PLACE = (5, "00aaaaab 00000000")


def value_of(tmp_path: Path, column: str, *more: tuple[int, str]) -> float | None:
    items = [(1, "0a0b"), (4, "384000"), PLACE, (12, "0007"), (13, "00"), *more]
    path = tmp_path / "tracks.ast"
    path.write_bytes(block(62, record(*items)) * 3)
    ((_, table),) = gather(read_blocks(path), Editions()).tracks
    assert len(table) == 3
    (value,) = table[column].unique()
    assert value is None or isinstance(value, float)
    return value


@pytest.mark.parametrize(
    ("accuracies", "sigma_m"),
    [
        # APC: 30 m and 40 m in steps of 0.5 m; APW beside it is not used.
        ("80 003c 0050", 50.0),
        ("a0 003c 0050 0001 0001", 50.0),
        # APW: 0.6 m of latitude in a step, and half of that of longitude so far north.
        ("20 0064 00c8", 100.0 * 180.0 / 2**25 * 111_132.0 * 2.0**0.5),
        ("a0 0000 0000 0064 0000", 100.0 * 180.0 / 2**25 * 111_132.0),
        ("80 0000 0000", None),
        (None, None),
    ],
)
def test_the_accuracy_of_a_position_is_the_root_of_the_sum_of_both_variances(
    tmp_path: Path, accuracies: str | None, sigma_m: float | None
) -> None:
    items = [] if accuracies is None else [(27, accuracies)]
    found = value_of(tmp_path, "position_sigma_m", *items)
    assert found == (None if sigma_m is None else pytest.approx(sigma_m, rel=1e-5))


@pytest.mark.parametrize(
    ("items", "height_m"),
    [
        ([(17, "0078"), (19, "0080")], 30.0 * 30.48),
        ([(19, "0080")], 32.0 * 30.48),
        ([(19, "7ffc")], -30.48),
        # An altitude with QNH correction, 2375 ft, is none: negative ones too.
        ([(19, "805f")], None),
        ([(19, "fffc")], None),
        ([(17, "0078"), (19, "805f")], 30.0 * 30.48),
        ([], None),
    ],
)
def test_the_height_is_a_flight_level(
    tmp_path: Path, items: list[tuple[int, str]], height_m: float | None
) -> None:
    """Regression: an altitude with QNH correction was a flight level."""
    found = value_of(tmp_path, "height_m", *items)
    assert found == (None if height_m is None else pytest.approx(height_m))
