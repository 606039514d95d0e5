"""`multiradar convert adsb` of recorded feeds: JSON of readsb, BaseStation, CSV of mlat-server."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, run
from multiradar_schemas.report import Report
from support.scenarios.feeds import (
    BEGIN_S,
    aircraft,
    base_station,
    latitude,
    multilaterated,
    readsb_line,
    snapshot,
)
from support.scenarios.trajectories import packed

SECONDS = range(20)


def in_one_line(text: bytes) -> bytes:
    return json.dumps(json.loads(text)).encode() + b"\n"


SNAPSHOTS = [snapshot(s, [aircraft(s), {"hex": "4ca8d1", "type": "mode_s"}]) for s in SECONDS]
FORMS = {
    "readsb lines": b"".join(readsb_line(s) for s in SECONDS),
    "snapshots by line": b"".join(map(in_one_line, SNAPSHOTS)),
    "snapshots": b"".join(SNAPSHOTS),
    "BaseStation": b"".join(base_station(s) for s in SECONDS),
    "mlat-server": b"".join(multilaterated(s) for s in SECONDS),
}


def converted(
    folder: Path, *contents: bytes, options: tuple[str, ...] = (), status: int = EXIT_DONE
) -> tuple[pl.DataFrame, Report]:
    paths = []
    for number, content in enumerate(contents):
        paths.append(folder / f"feed-{number}")
        paths[-1].write_bytes(content)
    out = folder / "out"
    assert run(["convert", "adsb", *map(str, paths), "--out", str(out), *options]) == status
    report = Report.model_validate_json((out / "report.json").read_bytes())
    counts, table = report.counts, pl.read_parquet(out / "measurements.parquet")
    assert counts.read == counts.accepted + counts.rejected + counts.duplicate
    assert len(table) == counts.accepted
    assert (out / "rejects.ndjson").read_bytes().count(b"\n") == counts.rejected
    return table, report


def of_file(report: Report, number: int = 0) -> dict[str, Any]:
    files: Any = report.figures["files"]
    account: dict[str, Any] = files[f"feed-{number}"]
    return account


@pytest.mark.parametrize("gzip", [False, True])
@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_positions_of_the_flight(
    tmp_path: Path, form: str, *, gzip: bool
) -> None:
    text = FORMS[form]
    table, report = converted(tmp_path, packed(text) if gzip else text)
    assert of_file(report)["form"] == form
    assert table["time_s"].to_list() == [BEGIN_S + s for s in SECONDS]
    digits = 4 if form == "mlat-server" else 6
    assert table["latitude_deg"].to_list() == [round(latitude(s), digits) for s in SECONDS]
    assert set(table["mode_s_address"]) == {"3c6444"}
    assert set(table["kind"]) == {"mlat" if form == "mlat-server" else "adsb"}
    assert table["height_m"].to_list() == pytest.approx([35_000 * 0.3048] * len(SECONDS))
    accuracy = {"BaseStation": None, "mlat-server": pytest.approx(45.0 / 2.0**0.5)}
    expected_sigma = accuracy.get(form, pytest.approx(34.1, abs=0.05))
    found_sigma = table["position_sigma_m"][0] if "position_sigma_m" in table.columns else None
    assert found_sigma == expected_sigma
    expected = len(SECONDS) if form.startswith("snapshots") else 0
    assert of_file(report)["without_position"] == expected


def test_a_recording_may_begin_and_end_within_a_line(tmp_path: Path) -> None:
    for number, form in enumerate(("readsb lines", "BaseStation", "snapshots by line")):
        folder = tmp_path / str(number)
        folder.mkdir()
        table, report = converted(folder, FORMS[form][7:-9])
        assert of_file(report)["form"] == form
        assert len(table) == len(SECONDS) - 2
        assert report.counts.rejected == 2


def test_positions_repeated_by_snapshots_are_duplicates_and_not_rejects(tmp_path: Path) -> None:
    texts = [snapshot(s, [aircraft(s, s % 4, lat=latitude(s - s % 4))]) for s in SECONDS]
    table, report = converted(tmp_path, b"".join(texts))
    assert report.counts.duplicate == 15
    assert report.counts.rejected == 0
    assert table["time_s"].to_list() == [BEGIN_S + s for s in range(0, 20, 4)]


def test_several_snapshot_files_are_one_recording(tmp_path: Path) -> None:
    """Each file has its own decoder: what two files repeat is found in the table."""
    table, report = converted(tmp_path, SNAPSHOTS[0], SNAPSHOTS[1], SNAPSHOTS[1])
    assert len(table) == 2
    assert report.counts.duplicate == 1


def test_local_times_of_basestation_become_utc(tmp_path: Path) -> None:
    text = b"".join(base_station(s, zone_s=7200.0) for s in SECONDS)
    table, report = converted(tmp_path, text, options=("--utc-offset", "2"))
    assert table["time_s"][0] == BEGIN_S
    assert report.settings["utc_offset_h"] == 2.0


def test_the_output_is_evaluated_and_tracked_like_any_other(tmp_path: Path) -> None:
    converted(tmp_path, FORMS["readsb lines"])
    out = str(tmp_path / "out")
    sensors, tracks = f"{out}/sensors.toml", str(tmp_path / "tracks")
    assert run(["track", out, "--sensors", sensors, "--out", tracks]) == EXIT_DONE
    rows = pl.read_parquet(f"{tracks}/tracks.parquet")
    assert set(rows["mode_s_address"]) == {"3c6444"}


def test_mostly_unreadable_feeds_end_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = FORMS["BaseStation"] + b"MSG,3,garbage\r\n" * 50
    _, report = converted(tmp_path, text, status=EXIT_FAILED)
    assert report.counts.rejected == 50
    assert "rejected" in capsys.readouterr().err


def test_snapshots_over_several_lines_are_bounded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("multiradar_converters.feeds.recorded.SNAPSHOT_BYTES_MAX", 2048)
    (tmp_path / "feed").write_bytes(FORMS["snapshots"])
    status = run(["convert", "adsb", str(tmp_path / "feed"), "--out", str(tmp_path / "out")])
    assert status == EXIT_FAILED
    assert "write one snapshot per line (jq -c .)" in capsys.readouterr().err


def test_an_inspection_knows_feeds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "feed").write_bytes(FORMS["snapshots"])
    assert run(["inspect", str(tmp_path / "feed"), "--json"]) == EXIT_DONE
    found = json.loads(capsys.readouterr().out)
    assert found["counts"]["accepted"] == len(SECONDS)
