"""Tracks in the form of readsb, as tar1090 reads them."""

import json
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, cast

import numpy as np
import polars as pl
import pytest

from multiradar.api.answers.aircraft import AircraftJson, ReceiverJson
from multiradar.runtime.memory.knowledge import Knowledge, Picture
from multiradar.runtime.memory.live_tracks import BY_ADSB, BY_MLAT, BY_RADAR, LiveTracks, sources_of
from multiradar.runtime.queries.aircraft_json import (
    SOURCE_S,
    AircraftSnapshots,
    document,
    receiver,
)
from multiradar.wire import sensor_table
from multiradar_converters.adsb.reading import roles
from multiradar_converters.feeds.decoder import FeedDecoder
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.fakes.fake_service import LIVE_SCHEMA, live_tracks
from support.processes.waiting import wait_until

NOW_S = 1_533_110_400.0
#: Keys of an aircraft by `README-json.md` of readsb.
_README = """
hex type flight alt_baro alt_geom gs ias tas mach track track_rate roll mag_heading true_heading
baro_rate geom_rate squawk emergency category nav_qnh nav_altitude_mcp nav_altitude_fms nav_heading
nav_modes lat lon nic rc seen_pos version nic_baro nac_p nac_v sil sil_type gva sda mlat tisb
messages seen rssi alert spi wd ws oat tat
"""
README_KEYS = frozenset(_README.split())


def picture(*changes: dict[str, Any], heard: Any = None, updates: Any = None) -> Picture:
    """Return one track for each, at `NOW_S`, updated by ADS-B unless given."""
    rows = live_tracks(len(changes)).to_dicts()
    for row, changed in zip(rows, changes, strict=True):
        row |= {"age_s": 1.25, "time_s": NOW_S - 1.25, "mode_s_address": "3c6444"} | changed
    frame = pl.DataFrame(rows, schema=LIVE_SCHEMA)
    if heard is None:
        heard = np.full((len(changes), 3), -np.inf)
        heard[:, BY_ADSB] = NOW_S - 1.25
    updates = np.full(len(changes), 7) if updates is None else updates
    return Picture(1, NOW_S, 1234, frame, updates, np.array(heard))


def made(*changes: dict[str, Any], **options: Any) -> list[dict[str, Any]]:
    """Return the aircraft; the document is valid by its model and by the names of readsb."""
    found = document(picture(*changes, **options))
    text = json.dumps(found)
    AircraftJson.model_validate_json(text, strict=True)
    assert (found["now"], found["messages"]) == (NOW_S, 1234)
    for one in found["aircraft"]:
        assert set(one) <= README_KEYS
        assert None not in one.values()
    aircraft: list[dict[str, Any]] = json.loads(text)["aircraft"]
    return aircraft


def test_a_track_has_the_units_and_names_of_readsb() -> None:
    (one,) = made(
        {
            "callsign": "DLH8JW", "mode_3a": "1000", "height_m": 10_668.0, "on_ground": False,
            "speed_mps": 231.5, "heading_deg": 359.999, "vertical_rate_mps": -5.08,
            "latitude_deg": 47.123_456_7, "longitude_deg": -8.5, "position_sigma_m": 40.0,
        }
    )  # fmt: skip
    assert one == {
        "hex": "3c6444", "type": "adsb_icao", "flight": "DLH8JW  ", "alt_baro": 35_000,
        "gs": 450.0, "track": 0.0, "baro_rate": -1000, "squawk": "1000", "lat": 47.123457,
        "lon": -8.5, "nac_p": 8, "seen_pos": 1.25, "mlat": [], "tisb": [], "messages": 7,
        "seen": 1.2,
    }  # fmt: skip


def test_values_that_are_not_known_are_absent() -> None:
    (one,) = made({"callsign": None, "mode_3a": None, "height_m": None, "vertical_rate_mps": None})
    assert not {"flight", "squawk", "alt_baro", "baro_rate"} & set(one)


def test_an_aircraft_on_the_ground_has_the_altitude_ground() -> None:
    (one,) = made({"on_ground": True, "height_m": 430.0})
    assert one["alt_baro"] == "ground"
    assert "baro_rate" not in one


def test_tracks_without_an_address_and_second_ones_have_numbers_with_a_tilde() -> None:
    addresses: list[dict[str, Any]] = [
        {"mode_s_address": None, "track_id": 0x1002B},
        {"mode_s_address": "4ca8d1"},
        {"mode_s_address": "4ca8d1", "track_id": 5},
        {"mode_s_address": None, "track_id": 0x5000001},
    ]
    found = [one["hex"] for one in made(*addresses)]
    assert found == ["~01002b", "4ca8d1", "~000005", "~000001"]


def test_tentative_tracks_are_not_shown() -> None:
    states = [{"state": "tentative"}, {"state": "confirmed"}, {"state": "coasting"}]
    assert len(made(*states)) == 2


@pytest.mark.parametrize(
    ("ages", "address", "kind"),
    [((1, 2, 1), "3c6444", "adsb_icao"), ((1, 2, 1), None, "adsb_other"),
     ((SOURCE_S, 1, 1), "3c6444", "adsb_icao"), ((SOURCE_S + 1, 9, 1), "3c6444", "mlat"),
     ((SOURCE_S + 1, SOURCE_S + 1, 9), "3c6444", "tisb_icao"),
     ((99, 98, 97), None, "tisb_trackfile"), ((98, 99, 99), "3c6444", "adsb_icao")],
)  # fmt: skip
def test_the_type_is_the_best_source_of_the_last_scans(
    ages: tuple[float, float, float], address: str | None, kind: str
) -> None:
    """Otherwise a track that radar and ADS-B update in turn would change its colour each second."""
    heard = [[NOW_S - age for age in ages]]
    (one,) = made({"mode_s_address": address}, heard=heard)
    assert one["type"] == kind
    assert ("lat" in one["mlat"], "lat" in one["tisb"]) == (kind == "mlat", kind.startswith("tisb"))


@pytest.mark.parametrize(
    ("sigma_m", "category"), [(1.7, 11), (17.0, 9), (53.0, 8), (54.0, 7), (20_000.0, 0)]
)
def test_the_accuracy_is_that_of_the_95_percent_circle(sigma_m: float, category: int) -> None:
    (one,) = made({"position_sigma_m": sigma_m})
    assert one["nac_p"] == category


def test_our_own_feed_reader_reads_it() -> None:
    tracks: list[dict[str, Any]] = [
        {"mode_s_address": "3c6444"},
        {"mode_s_address": "4ca8d1", "on_ground": True},
    ]
    found = picture(*tracks)
    decoder = FeedDecoder()
    decoder.document(json.dumps(document(found)).encode(), 0)
    batch = decoder.drain()
    assert batch.rejected == []
    assert batch.numbers[roles.TIME].tolist() == [NOW_S - 1.25] * 2
    np.testing.assert_allclose(batch.numbers[roles.LATITUDE], found.tracks["latitude_deg"])
    assert batch.words[roles.GROUND - roles.FIRST_WORD].tolist() == [0, 1]


def test_the_receiver_is_in_the_middle_of_the_sensors() -> None:
    sites = [("a", 47.0, 179.0), ("b", 49.0, -179.0)]
    table = sensor_table(
        SensorsFile(
            sensor=(
                *(
                    Sensor.model_validate(
                        {"id": name, "kind": "adsb", "latitude_deg": lat, "longitude_deg": lon}
                    )
                    for name, lat, lon in sites
                ),
                Sensor.model_validate({"id": "c", "kind": "mlat"}),
            )
        )
    )
    found = ReceiverJson.model_validate(receiver(table))
    assert (found.refresh, found.history) == (1000, 0)
    assert found.lat == 48.0
    assert abs(found.lon or 0.0) == 180.0
    assert sources_of(table).tolist() == [BY_ADSB, BY_ADSB, BY_MLAT]


def test_clients_that_ask_together_get_one_document() -> None:
    versions: list[int] = []
    later: list[Future[bytes]] = []

    class Known:
        def picture(self, version: int) -> Picture | None:
            versions.append(version)
            if not later:
                # Another client asks meanwhile.
                later.append(clients.submit(snapshots.aircraft))
                wait_until(lambda: later[0].running() or later[0].done(), "the other client")
            return None if version == 1 else picture({})

    snapshots = AircraftSnapshots(cast(Knowledge, Known()))
    with ThreadPoolExecutor(1) as clients:
        first = snapshots.aircraft()
    assert later[0].result() is first
    assert versions == [-1, 1]


def test_updates_and_sources_are_counted_by_track() -> None:
    live = LiveTracks(np.array([BY_ADSB, BY_RADAR], np.int8))
    rows = np.zeros(5, live.all().dtype)
    rows["track_id"], rows["sensor"] = [9, 2, 9, 9, 2], [0, 1, 1, 0, 1]
    rows["time_s"] = [1.0, 2.0, 3.0, 4.0, 5.0]
    live.update(rows)
    updates, heard_s = live.heard()
    assert live.all()["track_id"].tolist() == [2, 9]
    assert updates.tolist() == [2, 3]
    assert heard_s[:, [BY_ADSB, BY_RADAR]].tolist() == [[-np.inf, 5.0], [4.0, 3.0]]
    live.remove(np.array([9]))
    live.update(rows[:1])
    assert live.heard()[0].tolist() == [2, 1]
    assert live.heard()[1][1].tolist() == [1.0, -np.inf, -np.inf]
