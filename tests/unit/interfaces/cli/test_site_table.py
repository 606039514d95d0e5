"""Tables of sites for `inspect --sites`."""

from pathlib import Path

import pytest

from multiradar.cli.inspection.sites import read_sites
from multiradar.errors import InputError


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "sites.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "height_m"),
    [
        ("sac,sic,latitude_deg,longitude_deg,height_m\n20,130,39.5,-0.5,250\n", 250.0),
        (
            "name,sac,sic,lat_deg,lon_deg,ground_alt_m,ssr_electrical_height_m\n"
            "Valencia,20,130,39.5,-0.5,240,10\n",
            250.0,
        ),
        ("source,sensor,lat,lon\n20,130,39.5,-0.5\n", 0.0),
    ],
)
def test_columns_by_their_names(text: str, height_m: float, tmp_path: Path) -> None:
    site = read_sites(written(tmp_path, text))["20-130"]
    assert (site.latitude_deg, site.longitude_deg, site.height_m) == (39.5, -0.5, height_m)
    assert site.sigma_m is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sac,sic,latitude_deg\n1,2,3\n", "longitude_deg"),
        ("sac,sic,lat,lon\n1,2,95,3\n", ":2: lat: expected a number from -90 to 90, was '95'"),
        ("sac,sic,lat,lon\n1,2,,3\n", "was ''"),
        ("sac,sic,lat,lon\n1,2,nan,3\n", "was 'nan'"),
    ],
)
def test_mistakes_name_line_and_column(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        read_sites(written(tmp_path, text))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_sites(tmp_path / "nothing.csv")
