"""Bounding boxes at their limits: validity and membership."""

import polars as pl
import pytest

from multiradar.api.selection import bounding_box, inside
from multiradar.errors import RequestError

PLACES = pl.DataFrame(
    {"longitude_deg": [-180.0, -1.0, 0.0, 1.0, 180.0], "latitude_deg": [-90.0, 0.0, 0.0, 0.0, 90.0]}
)


@pytest.mark.parametrize(
    ("box", "longitudes"),
    [
        ("-180,-90,180,90", [-180.0, -1.0, 0.0, 1.0, 180.0]),
        ("-1,0,1,0", [-1.0, 0.0, 1.0]),
        ("0,0,0,0", [0.0]),
        ("1,-90,-1,90", [-180.0, -1.0, 1.0, 180.0]),
        ("-180,90,180,90", [180.0]),
    ],
)
def test_edges_belong_to_a_box_also_one_without_area(box: str, longitudes: list[float]) -> None:
    assert PLACES.filter(inside(bounding_box(box)))["longitude_deg"].to_list() == longitudes


@pytest.mark.parametrize(
    "box",
    [
        "-180.0001,0,0,1", "0,0,180.0001,1", "0,-90.0001,1,0", "0,0,1,90.0001", "0,1,1,0.9999",
        "180.0001,0,0,1", "0,0,-180.0001,1", "0,0,1", "0,0,1,1,1", "",
    ],
)  # fmt: skip
def test_an_invalid_box_is_rejected(box: str) -> None:
    with pytest.raises(RequestError):
        bounding_box(box)
