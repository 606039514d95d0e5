"""Aircraft-derived data of recordings become columns; implausible ones are counted by reason."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT
from support.aircraft.registers import item_250, write
from support.asterix.octets import block, plot_048, record, time_of_day

KNOT, FOOT, MILE = 1852 / 3600, 0.3048, 1852.0
AIR = {
    "magnetic_heading": 84.0, "indicated_airspeed": 269.0, "mach": 0.8, "inertial_rate": 0.0,
    "barometric_rate": 0.0,
}  # fmt: skip
MOTION = {
    "roll": -20.0, "track_angle": 90.0, "ground_speed": 470.0, "track_angle_rate": -0.9,
    "true_airspeed": 460.0,
}  # fmt: skip


def converted(
    tmp_path: Path, content: bytes, name: str = "measurements.parquet", kind: str = "asterix"
) -> Any:
    (tmp_path / "recording").write_bytes(content)
    out = tmp_path / "out"
    command = ["convert", kind, str(tmp_path / "recording"), "--out", str(out)]
    assert run(command) == EXIT_DONE
    figures: dict[str, Any] = json.loads((out / "report.json").read_text())["figures"]
    return pl.read_parquet(out / name), figures


def test_registers_of_plots_are_columns(tmp_path: Path) -> None:
    altitude = write("4,0", panel_altitude=36_000.0)
    whole = item_250(bds40=altitude, bds50=write("5,0", **MOTION), bds60=write("6,0", **AIR))
    plots = [
        plot_048(1.0, registers=whole),
        plot_048(2.0, registers=item_250(bds60=write("6,0", magnetic_heading=-90.0))),
        plot_048(3.0),
    ]
    table, figures = converted(tmp_path, block(48, *plots))
    first = table.row(0, named=True)
    expected = {
        "magnetic_heading_deg": 83.848,
        "roll_deg": -20.039,
        "track_angle_deg": 90.0,
        "track_angle_rate_deg_s": -0.906,
        "ground_speed_m_s": 470 * KNOT,
        "true_airspeed_m_s": 460 * KNOT,
        "indicated_airspeed_m_s": 269 * KNOT,
        "mach": 0.8,
        "vertical_rate_m_s": 0.0,
        "selected_altitude_m": 36_000 * FOOT,
    }
    assert {name: first[name] for name in expected} == pytest.approx(expected, abs=0.2)
    assert table["magnetic_heading_deg"].to_list() == [first["magnetic_heading_deg"], 270.0, None]
    assert table["roll_deg"].null_count() == 2
    (data,) = figures["aircraft_data"].values()
    assert (data["reports"], data["with_data"], data["dropped"]) == (3, 2, {})
    assert data["values"]["magnetic_heading_deg"] == {"reports": 2, "sigma": None}


@pytest.mark.parametrize("category", [10, 20])
def test_registers_of_multilateration_are_columns(category: int, tmp_path: Path) -> None:
    """Registers of category 010 were not read."""
    registers = item_250(bds50=write("5,0", **MOTION), bds60=write("6,0", **AIR))
    place = "{:08x}{:08x}".format(*(round(one * 2**31 / 180) for one in (41.3, 2.1)))
    if category == 10:
        head = [(1, "00 6b"), (2, "01"), (3, "20"), (4, time_of_day(1.0)), (5, place)]
        reports = [
            record(*head, (13, "3c660c"), (15, registers)),
            # A primary report beside it, and one without registers.
            record((1, "00 07"), (2, "01"), (3, "60"), (4, time_of_day(1.5)), (6, "0400 2000")),
            record(*head[:3], (4, time_of_day(2.0)), (5, place), (13, "3c660d")),
        ]
    else:
        place = "{:08x}{:08x}".format(*(round(one * 2**25 / 180) for one in (41.3, 2.1)))
        head = [(1, "00 6b"), (2, "41 10"), (3, time_of_day(1.0)), (4, place)]
        reports = [record(*head, (12, "3c660c"), (21, registers))]
    table, _ = converted(tmp_path, block(category, *reports))
    first = table.filter(pl.col("mode_s_address") == "3c660c").row(0, named=True)
    assert first["kind"] == "mlat"
    assert first["roll_deg"] == pytest.approx(-20.0, abs=0.2)
    assert first["magnetic_heading_deg"] == pytest.approx(84.0, abs=0.2)
    assert first["ground_speed_m_s"] == pytest.approx(470 * KNOT, abs=0.6)
    assert table.filter(pl.col("roll_deg").is_not_null()).height == 1


def test_a_recording_without_such_data_has_no_such_columns(tmp_path: Path) -> None:
    table, figures = converted(tmp_path, block(48, plot_048(1.0), plot_048(2.0, registers="00")))
    assert not set(MEASUREMENT_AIRCRAFT) & set(table.columns)
    assert "aircraft_data" not in figures


def test_swapped_registers_are_dropped_and_counted(tmp_path: Path) -> None:
    motion, air = write("5,0", **MOTION), write("6,0", **AIR)
    plots = [
        plot_048(1.0, registers=item_250(bds50=motion, bds60=air)),
        plot_048(2.0, registers=item_250(bds50=air, bds60=motion)),
        plot_048(3.0, registers=item_250(bds50=motion, bds60=motion)),
        plot_048(4.0, registers=item_250(bds40=motion)),
    ]
    table, figures = converted(tmp_path, block(48, *plots))
    assert table["ground_speed_m_s"].is_not_null().to_list() == [True, False, False, False]
    assert table["mach"].is_not_null().to_list() == [True, False, False, False]
    # Its column has no value left.
    assert "selected_altitude_m" not in table.columns
    (data,) = figures["aircraft_data"].values()
    assert sum(data["dropped"].values()) >= 3
    assert data["dropped"]["unannounced_bits"] >= 2
    assert data["dropped"]["equal_registers"] == 1


def words(*values: float) -> str:
    """Write numbers with 16 bits each."""
    return "".join(f"{round(value) % 65536:04x}" for value in values)


def test_items_of_adsb_reports_are_columns(tmp_path: Path) -> None:
    place = (6, "215555 080000")
    head = [(1, "0a0b"), (2, "00"), place]
    items = [
        (9, words(0.8 / 0.001 + 0x8000)),
        (10, words(460.0)),
        (11, "3c660c"),
        (12, time_of_day(10.0)),
        (20, words(-20.0 / 0.01)),
        (21, words(350 * 4)),
        (22, words(84.0 * 65536 / 360)),
        (24, words((-600 / 6.25) % 32768)),
        (26, words(470 / 3600 * 16384, 90.0 * 65536 / 360)),
        (27, words((-0.9 * 32) % 1024)),
        (32, words(0x8000 + 36_000 / 25)),
    ]
    # A vertical rate and a true airspeed beyond their ranges.
    exceeded = [*items]
    exceeded[1], exceeded[7] = (10, words(0x8000 + 460.0)), (24, words(0x8000 + 5))
    content = block(
        21,
        record(*head, *items),
        record(*head, *exceeded[:3], (12, time_of_day(12.0)), *exceeded[4:]),
    )
    table, figures = converted(tmp_path, content)
    row = table.row(0, named=True)
    expected = {
        "magnetic_heading_deg": 84.0,
        "roll_deg": -20.0,
        "track_angle_deg": 90.0,
        "track_angle_rate_deg_s": -0.9,
        "ground_speed_m_s": 470 * KNOT,
        "true_airspeed_m_s": 460 * KNOT,
        "mach": 0.8,
        "vertical_rate_m_s": -600 * FOOT / 60,
        "selected_altitude_m": 36_000 * FOOT,
    }
    assert {name: row[name] for name in expected} == pytest.approx(expected, abs=0.04)
    assert table["true_airspeed_m_s"].null_count() == 1
    assert table["vertical_rate_m_s"].null_count() == 1
    (data,) = figures["aircraft_data"].values()
    assert data["dropped"] == {"range_exceeded": 1}


def test_old_adsb_reports_have_other_items(tmp_path: Path) -> None:
    # Edition 0.26: the rate of turn has a direction, which must not contradict its sign.
    head = [(1, "0a0b"), (2, "0000"), (4, "008e38e3 00222222"), (5, "3c660c")]

    def report(seconds: float, turn: str) -> bytes:
        items = [
            (10, words(350 * 4)), (12, words(460.0)), (13, words(84.0 * 65536 / 360)),
            (14, words(-600 / 6.25)),
            (16, words(470 / 3600 * 16384, 90.0 * 65536 / 360)), (17, turn),
        ]  # fmt: skip
        return record(*head[:2], (3, time_of_day(seconds)), *head[2:], *items)

    left = f"{1 << 6 | 1:02x}{((-4) % 128) << 1:02x}"
    wrong = f"{2 << 6 | 1:02x}{((-4) % 128) << 1:02x}"
    right = f"{2 << 6 | 1:02x}{4 << 1:02x}"
    turns = ((1.0, left), (3.0, wrong), (5.0, right))
    content = b"".join(block(21, report(k, turn)) for k, turn in turns)
    (tmp_path / "recording").write_bytes(content)
    out = tmp_path / "out"
    command = [
        "convert", "asterix", str(tmp_path / "recording"), "--out", str(out),
        "--edition", "021=0.26",
    ]  # fmt: skip
    assert run(command) == EXIT_DONE
    table = pl.read_parquet(out / "measurements.parquet")
    assert table["track_angle_rate_deg_s"].to_list() == [-1.0, None, 1.0]
    assert table["true_airspeed_m_s"].to_list() == pytest.approx([460 * KNOT] * 3)
    assert table["ground_speed_m_s"].to_list() == pytest.approx([470 * KNOT] * 3, abs=0.06)
    assert table["vertical_rate_m_s"].to_list() == pytest.approx([-600 * FOOT / 60] * 3)


def test_data_of_system_tracks_are_columns(tmp_path: Path) -> None:
    # 380: MHG, TAS, RAN, TAR, TAN, GS, MAC; 295: the age of the roll angle.
    presence = [0] * 28
    for place in (3, 5, 15, 16, 17, 18, 27):
        presence[place - 1] = 1
    octets = "".join(
        f"{int(''.join(map(str, presence[7 * k : 7 * k + 7])) + ('1' if k < 3 else '0'), 2):02x}"
        for k in range(4)
    )
    turn = f"40{((-4) % 128) << 1:02x}"
    data = words(84.0 * 65536 / 360, 460.0, -20.0 / 0.01) + turn
    data += words(90.0 * 65536 / 360, 470 / 3600 * 16384, 0.8 / 0.008)

    def track(seconds: float, age_s: float) -> bytes:
        ages = "01 01 10" + f"{round(age_s * 4):02x}"
        items = [
            (1, "14fa"), (4, time_of_day(seconds)), (5, "008e38e3 00222222"), (7, "00000000"),
            (11, octets + data), (12, "0001"), (13, "00"), (16, ages), (17, words(350 * 4)),
        ]  # fmt: skip
        return block(62, record(*items))

    table, _ = converted(tmp_path, track(1.0, 2.0) + track(5.0, 20.0), "system_tracks.parquet")
    row = table.row(0, named=True)
    expected = {
        "magnetic_heading_deg": 84.0,
        "roll_deg": -20.0,
        "track_angle_deg": 90.0,
        "track_angle_rate_deg_s": -1.0,
        "ground_speed_m_s": 470 * KNOT,
        "true_airspeed_m_s": 460 * KNOT,
        "mach": 0.8,
    }
    assert {name: row[name] for name in expected} == pytest.approx(expected, abs=0.06)
    assert table["roll_deg"].to_list() == [-20.0, None]
    assert "vertical_rate_m_s" not in table.columns


AIRCRAFT = {
    "now": 1_533_110_400.0, "hex": "3c660c", "type": "adsb_icao", "lat": 47.0, "lon": 8.5,
    "seen_pos": 0.2, "alt_baro": 35_000, "gs": 470.0, "ias": 272, "tas": 461, "mach": 0.8,
    "track": 90.0, "track_rate": -0.9, "roll": -20.0, "mag_heading": 84.0, "baro_rate": -640,
    "geom_rate": -600, "nav_altitude_mcp": 34_016,
}  # fmt: skip
READ = {
    "magnetic_heading_deg": 84.0,
    "roll_deg": -20.0,
    "track_angle_deg": 90.0,
    "track_angle_rate_deg_s": -0.9,
    "ground_speed_m_s": 470 * KNOT,
    "true_airspeed_m_s": 461 * KNOT,
    "indicated_airspeed_m_s": 272 * KNOT,
    "mach": 0.8,
    "vertical_rate_m_s": -600 * FOOT / 60,
    "selected_altitude_m": 34_016 * FOOT,
}


def test_aircraft_of_readsb_have_the_same_columns(tmp_path: Path) -> None:
    # Values of registers count if they have changed since the last message.
    before = AIRCRAFT | {"now": 1_533_110_399.0, "lon": 8.497, "roll": -19.0, "ias": 271}
    swapped = AIRCRAFT | {"now": 1_533_110_401.0, "lon": 8.503, "mach": 0.4}
    # Multilateration computes speed and track of positions: these are not reported.
    by_ground = AIRCRAFT | {"now": 1_533_110_402.0, "lon": 8.506, "type": "mlat"}
    lines = b"\n".join(json.dumps(one).encode() for one in (before, AIRCRAFT, swapped, by_ground))
    table, figures = converted(tmp_path, lines, kind="adsb")
    first, *rows = table.sort("time_s").to_dicts()
    assert first["roll_deg"] is first["mach"] is None
    assert {name: rows[0][name] for name in READ} == pytest.approx(READ, abs=1e-4)
    kept = {name for name in READ if rows[1][name] is not None}
    assert kept == {"selected_altitude_m"}
    computed = {"ground_speed_m_s", "track_angle_deg", "vertical_rate_m_s"}
    assert {name for name in READ if rows[2][name] is None} == computed
    assert figures["aircraft_data"]["adsb"]["dropped"] == {
        "airspeed_and_mach": 1,
        "true_and_mach": 1,
    }


def test_points_of_a_trace_have_the_same_columns(tmp_path: Path) -> None:
    details = {
        "type": "adsb_icao",
        **{k: v for k, v in AIRCRAFT.items() if k not in ("hex", "now")},
    }
    points = [
        [
            0.0,
            47.0,
            8.5,
            35_000,
            470.0,
            90.0,
            0,
            -600,
            details,
            "adsb_icao",
            35_500,
            None,
            272,
            -20.0,
        ],
        [
            4.0,
            47.0,
            8.513,
            35_000,
            470.0,
            90.0,
            0,
            -600,
            None,
            "adsb_icao",
            35_500,
            None,
            None,
            None,
        ],
    ]
    trace = {"icao": "3c660c", "timestamp": 1_533_110_400.0, "trace": points}
    table, _ = converted(tmp_path, json.dumps(trace).encode(), kind="adsb")
    first, second = table.sort("time_s").to_dicts()
    assert {name: first[name] for name in READ} == pytest.approx(READ, abs=1e-4)
    known = {"ground_speed_m_s", "track_angle_deg", "vertical_rate_m_s"}
    assert {name for name in READ if second[name] is not None} == known


@pytest.mark.parametrize(
    ("speed", "rate", "climb_m_s"),
    [
        ({"groundspeed": 470.0}, {"vertical_rate": 640.0}, 640 * FOOT / 60),
        ({"velocity": 240.0}, {"vertical_rate": 3.0}, 3.0),
        ({"velocity": 240.0}, {"vertrate": 3.0}, 3.0),
        # Without a speed the unit is unknown.
        ({}, {"vertical_rate": 640.0}, None),
    ],
)
def test_the_unit_of_a_vertical_rate_is_that_of_the_speed_beside_it(
    tmp_path: Path, speed: dict[str, float], rate: dict[str, float], climb_m_s: float | None
) -> None:
    report = {"timestamp": 1_533_110_400_000, "icao24": "3c660c", "latitude": 47.0,
              "longitude": 8.5, "baroaltitude": 1000.0, **speed, **rate}  # fmt: skip
    table, _ = converted(tmp_path, json.dumps([report]).encode(), kind="adsb")
    found = table["vertical_rate_m_s"][0] if "vertical_rate_m_s" in table.columns else None
    assert found == pytest.approx(climb_m_s, abs=1e-4)
