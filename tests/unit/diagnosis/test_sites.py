"""A site on another continent or off its place; radars of one place with two heights."""

from dataclasses import replace

import pytest

from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.sites import check_displaced, check_sites
from multiradar.tracking.health.health_records import ALARM_NOISE, ALARM_SITE
from support.fakes.engine_outputs import output_of
from support.fakes.health import health_records
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
@pytest.mark.fault(13)
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


def test_a_site_that_raises_its_alarm_until_the_end_is_named() -> None:
    """Regression: plots without identity among clutter are not compared, and it was silent."""
    evidence = Evidence(recording().table())
    evidence.record_rows(recording().frame)
    alarms = [1 << ALARM_SITE, 1 << ALARM_SITE, 1 << ALARM_NOISE, 1 << ALARM_SITE | 1]
    records = health_records(
        sensor=[0, 1, 0, 1], alarms=alarms, site_east_m=[300.0] * 4, site_north_m=[-400.0] * 4
    )
    evidence.record_output(replace(output_of([]), health=records))
    assert check_displaced(evidence, "1-10") is None
    said = check_displaced(evidence, "2-10")
    assert said is not None
    assert (said.code, said.severity) == ("site", "warning")
    assert said.sentence.startswith("2-10: its site is probably wrong, by at least 0.50 km: its pl")
    alone = Evidence(recording().only("2-10").table())
    alone.displaced["2-10"] = 500.0
    assert check_displaced(alone, "2-10") is None
