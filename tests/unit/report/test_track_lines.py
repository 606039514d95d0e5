"""Tracks as GeoJSON and KML: structure, times, heights, escaping."""

import itertools
import json
import math
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest

from multiradar.report.kml import kml
from multiradar.report.track_lines import TrackLine, filled, geojson, iso_time

BEGIN_S = 1_533_081_600.0
NAMES = {"k": "http://www.opengis.net/kml/2.2", "gx": "http://www.google.com/kml/ext/2.2"}


def track(
    longitudes: list[float], *, begin_s: float = BEGIN_S, name: str = "T", known: bool = True
) -> TrackLine:
    count = len(longitudes)
    heights = np.array(np.linspace(9000.0, 9100.0, count), np.float64) if known else None
    return TrackLine(
        name, {"track_id": 7, "callsign": name, "mode_3a": None},
        np.array(begin_s + 10.0 * np.arange(count), np.float64), np.array(longitudes),
        np.array(np.linspace(46.0, 47.0, count)), heights,
    )  # fmt: skip


def features(*tracks: TrackLine) -> list[dict[str, Any]]:
    found = json.loads("".join(geojson(tracks)))
    assert found["type"] == "FeatureCollection"
    return list(found["features"])


def test_a_track_is_a_line_with_a_time_for_each_position() -> None:
    (found,) = features(track([8.0, 8.1, 8.2]))
    assert found["id"] == 7
    assert found["geometry"] == {
        "type": "LineString",
        "coordinates": [[8.0, 46.0, 9000.0], [8.1, 46.5, 9050.0], [8.2, 47.0, 9100.0]],
    }
    assert found["properties"]["times"][1] == "2018-08-01T00:00:10.000Z"
    assert found["properties"]["mode_3a"] is None


def test_times_without_a_date_are_seconds_and_one_position_is_a_point() -> None:
    line, point = features(track([8.0, 8.1], begin_s=28_800.0), track([8.0], known=False))
    assert line["properties"]["times"] == [28_800.0, 28_810.0]
    assert point["geometry"] == {"type": "Point", "coordinates": [8.0, 46.0]}
    assert point["properties"]["times"] == "2018-08-01T00:00:00.000Z"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_line_is_cut_at_the_antimeridian(sign: float) -> None:
    (found,) = features(track([sign * 179.0, sign * 179.5, sign * -179.5, sign * -179.0]))
    assert found["geometry"]["type"] == "MultiLineString"
    first, second = found["geometry"]["coordinates"]
    assert first[-1][0] == sign * 180.0
    assert second[0][0] == sign * -180.0
    assert first[-1][1:] == second[0][1:] == pytest.approx([46.5, 9050.0])
    # The times have the structure of the coordinates; the crossing is half way.
    assert [len(one) for one in found["properties"]["times"]] == [3, 3]
    assert found["properties"]["times"][1][0] == "2018-08-01T00:00:15.000Z"
    for part in (first, second):
        assert all(abs(a[0] - b[0]) < 180.0 for a, b in itertools.pairwise(part))


def test_no_tracks_are_an_empty_collection() -> None:
    assert features() == []
    assert ET.fromstring("".join(kml([], "none"))).find("k:Document/k:name", NAMES) is not None


def test_missing_heights_are_those_of_neighbours() -> None:
    found = filled(np.array([math.nan, 100.0, math.nan, 300.0]))
    assert found is not None
    np.testing.assert_allclose(found, [100.0, 100.0, 200.0, 300.0])
    assert filled(np.array([math.nan])) is None


def test_times_are_rounded_to_milliseconds() -> None:
    assert iso_time(BEGIN_S + 1.9996) == "2018-08-01T00:00:02.000Z"


def test_kml_is_well_formed_and_its_names_are_escaped() -> None:
    name = 'A<B>&"C\x01'
    (placemark,) = ET.fromstring("".join(kml([track([8.0, 8.1], name=name)], name))).iterfind(
        ".//k:Placemark", NAMES
    )
    assert placemark.findtext("k:name", namespaces=NAMES) == 'A<B>&"C '
    moving = placemark.find("gx:Track", NAMES)
    assert moving is not None
    assert moving.findtext("k:altitudeMode", namespaces=NAMES) == "absolute"
    times = [one.text for one in moving.iterfind("k:when", NAMES)]
    places = [one.text for one in moving.iterfind("gx:coord", NAMES)]
    assert times == ["2018-08-01T00:00:00.000Z", "2018-08-01T00:00:10.000Z"]
    assert places == ["8.000000 46.000000 9000.0", "8.100000 47.000000 9100.0"]
    data = {one.get("name"): one.findtext("k:value", namespaces=NAMES)
            for one in placemark.iterfind(".//k:Data", NAMES)}  # fmt: skip
    assert data == {"track_id": "7", "callsign": 'A<B>&"C '}


def test_kml_without_a_date_or_heights_is_a_line_on_the_ground() -> None:
    text = "".join(kml([track([8.0, 8.1], begin_s=100.0, known=False)], "undated"))
    line = ET.fromstring(text).find(".//k:LineString", NAMES)
    assert line is not None
    assert line.findtext("k:altitudeMode", namespaces=NAMES) == "clampToGround"
    assert line.findtext("k:coordinates", namespaces=NAMES) == (
        "8.000000,46.000000,0.0 8.100000,47.000000,0.0"
    )
