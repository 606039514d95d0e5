"""A site on another continent; radars of one place with two heights."""

import pytest

from multiradar.diagnosis.sites import check_sites
from support.inputs.mistaken import RADARS, recording


def test_sites_of_one_region_are_accepted() -> None:
    assert check_sites(recording().table()) is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"latitude_deg": -46.4}, "latitude_deg of its site probably has the wrong sign"),
        ({"longitude_deg": -122.0, "latitude_deg": 37.0}, "; correct latitude_deg and"),
    ],
)
def test_a_site_far_from_all_others_is_named(values: dict[str, float], words: str) -> None:
    said = check_sites(recording().configured("1-10", **values).table())
    assert said is not None
    assert said.startswith("1-10: its site (")
    assert words in said


def test_a_single_sensor_is_accepted() -> None:
    assert check_sites(recording().only("1-10").table()) is None
    assert len(RADARS) == 3


@pytest.mark.parametrize(("height_m", "accepted"), [(2400.0, False), (440.0, True)])
def test_radars_of_one_place_have_one_height(height_m: float, *, accepted: bool) -> None:
    latitude, longitude, _ = RADARS["2-10"][0]
    one = recording().configured("2-10", height_m=240.0)
    beside = {"latitude_deg": latitude + 0.001, "longitude_deg": longitude}
    said = check_sites(one.configured("1-10", **beside, height_m=height_m).table())
    if accepted:
        assert said is None
    else:
        assert said == (
            "1-10 and 2-10 are at the same position, but their height_m differs: 2400 and 240; "
            "correct the wrong value"
        )
