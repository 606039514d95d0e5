"""A site on another continent."""

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
