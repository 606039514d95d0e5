"""Values that cannot be count against an edition, the bounds themselves do not."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.decoding import editions
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.catalogue import layouts_of
from support.asterix.octets import block, record


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
