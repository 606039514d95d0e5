"""Two radars that contradict each other: errors of both, and exchanged sites."""

import polars as pl
import pytest

from support.inputs.mistaken import RADARS, Recording, recording, with_reports

AZIMUTH, RANGE = pl.col("azimuth_deg"), pl.col("range_m")
TWO = ("1-10", "2-10")


def exchanged(one: Recording) -> Recording:
    """Return a recording with the sites of the two radars exchanged in the sensors file."""
    for name, other in (TWO, TWO[::-1]):
        latitude, longitude, height = RADARS[other][0]
        one = one.configured(name, latitude_deg=latitude, longitude_deg=longitude, height_m=height)
    return one


@pytest.mark.parametrize("reports", [True, False])
def test_exchanged_sites_of_two_radars_alone_are_named(reports: bool) -> None:
    one = recording(positions=True) if reports else recording()
    one = with_reports(one).only(*TWO, "adsb") if reports else one.only(*TWO)
    if reports:
        nowhere = {name: pl.lit(None, pl.Float64) for name in ("latitude_deg", "longitude_deg")}
        one = one.changed(*TWO, **nowhere)
    assert one.codes() == []
    found = exchanged(one).diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [(name, "site") for name in TWO]
    assert "its site is probably the site of 2-10, and the other way round" in found[0].sentence
    # ADS-B distinguishes it.
    assert ("(or the azimuths of both radars are off by 180°)" in found[0].sentence) != reports


def test_all_azimuths_off_by_180_degrees_are_no_exchanged_sites_beside_reports() -> None:
    nowhere = {name: pl.lit(None, pl.Float64) for name in ("latitude_deg", "longitude_deg")}
    one = with_reports(recording(positions=True)).only(*TWO, "adsb").changed(*TWO, **nowhere)
    found = one.changed(*TWO, azimuth_deg=(AZIMUTH + 180.0) % 360.0).diagnosed()
    assert {said.code for said in found} == {"azimuth_offset"}


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"azimuth_deg": (AZIMUTH - 5.0) % 360.0}, "azimuths are probably off by about -5°"),
        ({"range_m": RANGE / 1.852 * 1.609344}, "ranges are probably nautical miles that were"),
    ],
)
def test_an_error_of_both_radars_is_an_alternative_to_a_displaced_site(
    columns: dict[str, pl.Expr], said: str
) -> None:
    (found,) = recording().only(*TWO).changed(*TWO, **columns).diagnosed()
    assert "there is no third sensor to decide" in found.sentence
    assert f"; or both have the same error: {said}" in found.sentence


def test_a_displaced_site_is_no_error_of_both_radars() -> None:
    site = RADARS["1-10"][0]
    one = recording().only(*TWO)
    # Along and across the line between the radars, by no known factor and no small angle.
    moved = one.configured("1-10", latitude_deg=site[0] + 0.35, longitude_deg=site[1] - 0.25)
    (found,) = moved.diagnosed()
    assert "there is no third sensor to decide" in found.sentence
    assert "both have the same error" not in found.sentence


def test_two_radars_that_differ_from_the_recording_do_not_contradict_each_other() -> None:
    """Regression: a third sensor was said to be missing."""
    one = recording(positions=True).only(*TWO).changed(*TWO, azimuth_deg=(AZIMUTH + 5.0) % 360.0)
    found = one.diagnosed()
    assert [(said.sensor_id, said.code) for said in found] == [
        (name, "azimuth_offset") for name in TWO
    ]
    assert all("where the recording places aircraft" in said.sentence for said in found)
