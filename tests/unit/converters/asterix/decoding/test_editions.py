"""Values that cannot be count against an edition, the bounds themselves do not."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.decoding import editions
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.catalogue import layouts_of
from support.asterix.octets import block, record
from support.asterix.surface_records import adsb_021_old


@pytest.mark.parametrize(
    ("category", "place", "text", "strange"),
    [
        # Times of day in 1/128 s.
        (48, 2, "a8bfff", 0),
        (48, 2, "a8c000", 1),
        # Latitudes in 180/2**25 degrees: 90° and the next ones.
        (20, 4, "01000000 00000000", 0),
        (20, 4, "01000001 00000000", 1),
        (20, 4, "ff000000 00000000", 0),
        (20, 4, "feffffff 00000000", 1),
    ],
)
def test_a_time_of_24_h_and_a_latitude_beyond_a_pole_cannot_be(
    tmp_path: Path, category: int, place: int, text: str, strange: int
) -> None:
    path = tmp_path / "one.ast"
    path.write_bytes(block(category, record((1, "1482"), (place, text))))
    layout = layouts_of(category)[0]
    assert editions._misfit(read_blocks(path), layout, np.array([0])) == (0, strange)


# Their items have other places and lengths in the other editions.
@pytest.mark.parametrize(
    ("option", "doubted"), [("021=2.4", True), ("0-107/021=0.26", True), ("021=0.23", False)]
)
def test_a_selected_edition_that_fits_less_than_another_is_doubted(
    tmp_path: Path, option: str, *, doubted: bool
) -> None:
    chosen = editions.parse_editions([option])
    path = tmp_path / "one.ast"
    path.write_bytes(
        b"".join(block(21, adsb_021_old(28_800.0 + number, "0108")) for number in range(4))
    )
    blocks = read_blocks(path)
    chosen.detect(blocks, editions.sources_of(blocks))
    assert list(chosen.found.values()) == list(chosen.chosen.values())
    said = "".join(chosen.doubtful.values())
    assert bool(said) == doubted
    if doubted:
        assert said.startswith(f"--edition {option}: 4 of 4 blocks do not match this edition, or")
        assert said.endswith("; edition 0.23 matches 4 of them; correct or omit the option")


def test_copies_share_layouts_and_are_extended_alone(tmp_path: Path) -> None:
    """Programs of copied layouts were kept forever, by each inspection again."""
    chosen = editions.parse_editions(["021=2.4"])
    path = tmp_path / "one.ast"
    path.write_bytes(block(21, adsb_021_old(28_800.0, "0108")))
    blocks = read_blocks(path)
    copied = chosen.copied()
    copied.detect(blocks, editions.sources_of(blocks))
    (used,) = copied.found.values()
    assert used is chosen.chosen[21, None]
    assert (chosen.found, chosen.misfits, chosen.doubtful) == ({}, {}, {})
