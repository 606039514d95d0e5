"""`multiradar convert adsb` from small files to tables, rejects and report."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar_schemas.reject import Reject, RejectCode
from multiradar_schemas.report import Report
from multiradar_schemas.sensors.sensor import load_sensors
from support.scenarios.trajectories import (
    BEGIN_S,
    csv_table,
    json_columns,
    json_lines,
    json_list,
    packed,
    report,
    trace,
)

FOOT_M = 0.3048
NAN = math.nan


def command(tmp_path: Path, *contents: bytes, options: tuple[str, ...] = ()) -> tuple[int, Path]:
    paths = []
    for number, content in enumerate(contents):
        paths.append(tmp_path / f"file-{number}")
        paths[-1].write_bytes(content)
    out = tmp_path / "out"
    return run(["convert", "adsb", *map(str, paths), "--out", str(out), *options]), out


def converted(
    tmp_path: Path, *contents: bytes, options: tuple[str, ...] = (), expected: int = EXIT_DONE
) -> Path:
    status, out = command(tmp_path, *contents, options=options)
    assert status == expected
    said = reported(out).counts
    assert said.read == said.accepted + said.rejected + said.duplicate
    assert len(rejects(out)) == said.rejected
    assert len(rows(out)) == said.accepted
    return out


def rows(out: Path) -> list[dict[str, Any]]:
    return pl.read_parquet(out / "measurements.parquet").to_dicts()


def reported(out: Path) -> Report:
    return Report.model_validate_json((out / "report.json").read_bytes())


def rejects(out: Path) -> list[Reject]:
    lines = (out / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
    return [Reject.model_validate_json(line) for line in lines]


def failure(tmp_path: Path, capsys: pytest.CaptureFixture[str], *contents: bytes) -> str:
    """Return the one sentence of a run that fails and leaves nothing."""
    status, out = command(tmp_path, *contents)
    assert status == EXIT_FAILED
    assert not out.exists()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return said


def test_a_report_becomes_a_measurement(tmp_path: Path) -> None:
    out = converted(tmp_path, json_list([report(squawk=21.0, geoaltitude=35_500.0)]))
    assert rows(out) == [
        {
            "time_s": float(BEGIN_S),
            "sensor_id": "adsb",
            "kind": "adsb",
            "range_m": None,
            "azimuth_deg": None,
            "latitude_deg": 47.0,
            "longitude_deg": 8.5,
            "height_m": 35_000 * FOOT_M,
            "mode_3a": "0021",
            "mode_s_address": "3c6444",
            "track_number": None,
            "geometric_height_m": 35_500 * FOOT_M,
            "callsign": "DLH8JW",
            "on_ground": None,
            "ground_speed_m_s": 231.5,
            "flags": None,
        }
    ]
    said = reported(out)
    assert (said.counts.read, said.counts.accepted) == (1, 1)
    figures: dict[str, Any] = said.figures
    assert figures["files"]["file-0"]["form"] == "list"
    assert figures["heights"] == {"barometric": 1, "geometric": 0, "none": 0}
    sensor = load_sensors(out / "sensors.toml").sensor[0]
    assert (sensor.id, sensor.kind, sensor.latitude_deg) == ("adsb", "adsb", 47.0)


FORMS: dict[str, Callable[[list[dict[str, Any]]], bytes]] = {
    "list": json_list,
    "lines": json_lines,
    "columns": json_columns,
    "csv": csv_table,
    "semicolons": lambda rows: csv_table(rows, ";"),
    "packed": lambda rows: packed(json_list(rows)),
    "two packed parts": lambda rows: packed(json_list(rows)[:99]) + packed(json_list(rows)[99:]),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_result(form: str, tmp_path: Path) -> None:
    reports = [report(k, squawk="7000", onground=False) for k in range(20)]
    reports[7] |= {"callsign": None, "altitude": None, "squawk": None}
    out = converted(tmp_path, FORMS[form](reports))
    found = rows(out)
    assert [row["time_s"] for row in found] == [BEGIN_S + k for k in range(20)]
    assert [row["latitude_deg"] for row in found] == [one["latitude"] for one in reports]
    assert {row["mode_3a"] for row in found} == {"7000", None}
    assert found[7]["callsign"] is None
    assert found[7]["height_m"] is None
    assert found[8]["height_m"] == 35_000 * FOOT_M


@pytest.mark.parametrize(
    ("said", "time_s"),
    [
        (BEGIN_S, BEGIN_S),
        (BEGIN_S + 0.25, BEGIN_S + 0.25),
        (BEGIN_S * 1000 + 250, BEGIN_S + 0.25),
        (BEGIN_S * 1_000_000 + 250_000, BEGIN_S + 0.25),
        (BEGIN_S * 1_000_000_000 + 250_000_000, BEGIN_S + 0.25),
        ("2018-08-01T08:00:00.25Z", BEGIN_S + 0.25),
        ("2018-08-01 08:00:00.25+00:00", BEGIN_S + 0.25),
        ("2018-08-01 10:00:00+02:00", BEGIN_S),
        ("2018-08-01 08:00:00", BEGIN_S),
        ("08:00:00.25", 28_800.25),
        (28_800.25, 28_800.25),
    ],
)
def test_the_form_of_times_is_found(said: object, time_s: float, tmp_path: Path) -> None:
    for number, write in enumerate((json_list, csv_table)):
        folder = tmp_path / str(number)
        folder.mkdir()
        out = converted(folder, write([report(timestamp=said)]))
        # Nanoseconds since 1970 have more digits than a float64.
        assert [row["time_s"] for row in rows(out)] == [pytest.approx(time_s, abs=1e-6)]


def test_a_day_without_a_date_goes_on_past_midnight_and_takes_one(tmp_path: Path) -> None:
    reports = [report(k, timestamp=(86_398 + k) % 86_400) for k in range(4)]
    out = converted(tmp_path, csv_table(reports))
    assert [row["time_s"] for row in rows(out)] == [86_398.0, 86_399.0, 86_400.0, 86_401.0]
    dated = tmp_path / "dated"
    dated.mkdir()
    out = converted(dated, csv_table(reports), options=("--date", "2018-08-01"))
    first = rows(out)[0]["time_s"]
    assert first == BEGIN_S - 8 * 3600 + 86_398


def test_a_wrong_date_and_files_of_two_kinds_of_time_are_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _ = command(tmp_path, json_list([report()]), options=("--date", "2018-08-03"))
    assert status == EXIT_FAILED
    assert "2018-08-01, not 2018-08-03; omit --date" in capsys.readouterr().err
    said = failure(tmp_path, capsys, json_list([report()]), json_list([report(timestamp=1.0)]))
    assert "some files have dates and some do not" in said


def test_units_follow_from_the_names_of_the_columns(tmp_path: Path) -> None:
    row = report(altitude=..., groundspeed=..., baroaltitude=10_000.0, geoaltitude=10_100.0)
    metres = converted(tmp_path, json_list([row]))
    assert [(row["height_m"], row["geometric_height_m"]) for row in rows(metres)] == [
        (10_000.0, 10_100.0)
    ]
    other = tmp_path / "readsb"
    other.mkdir()
    feet = converted(other, json_list([report(altitude=..., alt_baro=1000, alt_geom=1100)]))
    assert [(row["height_m"], row["geometric_height_m"]) for row in rows(feet)] == [
        (1000 * FOOT_M, 1100 * FOOT_M)
    ]


def test_a_geometric_height_stands_in_and_is_flagged(tmp_path: Path) -> None:
    row = report(altitude=None, geoaltitude=1000.0)
    out = converted(tmp_path, json_list([report(1), row]))
    assert [(row["height_m"], row["flags"]) for row in rows(out)] == [
        (1000 * FOOT_M, "height_geometric"),
        (35_000 * FOOT_M, None),
    ]


def test_the_position_counts_at_the_time_it_was_heard(tmp_path: Path) -> None:
    heard = (BEGIN_S + 0.4) * 1000
    reports = [report(1, last_position=heard), report(2, latitude=47.002082, last_position=heard)]
    out = converted(tmp_path, json_list(reports))
    assert [row["time_s"] for row in rows(out)] == [BEGIN_S + 0.4]
    (again,) = rejects(out)
    assert again.code == RejectCode.DUPLICATE
    assert "repeats the position" in again.reason


def test_a_time_of_the_position_that_is_odd_costs_its_row_and_one_of_another_kind_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reports = [report(k, last_position=None) for k in range(9)]
    reports[3]["last_position"] = "5"
    out = converted(tmp_path, json_list(reports))
    assert [one.code for one in rejects(out)] == [RejectCode.OUT_OF_RANGE]
    other = tmp_path / "other"
    other.mkdir()
    content = json_list([report(k, last_position=k) for k in range(9)])
    assert "expected dates in both 'timestamp'" in failure(other, capsys, content)


def test_an_old_position_under_a_new_time_is_rejected(tmp_path: Path) -> None:
    reports = [report(0), report(1, latitude=47.0), report(2, latitude=47.0), report(3)]
    # A stationary aircraft, or one without ground speed, may still be at the same position.
    standing = [report(k, icao24="3c0001", groundspeed=2.0, latitude=46.0) for k in range(3)]
    silent = [report(k, icao24="3c0002", groundspeed=None, latitude=46.0) for k in range(3)]
    on_ground = [report(k, icao24="3c0003", onground=True, latitude=46.0) for k in range(3)]
    out = converted(tmp_path, json_list([*reports, *standing, *silent, *on_ground]))
    rejected = rejects(out)
    assert [json.loads(one.raw)["timestamp"] for one in rejected] == [
        (BEGIN_S + 1) * 1000,
        (BEGIN_S + 2) * 1000,
    ]
    assert {one.code for one in rejected} == {RejectCode.DUPLICATE}
    assert reported(out).figures["stale"] == 2
    assert [row["flags"] for row in rows(out) if row["mode_s_address"] == "3c0003"] == [
        "on_ground"
    ] * 3
    assert reported(out).figures["on_ground"] == 3


def test_times_backwards_and_jumps_are_counted_and_the_table_is_in_order(tmp_path: Path) -> None:
    reports = [report(0), report(10), report(5), report(11, latitude=48.0)]
    out = converted(tmp_path, json_list(reports))
    assert [row["time_s"] - BEGIN_S for row in rows(out)] == [0.0, 5.0, 10.0, 11.0]
    figures = reported(out).figures
    assert (figures["backwards"], figures["jumps"]) == (1, 1)


def test_a_file_given_twice_counts_once(tmp_path: Path) -> None:
    content = json_list([report(k) for k in range(30)])
    out = converted(tmp_path, content, packed(content))
    counts = reported(out).counts
    assert (counts.read, counts.accepted, counts.duplicate) == (60, 30, 30)


BROKEN: list[tuple[dict[str, Any], RejectCode, str]] = [
    ({"latitude": None}, RejectCode.MISSING_FIELD, "latitude: expected a value, found none"),
    ({"longitude": NAN}, RejectCode.MISSING_FIELD, "longitude: expected a value, found none"),
    ({"longitude": ...}, RejectCode.MISSING_FIELD, "longitude: expected a value, found none"),
    ({"timestamp": None}, RejectCode.MISSING_FIELD, "timestamp: expected a value, found none"),
    ({"icao24": ""}, RejectCode.MISSING_FIELD, "icao24: expected a value, found none"),
    ({"latitude": 90.01}, RejectCode.OUT_OF_RANGE, "expected -90 to 90 degrees, was 90.01"),
    ({"longitude": 1e300}, RejectCode.OUT_OF_RANGE, "expected -180 to 180 degrees, was 1e+300"),
    ({"latitude": 10**400}, RejectCode.NON_FINITE, "latitude: expected a finite number"),
    ({"latitude": math.inf}, RejectCode.NON_FINITE, "expected a number, was 'Infinity'"),
    ({"latitude": "north"}, RejectCode.NOT_A_NUMBER, "expected a number, was 'north'"),
    ({"latitude": [47.0]}, RejectCode.NOT_A_NUMBER, "was 'a list or an object'"),
    ({"timestamp": 5e15}, RejectCode.OUT_OF_RANGE, "timestamp: expected 631152000 to 4102444800"),
    (
        {"last_position": (BEGIN_S - 4000) * 1000},
        RejectCode.OUT_OF_RANGE,
        "expected at most 3600 s before and 60 s after the time of the record, was 4001.000 s",
    ),
    ({"altitude": 200_000}, RejectCode.OUT_OF_RANGE, "altitude: expected -1000 to 40000 m"),
    ({"icao24": "3c64"}, RejectCode.NOT_A_NUMBER, "expected six hexadecimal digits, was '3c64'"),
    ({"icao24": "~3c6444"}, RejectCode.NOT_A_NUMBER, "expected six hexadecimal digits"),
    ({"icao24": "000000"}, RejectCode.OUT_OF_RANGE, "000000 is not an aircraft address"),
    ({"icao24": "FFFFFF"}, RejectCode.OUT_OF_RANGE, "ffffff is not an aircraft address"),
    ({"onground": "perhaps"}, RejectCode.WRONG_TYPE, "expected true or false, was 'perhaps'"),
]


@pytest.mark.parametrize(("wrong", "code", "reason"), BROKEN)
def test_a_broken_record_is_kept_with_its_place_and_the_next_one_is_read(
    wrong: dict[str, Any], code: RejectCode, reason: str, tmp_path: Path
) -> None:
    good = [report(k, onground=False, last_position=(BEGIN_S + k) * 1000) for k in range(3)]
    bad = report(1, **({"onground": False, "last_position": (BEGIN_S + 1) * 1000} | wrong))
    content = json_list([good[0], bad, good[2]])
    out = converted(tmp_path, content)
    assert [row["time_s"] - BEGIN_S for row in rows(out)] == [0.0, 2.0]
    (rejected,) = rejects(out)
    assert (rejected.code, rejected.file) == (code, "file-0")
    assert reason in rejected.reason
    assert rejected.offset is not None
    assert content[rejected.offset :].startswith(rejected.raw.encode())
    assert json.loads(rejected.raw).keys() == bad.keys()


def test_addresses_in_capitals_are_taken_and_odd_codes_and_callsigns_left_out(
    tmp_path: Path,
) -> None:
    row = report(icao24="3C64AB", squawk="7800", callsign="to/long and odd")
    out = converted(tmp_path, json_list([row, report(1, squawk="1234", callsign=" KLM1  ")]))
    assert [(row["mode_s_address"], row["mode_3a"], row["callsign"]) for row in rows(out)] == [
        ("3c64ab", None, None),
        ("3c6444", "1234", "KLM1"),
    ]
    figures: dict[str, Any] = reported(out).figures
    assert figures["files"]["file-0"]["unreadable"] == {"callsign": 1, "code": 1}


def test_lines_of_csv_are_rejected_by_their_number(tmp_path: Path) -> None:
    lines = csv_table([report(k) for k in range(6)]).splitlines()
    lines[2] = lines[2].removesuffix(b",DLH8JW")
    lines[3] = b'"' + lines[3]
    lines.insert(2, b"")
    out = converted(tmp_path, b"\r\n".join(lines))
    assert [row["time_s"] - BEGIN_S for row in rows(out)] == [0.0, 3.0, 4.0, 5.0]
    assert [(one.line, one.code) for one in rejects(out)] == [
        (4, RejectCode.WRONG_FIELD_COUNT),
        (5, RejectCode.MALFORMED_LINE),
    ]
    assert reported(out).counts.blank == 1


def test_a_packed_file_that_is_cut_short_gives_what_came_before_and_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = packed(json_list([report(k) for k in range(5000)]))
    out = converted(tmp_path, content[: len(content) // 2], expected=EXIT_FAILED)
    assert capsys.readouterr().err == (
        f"multiradar: file-0: truncated; the readable part is in {out}\n"
    )
    last = rejects(out)[-1]
    assert (last.code, last.reason) == (RejectCode.TRUNCATED, "the compressed file is truncated")
    assert 1000 < len(rows(out)) < 4000


@pytest.mark.parametrize("form", ["list", "csv", "lines"])
def test_text_that_ends_within_a_record_is_reported(form: str, tmp_path: Path) -> None:
    content = FORMS[form]([report(k) for k in range(10)])
    # A line of CSV may be short for other reasons.
    out = converted(tmp_path, content[:-40], expected=EXIT_DONE if form == "csv" else EXIT_FAILED)
    assert len(rows(out)) == 9
    (rejected,) = rejects(out)
    expected = RejectCode.WRONG_FIELD_COUNT if form == "csv" else RejectCode.TRUNCATED
    assert rejected.code == expected


def test_a_quote_too_few_does_not_swallow_the_rest_of_the_file(tmp_path: Path) -> None:
    reports = [json.dumps(report(k)) for k in range(2000)]
    reports[10] = reports[10].replace('"DLH8JW"', '"DLH8JW')
    out = converted(tmp_path, f"[{', '.join(reports)}]".encode())
    # 4096 bytes are given up, 27 records of this size, and the one in which they end.
    assert len(rows(out)) >= 2000 - 29
    assert [one.code for one in rejects(out)] == [RejectCode.TOO_LARGE]


def test_a_record_that_is_too_long_may_be_the_last(tmp_path: Path) -> None:
    out = converted(tmp_path, json_list([report(0), report(1, remark="x" * 70_000)]))
    assert [one.code for one in rejects(out)] == [RejectCode.TOO_LARGE]
    assert len(rejects(out)[0].raw) == 4096
    table = csv_table([report(0, remark=""), report(1, remark="x" * 70_000), report(2, remark="")])
    lines = tmp_path / "lines"
    lines.mkdir()
    out = converted(lines, table)
    assert [(one.code, one.line) for one in rejects(out)] == [(RejectCode.TOO_LARGE, 3)]


def test_what_follows_a_list_is_reported(tmp_path: Path) -> None:
    content = json_list([report(0)])
    out = converted(tmp_path, content + b"\n" + content)
    (rejected,) = rejects(out)
    assert (rejected.code, rejected.offset) == (RejectCode.MALFORMED_JSON, len(content) + 1)


def test_text_that_packs_very_well_is_read_to_its_end(tmp_path: Path) -> None:
    content = json_list([report(0), report(1)])
    blank = content.replace(b"}, {", b"}, " + b" " * (5 << 20) + b" {")
    assert len(rows(converted(tmp_path, packed(blank)))) == 2


POINT = [0.5, 47.0, 8.5, 35_000, 450.0, 0.0, 0, 0, None, "adsb_icao", 35_500, None, None, None]


def test_a_trace_becomes_measurements(tmp_path: Path) -> None:
    details = {"flight": "DLH8JW  ", "squawk": "7421", "type": "adsb_icao"}
    points = [
        POINT,
        [2.0, 47.01, 8.5, "ground", 12.0, 0.0, 1, None, details, "adsb_icao", None],
        [3.0, 47.02, 8.5, 1200, None, None, 8, 0, None, "mlat", None],
        [4.0, 47.03, 8.5, None],
        [5.0, 47.04, 8.5, 1200, None, None, 0, 0, None, "tisb_icao", None],
        [6.0, 47.05],
        "point",
        # Only Python reads it as 10.
        ["1_0", 47.06, 8.5, None],
    ]
    out = converted(tmp_path, packed(trace(points)))
    found = pl.read_parquet(out / "measurements.parquet")
    assert found["time_s"].to_list() == [BEGIN_S + s for s in (1.0, 2.5, 3.5, 4.5)]
    assert found["kind"].to_list() == ["adsb", "adsb", "mlat", "adsb"]
    assert found["sensor_id"].to_list() == ["adsb", "adsb", "mlat", "adsb"]
    assert found["height_m"].to_list() == [35_000 * FOOT_M, None, 1200 * FOOT_M, None]
    assert found["geometric_height_m"].to_list() == [35_500 * FOOT_M, None, 1200 * FOOT_M, None]
    assert found["flags"].to_list() == [None, "on_ground", "height_geometric", None]
    assert found["callsign"].to_list() == [None, "DLH8JW", None, None]
    assert found["mode_3a"].to_list() == [None, "7421", None, None]
    assert [one.code for one in rejects(out)] == [
        RejectCode.UNKNOWN_KIND,
        RejectCode.WRONG_FIELD_COUNT,
        RejectCode.WRONG_TYPE,
        RejectCode.NOT_A_NUMBER,
    ]


def test_a_trace_without_aircraft_address_is_rejected_point_by_point(tmp_path: Path) -> None:
    out = converted(tmp_path, trace([POINT]), trace([POINT], icao="~2a1b3c"), trace([]))
    assert len(rows(out)) == 1
    assert [one.code for one in rejects(out)] == [RejectCode.NOT_A_NUMBER]


ALTERED = json_list([report(k, altitude=..., alt=1000) for k in range(3)])
UNKNOWN: list[tuple[bytes, str]] = [
    (b"", "no trajectories: the file is empty"),
    (b" \n ", "no trajectories: the file is empty"),
    (bytes(range(256)) * 9, "neither JSON nor CSV with a header line"),
    (b"\x28\xb5\x2f\xfd" + b"0" * 50, "plain or gzip-compressed, was a Zstandard file"),
    (b"7z\xbc\xaf" + b"0" * 50, "plain or gzip-compressed, was a 7-Zip archive"),
    (b"\x1f\x8b" + b"\0" * 50, "the compressed file is damaged"),
    (packed(json_list([report()]))[:-5] + b"wrong", "the compressed file is damaged: Error -3"),
    (b"a,b\n1,2\n", "expected a column for the time (timestamp, time, time_s, datetime), found a"),
    (b"[]", "contains no JSON objects"),
    (b"[1, 2, 3]", "contains no JSON objects"),
    (b'{"trace":[[0,1,2,3]]}', "missing icao and timestamp before the points of the trace"),
    (ALTERED, "the unit of 'alt' is unknown: expected altitude or alt_baro (ft)"),
    (
        json_list([report(altitude=..., geoaltitude=1000)]),
        "the unit of 'geoaltitude' is unknown: only a column altitude (ft) or baroaltitude (m)",
    ),
    (json_list([report(lat=47.0)]), "expected one column for the latitude, found 'latitude' and"),
    (json_list([report(timestamp="noon")]), "expected times in the column 'timestamp'"),
    (json_list([report(timestamp=5e9)]), "expected times in the column 'timestamp'"),
    (
        json_list([report(latitude=None)]),
        "none of 1 records were accepted; 1 were rejected as MISSING",
    ),
    (json_columns([report()])[:-5], "expected JSON columns, each an object keyed by row"),
]


@pytest.mark.parametrize(("content", "sentence"), UNKNOWN)
def test_what_cannot_be_read_is_reported_in_one_sentence(
    content: bytes, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert sentence in failure(tmp_path, capsys, content)


def test_a_missing_file_and_a_folder_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in (tmp_path / "missing.json", tmp_path):
        assert run(["convert", "adsb", str(path), "--out", str(tmp_path / "out")]) == EXIT_FAILED
        assert str(path) in capsys.readouterr().err
    assert run(["convert", "adsb", "x", "--out", "y", "--date", "noon"]) == EXIT_USAGE


def test_a_decompression_bomb_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bomb = packed(b"[" + json.dumps(report()).encode() + b" " * (96 << 20))
    assert "compression ratio of at most 100" in failure(tmp_path, capsys, bomb)


def test_the_output_is_never_overwritten_and_json_is_the_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = converted(tmp_path, json_list([report(k) for k in range(3)]), options=("--json",))
    assert json.loads(capsys.readouterr().out) == json.loads((out / "report.json").read_bytes())
    before = (out / "measurements.parquet").read_bytes()
    status, _ = command(tmp_path, json_list([report()]))
    assert status == EXIT_FAILED
    assert "exists" in capsys.readouterr().err
    assert (out / "measurements.parquet").read_bytes() == before


def test_the_result_is_tracked_and_is_a_reference(tmp_path: Path) -> None:
    reports = [
        report(4 * k, icao24=f"3c000{a}", longitude=8.0 + a) for k in range(60) for a in (1, 2)
    ]
    out = converted(tmp_path, json_list(reports))
    tracks = tmp_path / "tracks"
    sensors = str(out / "sensors.toml")
    assert run(["track", str(out), "--sensors", sensors, "--out", str(tracks)]) == EXIT_DONE
    assert Report.model_validate_json((tracks / "report.json").read_bytes()).counts.accepted == 120
    assert run(["evaluate", str(tracks), "--adsb", str(out)]) == EXIT_DONE
