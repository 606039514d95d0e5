"""Sites of which one is on another continent."""

import pytest

from multiradar.diagnosis.sites import site_apart
from support.inputs.mistaken import RADARS, recording


def test_sites_of_one_region_are_not_apart() -> None:
    assert site_apart(recording().table()) is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"latitude_deg": -46.4}, "latitude_deg of its site probably has the wrong sign"),
        ({"longitude_deg": -122.0, "latitude_deg": 37.0}, "; correct latitude_deg and"),
    ],
)
def test_a_site_far_from_all_others_is_named(values: dict[str, float], words: str) -> None:
    said = site_apart(recording().configured("1-10", **values).table())
    assert said is not None
    assert said.startswith("1-10: its site (")
    assert words in said


def test_a_sensor_alone_is_not_apart() -> None:
    assert site_apart(recording().only("1-10").table()) is None
    assert len(RADARS) == 3
