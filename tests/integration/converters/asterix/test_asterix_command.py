"""`multiradar convert asterix` from octets written by hand to tables, quarantine and report."""

import json
import os
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar_schemas.reject import Reject
from multiradar_schemas.report import Report
from multiradar_schemas.sensors.sensor import load_sensors
from support.asterix.octets import (
    block,
    datagram,
    gps,
    north_mark,
    pcap,
    plot_001,
    plot_048,
    record,
    rply,
    time_of_day,
)

MILE_M = 1852.0
DAY_S = 86_400.0


def converted(
    tmp_path: Path, *contents: bytes, options: tuple[str, ...] = (), status: int = EXIT_DONE
) -> Path:
    paths = []
    for number, content in enumerate(contents):
        paths.append(tmp_path / f"recording-{number}")
        paths[-1].write_bytes(content)
    out = tmp_path / "out"
    command = ["convert", "asterix", *map(str, paths), "--out", str(out), *options]
    assert run(command) == status
    return out


def rows(out: Path) -> list[dict[str, Any]]:
    return pl.read_parquet(out / "measurements.parquet").to_dicts()


def report(out: Path) -> Report:
    return Report.model_validate_json((out / "report.json").read_bytes())


def rejects(out: Path) -> list[Reject]:
    lines = (out / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
    return [Reject.model_validate_json(line) for line in lines]


def test_a_plot_becomes_a_measurement(tmp_path: Path) -> None:
    out = converted(tmp_path, block(48, plot_048(28800.5)))
    assert rows(out) == [
        {
            "time_s": 28800.5,
            "sensor_id": "20-130",
            "kind": "radar",
            "range_m": 50 * MILE_M,
            "azimuth_deg": 90.0,
            "latitude_deg": None,
            "longitude_deg": None,
            "height_m": 35_000 * 0.3048,
            "mode_3a": "7777",
            "mode_s_address": "3c660c",
            "track_number": None,
            "callsign": None,
            "on_ground": None,
            "detection": "ssr",
            "flags": None,
        }
    ]
    said = report(out)
    assert (said.counts.read, said.counts.accepted) == (1, 1)
    figures: dict[str, Any] = said.figures
    assert figures["records_by_sensor"] == {"048": {"20-130": 1}}
    assert figures["items"]["048"]["20-130"] == dict.fromkeys(
        ("010", "020", "040", "070", "090", "140", "220"), 1
    )


def test_a_broken_block_is_quarantined_with_its_place_and_the_next_one_is_read(
    tmp_path: Path,
) -> None:
    bad = block(48, record((1, "1482"), (2, "000001"), (7, "80")))
    whole = block(48, plot_048(1.0)) + bad + block(33, b"\x80\x01") + block(48, plot_048(2.0))
    out = converted(tmp_path, whole)
    assert [row["time_s"] for row in rows(out)] == [1.0, 2.0]
    first, second = rejects(out)
    offset = len(block(48, plot_048(1.0)))
    assert (first.offset, first.raw) == (offset, bad.hex())
    assert "category 048 of 20-130" in first.reason
    assert "item 130/SRL: extends past the end of the block" in first.reason
    assert (second.offset, second.reason) == (offset + len(bad), "category 033 is unknown")
    figures: dict[str, Any] = report(out).figures
    octets = figures["bytes"]["recording-0"]
    assert octets["decoded"] + octets["quarantined"] + octets["framing"] == len(whole)
    assert octets["quarantined"] == len(bad) + 5


def test_blocks_of_artas_without_a_table_are_counted_and_skipped(tmp_path: Path) -> None:
    other = block(31, b"\x80\x01\x02")
    whole = other + block(48, plot_048(1.0)) + other
    out = converted(tmp_path, whole)
    assert len(rows(out)) == 1
    assert rejects(out) == []
    figures: dict[str, Any] = report(out).figures
    assert figures["skipped_blocks"] == {"031": 2}
    octets = figures["bytes"]["recording-0"]
    assert octets["skipped"] == 2 * len(other)
    assert octets["decoded"] + octets["skipped"] == len(whole)


def test_datagrams_of_a_replay_file_are_read_with_all_their_blocks(tmp_path: Path) -> None:
    both = block(48, plot_048(1.0)) + block(48, plot_048(2.0))
    whole = rply([(0, both), (250, block(48, plot_048(3.0))), (40, b"\x00junk")]) + b"\x05\x00"
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    assert [row["time_s"] for row in rows(out)] == [1.0, 2.0, 3.0]
    figures: dict[str, Any] = report(out).figures
    octets = figures["bytes"]["recording-0"]
    assert (octets["form"], octets["framing"], octets["quarantined"]) == ("rply", 24, 7)
    assert sum(octets[name] for name in ("decoded", "framing", "quarantined")) == len(whole)


def test_a_replay_file_reports_no_time_of_day(tmp_path: Path) -> None:
    """Its clock begins at 0 whatever the time was: nothing may be restored by it."""
    whole = rply([(0, block(1, plot_001(5.0))), (9, block(1, plot_001(6.0)))])
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    assert rows(out) == []
    assert len(rejects(out)) == 2


def test_truncated_times_are_restored_from_north_marks(tmp_path: Path) -> None:
    start = 512 * 100 - 6.0
    parts = []
    for turn in range(4):
        parts.append(north_mark(start + 4.0 * turn))
        parts.append(block(1, plot_001(start + 4.0 * turn + 1.0)))
    out = converted(tmp_path, b"".join(parts))
    assert [row["time_s"] for row in rows(out)] == [start + 1.0 + 4.0 * k for k in range(4)]
    figures: dict[str, Any] = report(out).figures
    assert figures["time_from"] == {"truncated": 4}
    assert figures["antennas"]["20-130"] == {"north_marks": 4, "sectors": 0, "turn_s": 4.0}
    assert "rotation_period_s = 4.000" in (out / "sensors.toml").read_text()


def test_times_that_are_missing_follow_from_the_antenna(tmp_path: Path) -> None:
    parts = []
    for turn in range(4):
        parts.append(north_mark(100.0 + 4.0 * turn))
        parts.append(block(1, plot_001(None, azimuth_deg=45.0 + 45.0 * turn)))
    out = converted(tmp_path, b"".join(parts))
    assert [row["time_s"] for row in rows(out)] == pytest.approx([100.5, 105.0, 109.5, 114.0])


def test_only_the_first_record_of_a_block_of_category_001_names_its_source(
    tmp_path: Path,
) -> None:
    second = record((2, "20"), (3, "1900 4000"), (7, "3280"))
    out = converted(tmp_path, north_mark(100.0) + block(1, plot_001(100.5), second))
    assert [row["sensor_id"] for row in rows(out)] == ["20-130", "20-130"]


def test_the_recorders_clock_restores_times_of_radars_without_service_messages(
    tmp_path: Path,
) -> None:
    out = converted(tmp_path, gps([(40_000.0, block(1, plot_001(39_999.5)))]))
    assert [row["time_s"] for row in rows(out)] == [39_999.5]


def test_a_plot_without_any_time_is_rejected(tmp_path: Path) -> None:
    (one,) = rejects(out := converted(tmp_path, block(1, plot_001(5.0)), status=EXIT_FAILED))
    assert rows(out) == []
    assert one.code == "MISSING_FIELD"
    assert "known only modulo 512 s" in one.reason


def test_a_plot_without_a_time_needs_the_scan_period(tmp_path: Path) -> None:
    """One north mark gives no scan period; the sensors file may."""
    whole = north_mark(100.0) + block(1, plot_001(None, azimuth_deg=90.0))
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    (one,) = rejects(out)
    assert "the antenna position" in one.reason
    sensors = tmp_path / "sensors.toml"
    sensors.write_text(
        '[[sensor]]\nkind = "radar"\nsac = 20\nsic = 130\nlatitude_deg = 39.0\n'
        "longitude_deg = 0.0\nheight_m = 100.0\nrotation_period_s = 4.0\n"
    )
    (tmp_path / "with").mkdir()
    out = converted(tmp_path / "with", whole, options=("--sensors", str(sensors)))
    assert [row["time_s"] for row in rows(out)] == [101.0]


def test_a_time_of_day_beyond_a_day_is_reported(tmp_path: Path) -> None:
    out = converted(tmp_path, block(48, plot_048(90_000.0)), status=EXIT_FAILED)
    assert [one.reason for one in rejects(out)] == ["a time of day of 24 h or more"]


@pytest.mark.parametrize("date", [None, "2018-08-01"])
def test_times_go_on_past_midnight(tmp_path: Path, date: str | None) -> None:
    blocks = [block(48, plot_048((DAY_S - 2.0 + k) % DAY_S)) for k in range(5)]
    out = converted(tmp_path, b"".join(blocks), options=("--date", date) if date else ())
    start = 1_533_081_600.0 if date else 0.0
    assert [row["time_s"] for row in rows(out)] == [start + DAY_S - 2.0 + k for k in range(5)]


def test_a_sensor_that_begins_after_midnight_is_on_the_second_day(tmp_path: Path) -> None:
    out = converted(
        tmp_path,
        block(48, plot_048(DAY_S - 1.0)) + block(48, plot_048(1.0, source="1401")),
    )
    assert [row["time_s"] for row in rows(out)] == [DAY_S - 1.0, DAY_S + 1.0]


def test_a_packet_of_two_networks_counts_once(tmp_path: Path) -> None:
    first, second = block(48, plot_048(1.0)), block(48, plot_048(1.5))
    packets = [(0.0, first), (0.01, first), (0.5, second), (0.51, second)]
    out = converted(tmp_path, pcap((at, datagram(one)) for at, one in packets))
    assert [row["time_s"] for row in rows(out)] == [1.0, 1.5]
    assert report(out).counts.duplicate == 2


def test_recordings_of_two_networks_count_once(tmp_path: Path) -> None:
    whole = block(48, plot_048(1.0)) + block(48, plot_048(2.0))
    out = converted(tmp_path, whole, whole[: len(whole) // 2])
    assert len(rows(out)) == 2


def test_equal_plots_of_different_turns_are_two(tmp_path: Path) -> None:
    parts = [north_mark(100.0 + 4.0 * k) + block(1, plot_001(None)) for k in range(5)]
    out = converted(tmp_path, b"".join(parts))
    assert len(rows(out)) == 5


@pytest.mark.parametrize(
    ("descriptor", "code", "level", "expected"),
    [
        ("44", "0fff", "0578", ("7777", 10_668.0, "spi")),
        ("40", "4fff", "0578", (None, 10_668.0, "code_garbled")),
        ("40", "8fff", "0578", (None, 10_668.0, "code_not_validated")),
        ("40", "0fff", "4578", ("7777", None, "height_garbled")),
        ("40", "0fff", "8578", ("7777", None, "height_not_validated")),
        ("40", "0fff", "3ffc", ("7777", -30.48, None)),
    ],
)
def test_doubtful_codes_and_heights_are_flags(
    tmp_path: Path, descriptor: str, code: str, level: str, expected: tuple[object, ...]
) -> None:
    plot = plot_048(1.0, descriptor=descriptor, code=code, level=level)
    (row,) = rows(converted(tmp_path, block(48, plot)))
    assert (row["mode_3a"], row["height_m"], row["flags"]) == expected


@pytest.mark.parametrize(
    ("descriptor", "name"),
    [("00", "no_detection"), ("50", "simulated"), ("42", "fixed_transponder"), ("41 80", "test")],
)
def test_reports_other_than_aircraft_are_omitted_by_default(
    tmp_path: Path, descriptor: str, name: str
) -> None:
    whole = block(48, plot_048(1.0, descriptor=descriptor))
    out = converted(tmp_path, whole, status=EXIT_FAILED)
    assert rows(out) == []
    figures: dict[str, Any] = report(out).figures
    assert figures["left_out"][name] == 1
    (tmp_path / "again").mkdir()
    (row,) = rows(converted(tmp_path / "again", whole, options=("--all-targets",)))
    assert row["flags"] == name


def test_multilateration_and_adsb_become_positions(tmp_path: Path) -> None:
    multilateration = record(
        (1, "14c9"), (2, "41 00"), (3, "00 3c 80"), (4, "00200000 fff00000"), (15, "0320")
    )
    report_2_1 = record(
        (1, "0003"), (2, "01 00"), (6, "200000 f00000"), (11, "1a4b65"), (12, "003d00"),
        (21, "0500"), (29, "10c1b1cb3220"),
    )  # fmt: skip
    first, second = rows(converted(tmp_path, block(20, multilateration) + block(21, report_2_1)))
    assert (first["kind"], first["time_s"]) == ("mlat", 121.0)
    assert (first["latitude_deg"], first["longitude_deg"]) == (11.25, -5.625)
    assert (first["height_m"], first["flags"]) == (5000 * 0.3048, "height_geometric")
    assert (second["kind"], second["time_s"]) == ("adsb", 122.0)
    assert (second["latitude_deg"], second["longitude_deg"]) == (45.0, -22.5)
    assert (second["mode_s_address"], second["height_m"]) == ("1a4b65", 32_000 * 0.3048)
    assert second["callsign"] == "DLF123H"


def test_an_edition_is_detected_or_selected(tmp_path: Path) -> None:
    old = record((1, "0005"), (2, "40 54"), (3, "1c293e"), (4, "006e4cc9 ffe606d6"), (5, "496c2e"))
    out = converted(tmp_path, block(21, old))
    (row,) = rows(out)
    assert (row["mode_s_address"], row["time_s"]) == ("496c2e", 0x1C293E / 128)
    figures: dict[str, Any] = report(out).figures
    assert figures["editions"] == {"021": {"0-5": "0.26"}}
    (tmp_path / "reported").mkdir()
    reported = converted(
        tmp_path / "reported", block(21, old), options=("--edition", "0-5/021=0.25")
    )
    assert rows(reported) == [row]


def system_track(
    seconds: float, *, number: str = "13de", status: str = "04", derived: str = "80 663ca6"
) -> bytes:
    return record(
        (1, "0004"),
        (4, time_of_day(seconds)),
        (5, "00800000 ff800000"),
        (7, "0190 0000"),
        (9, "0f91"),
        (10, "00 10c1b1cb3220"),
        (11, derived),
        (12, number),
        (13, status),
        (17, "0578"),
    )


def test_system_tracks_become_a_table_of_their_own(tmp_path: Path) -> None:
    whole = block(62, system_track(DAY_S - 1.0), system_track(1.0, status="03 04"))
    out = converted(tmp_path, whole, whole)
    first, second = pl.read_parquet(out / "system_tracks.parquet").to_dicts()
    assert first == {
        "time_s": DAY_S - 1.0,
        "sensor_id": "0-4",
        "track_number": 0x13DE,
        "mode_s_address": "663ca6",
        "mode_3a": "7621",
        "callsign": "DLF123H",
        "latitude_deg": 45.0,
        "longitude_deg": -45.0,
        "height_m": 35_000 * 0.3048,
        "speed_mps": 100.0,
        "heading_deg": 90.0,
        "state": "confirmed",
    }
    assert (second["time_s"], second["state"]) == (DAY_S + 1.0, "tentative")
    assert rows(out) == []
    assert [one.file for one in report(out).outputs][-1] == "system_tracks.parquet"


def test_the_ground_status_of_system_tracks_is_kept(tmp_path: Path) -> None:
    tracks = [
        system_track(1.0, status="05 01 01 01 01 10"),
        system_track(2.0, status="05 01 01 01 01 00"),
        # Flight status airborne, on the ground, alert; ground bit set, not set.
        system_track(3.0, derived="81 20 663ca6 0000"),
        system_track(4.0, derived="81 20 663ca6 0400"),
        system_track(5.0, derived="81 20 663ca6 1000"),
        system_track(6.0, derived="81 10 663ca6 0200"),
        system_track(7.0, derived="81 10 663ca6 0000"),
    ]
    table = pl.read_parquet(converted(tmp_path, block(62, *tracks)) / "system_tracks.parquet")
    expected = [True, None, False, True, None, True, None]
    assert table["on_ground"].to_list() == expected


def test_a_date_makes_the_times_of_system_tracks_unix_times(tmp_path: Path) -> None:
    out = converted(tmp_path, block(62, system_track(5.0)), options=("--date", "2018-08-01"))
    table = pl.read_parquet(out / "system_tracks.parquet")
    assert table["time_s"].to_list() == [1_533_081_600.0 + 5.0]


@pytest.mark.parametrize(("letters", "edition"), [(7, "1.21"), (8, "1.17-cs8")])
def test_callsigns_of_eight_letters_in_flight_plans_are_read(
    tmp_path: Path, letters: int, edition: str
) -> None:
    callsign = b"HDI181G "[:letters].hex()
    items = [(1, "0004"), (4, time_of_day(5.0)), (12, "0001"), (13, "00"), (21, f"40 {callsign}")]
    whole = block(62, record(*items), record(*items))
    out = converted(tmp_path, whole, options=("--records",))
    first = json.loads((out / "records.ndjson").read_text().splitlines()[0])
    assert (first["edition"], first["items"]["390"]) == (edition, {"CS": "HDI181G"})
    assert rejects(out) == []


def test_system_tracks_without_a_time_are_counted(tmp_path: Path) -> None:
    whole = block(62, system_track(1.0), record((1, "0004"), (12, "0001")))
    out = converted(tmp_path, whole)
    assert pl.read_parquet(out / "system_tracks.parquet").height == 1
    figures: dict[str, Any] = report(out).figures
    assert figures["left_out"]["system_track_without_time"] == 1


def test_the_biases_of_another_sdps_are_reported(tmp_path: Path) -> None:
    def status(azimuth: str) -> bytes:
        return block(
            63, record((1, "0005"), (4, "1482"), (6, "ffcb"), (7, "000b 0080"), (8, azimuth))
        )

    out = converted(tmp_path, status("0001") + status("ffff"))
    figures: dict[str, Any] = report(out).figures
    assert figures["sensor_status"] == {
        "0-5": {
            "20-130": {
                "time_stamping_bias_ms": -53,
                "ssr_range_gain": pytest.approx(11e-5),
                "ssr_range_bias_nm": 1.0,
                "ssr_azimuth_bias_deg": pytest.approx(-360 / 65536),
            }
        }
    }


@pytest.mark.parametrize(
    ("status", "state"),
    [("00", "confirmed"), ("02", "tentative"), ("01 40", "ended"), ("01 80", "simulated"),
     ("01 01 01 80", "coasting")],
)  # fmt: skip
def test_the_state_of_a_system_track_is_reported(tmp_path: Path, status: str, state: str) -> None:
    out = converted(tmp_path, block(62, system_track(5.0, status=status)))
    assert pl.read_parquet(out / "system_tracks.parquet")["state"].to_list() == [state]


def test_records_can_be_read_field_by_field(tmp_path: Path) -> None:
    north = north_mark(1.0)
    out = converted(
        tmp_path, north + block(48, plot_048(1.5), plot_048(2.0)), options=("--records",)
    )
    lines = [json.loads(line) for line in (out / "records.ndjson").read_text().splitlines()]
    assert [line["offset"] for line in lines] == [3, len(north) + 3, len(north) + 3 + 19]
    assert lines[0]["items"] == {"010": {"SAC": 20, "SIC": 130}, "000": 1, "030": 1.0}
    assert (lines[2]["category"], lines[2]["sensor"]) == (48, "20-130")
    assert lines[2]["items"]["040"] == {"RHO": 50.0, "THETA": 90.0}
    assert lines[2]["items"]["220"] == 0x3C660C


def test_sensors_give_their_ids(tmp_path: Path) -> None:
    sensors = tmp_path / "known.toml"
    sensors.write_text(
        '[[sensor]]\nid = "valencia"\nkind = "radar"\nsac = 20\nsic = 130\n'
        "latitude_deg = 39.0\nlongitude_deg = -0.5\nheight_m = 100.0\n"
    )
    whole = block(48, plot_048(1.0)) + block(48, plot_048(1.0, source="1401"))
    out = converted(tmp_path, whole, options=("--sensors", str(sensors)), status=EXIT_FAILED)
    assert [row["sensor_id"] for row in rows(out)] == ["valencia", "20-1"]


def test_the_skeleton_can_be_read_once_the_site_is_filled_in(tmp_path: Path) -> None:
    out = converted(tmp_path, block(48, plot_048(1.0)))
    text = (out / "sensors.toml").read_text()
    for name in ("latitude_deg", "longitude_deg", "height_m"):
        text = text.replace(f"{name} = nan", f"{name} = 1.0")
    (out / "filled.toml").write_text(text)
    (sensor,) = load_sensors(out / "filled.toml").sensor
    assert (sensor.id, sensor.kind, sensor.sac, sensor.sic) == ("20-130", "radar", 20, 130)


def test_a_recording_without_radars_can_be_tracked_with_its_skeleton(tmp_path: Path) -> None:
    parts = [
        record((1, "14c9"), (2, "40"), (3, time_of_day(float(k))), (4, f"008{k:05x} 00100000"))
        for k in range(30)
    ]
    out = converted(tmp_path, block(20, *parts))
    (sensor,) = load_sensors(out / "sensors.toml").sensor
    assert (sensor.kind, sensor.latitude_deg, sensor.longitude_deg) == ("mlat", 45.0, 5.62)
    sensors, tracks = str(out / "sensors.toml"), str(tmp_path / "tracks")
    assert run(["track", str(out), "--sensors", sensors, "--out", tracks]) == EXIT_DONE
    table = pl.read_parquet(tmp_path / "tracks" / "tracks.parquet")
    assert table["track_id"].n_unique() == 1


@pytest.mark.parametrize("choice", ["048", "48-1=1.15", "048=9.9", "077=1.0"])
def test_an_edition_that_cannot_be_read_is_wrong_usage(
    tmp_path: Path, choice: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "recording"
    path.write_bytes(b"")
    command = ["convert", "asterix", str(path), "--out", str(tmp_path / "out"), "--edition", choice]
    assert run(command) == EXIT_USAGE
    assert "expected" in capsys.readouterr().err


def test_a_pipe_is_rejected_instead_of_waited_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, pipe = tmp_path / "out", tmp_path / "pipe"
    os.mkfifo(pipe)
    assert run(["convert", "asterix", str(pipe), "--out", str(out)]) == EXIT_FAILED
    assert "expected a file, was a special file" in capsys.readouterr().err
    assert not out.exists()


def test_figures_can_be_had_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = converted(tmp_path, block(48, plot_048(1.0)), options=("--json",))
    assert json.loads(capsys.readouterr().out) == json.loads((out / "report.json").read_text())
