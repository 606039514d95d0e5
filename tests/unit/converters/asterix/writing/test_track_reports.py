"""Records of category 062 octet by octet, and tracks that do not fit into its items."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar_converters.asterix.writing.senders import ticks_of_day
from multiradar_converters.asterix.writing.track_reports import track_records
from multiradar_schemas.measurements.callsigns import packed_callsigns
from support.asterix.reports import SENDER, read_tracks, reports

#: One unit of item 105, degrees.
UNIT_DEG = 180 / 2**25


def test_a_track_is_written_as_the_tables_of_the_standard_say() -> None:
    reported = replace(reports(number=0x1234), first=np.array([True]))
    octets = track_records(reported, SENDER).written().data.tobytes()
    # Worked out by hand from the tables of edition 1.21.
    expected = (
        "bb 5f ed 06"  # 010 015 070 105 185, 060 380 040 080 290, 200 295 136 135 220, 500 340
        "14 fa  07  38 40 00"  # 20-250, service 7, 28 800 s in 1/128 s
        "00 8e 38 e4  00 2a aa ab"  # 50° and 15° in 180/2²⁵ degrees
        "03 20  fe 70"  # 200 and -100 m/s in 1/4 m/s
        "02 9c"  # code 1234
        "80  4b 12 34"  # 380: the address alone
        "12 34"  # track number
        "01 21 01 49 41 02"  # -, first message, -, no PSR, no ADS-B, cooperative, no MLAT
        "b0  28 04 08"  # ages 10 s (track), 1 s (SSR), 2 s (Mode S) in 1/4 s
        "f0"  # course and speed not determined, level
        "90  08 0a"  # ages of flight level and code, 2 s and 2.5 s
        "05 78  05 78  00 00"  # flight level 350 measured and calculated, no climb
        "2c  00 22 00 4e  04  0c 0c"  # 34 and 78 units of 180/2²⁵ degrees, 1 FL, 3 m/s
        "dc  14 82  32 00 40 00  05 78  02 9c  a0"  # 20-130, 50 NM, 90°, FL 350, code, roll-call
    )
    assert octets == bytes.fromhex(expected)


def test_a_callsign_is_reported_as_derived_from_the_aircraft_and_not_twice() -> None:
    called = packed_callsigns(pl.Series(["DLH8JW", None, "ABCD1234"]))
    first, second, third = read_tracks(track_records(reports(3, callsign=called), SENDER))
    # The standard forbids 245, because 380/ID has the same content.
    assert [one.get("245") for one in (first, second, third)] == [None] * 3
    assert (first["380"]["ID"], third["380"]["ID"]) == ("DLH8JW", "ABCD1234")
    assert "ID" not in second["380"]


def test_what_is_not_known_is_absent() -> None:
    nothing = reports(
        mode_3a=-1,
        mode_s_address=-1,
        measured_height_m=np.nan,
        barometric_m=np.nan,
        climb_mps=np.nan,
        climbing=3,
        sensor=-1,
        height_sigma_m=np.nan,
        age_s=np.full((1, 5), np.nan),
        height_age_s=np.nan,
        code_age_s=np.nan,
    )
    (record,) = read_tracks(track_records(nothing, SENDER))
    assert set(record) == {"010", "015", "070", "105", "185", "040", "080", "290", "500"}
    assert set(record["290"]) == {"TRK"}
    assert set(record["500"]) == {"APW", "ATV"}
    assert record["080"]["SDS"] == 3


def test_a_track_on_the_ground_is_a_surface_target() -> None:
    airborne, standing = read_tracks(
        track_records(reports(2, on_ground=np.array([False, True])), SENDER)
    )
    assert (airborne["080"]["SFC"], standing["080"]["SFC"]) == (0, 1)


def test_a_height_by_geometry_is_reported_as_such() -> None:
    geometric = reports(barometric_m=np.nan, measured_height_m=np.nan, geometric_m=9144.0)
    (record,) = read_tracks(track_records(geometric, SENDER))
    assert record["130"] == pytest.approx(30_000.0)
    assert not {"135", "136"} & set(record)
    assert (record["080"]["MRH"], record["080"]["SRC"]) == (1, 3)
    assert set(record["500"]) == {"APW", "AGA", "ATV"}


@pytest.mark.parametrize(
    ("longitude_deg", "expected"),
    [
        (180.0, -180.0),
        (179.9999999, -180.0),
        (-180.0, -180.0),
        (-179.999, -179.999),
        (179.999, 179.999),
    ],
)
def test_the_antimeridian_is_minus_half_a_turn(longitude_deg: float, expected: float) -> None:
    (record,) = read_tracks(track_records(reports(longitude_deg=longitude_deg), SENDER))
    assert record["105"]["LON"] == pytest.approx(expected, abs=UNIT_DEG)


@pytest.mark.parametrize("latitude_deg", [90.0, -90.0, 89.9999999])
def test_at_a_pole_the_longitude_is_wrong_by_as_much_as_can_be(latitude_deg: float) -> None:
    (record,) = read_tracks(track_records(reports(latitude_deg=latitude_deg), SENDER))
    assert record["105"]["LAT"] == pytest.approx(latitude_deg, abs=UNIT_DEG)
    assert record["500"]["APW"]["LON"] == pytest.approx(65535 * UNIT_DEG)
    assert record["500"]["APW"]["LAT"] == pytest.approx(20.0 / 111_132.0, abs=UNIT_DEG)


def test_speeds_and_heights_beyond_their_items_are_left_out_and_counted() -> None:
    hostile = reports(
        velocity_east_mps=9000.0,
        barometric_m=4096 * 30.48,
        measured_height_m=8192 * 30.48,
        climb_mps=1100.0,
        range_m=300 * 1852.0,
    )
    records = track_records(hostile, SENDER)
    (record,) = read_tracks(records)
    assert not {"185", "135", "136", "220"} & set(record)
    assert set(record["340"]) == {"SID", "MDC", "MDA", "TYP"}
    assert records.left_out == {"185": 1, "136": 1, "135": 1, "220": 1, "340/POS": 1}


def test_ages_and_accuracies_beyond_their_items_are_the_largest_there_is() -> None:
    old = reports(
        track_age_s=7200.0,
        age_s=np.full((1, 5), 100.0),
        height_age_s=100.0,
        code_age_s=100.0,
        variance_east_m2=1e12,
        variance_north_m2=1e12,
        velocity_sigma_mps=500.0,
        height_sigma_m=3000.0,
    )
    records = track_records(old, SENDER)
    (record,) = read_tracks(records)
    assert set(record["290"].values()) == {63.75}
    assert set(record["295"].values()) == {63.75}
    assert record["500"]["ATV"] == {"X": 63.75, "Y": 63.75}
    assert record["500"]["APW"]["LAT"] == pytest.approx(65535 * UNIT_DEG)
    assert record["500"]["ABA"] == 63.75
    assert records.left_out == {}


def test_360_degrees_is_not_an_azimuth() -> None:
    (record,) = read_tracks(track_records(reports(azimuth_deg=359.9999), SENDER))
    assert record["340"]["POS"]["THETA"] == 0.0


def test_what_rounds_to_midnight_is_the_new_day() -> None:
    assert ticks_of_day(86_399.999) == 0
    assert ticks_of_day(86_400.0 * 19_000 + 1.0) == 128
    assert ticks_of_day(-1.0) == 86_399 * 128
