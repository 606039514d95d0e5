"""`multiradar track` on the folder of a dump, which is converted on the fly."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import run
from support.paths import SAMPLE


def _track(*arguments: object) -> int:
    return run(["track", *map(str, arguments)])


def test_a_dump_of_another_layout_without_adsb_is_tracked(tmp_path: Path) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump, profile = tmp_path / "dump", tmp_path / "profile.toml"
    dump.mkdir()
    lines = (SAMPLE / "plots.txt").read_bytes().splitlines(keepends=True)
    (dump / "radar.txt").write_bytes(b"".join(lines[:1500]))
    profile.write_text('[files]\nplots = "radar.txt"\n')
    options = ("--profile", profile, "--allow-missing")
    assert _track(dump, "--sensors", sensors, "--out", tmp_path / "out", *options) == 0
    assert _track(dump, "--sensors", sensors, "--out", tmp_path / "no", *options[:2]) == 1


def test_a_dump_is_tracked_without_being_converted_by_hand(tmp_path: Path) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump = tmp_path / "dump"
    dump.mkdir()
    for name, count in (("tracks.txt", 1500), ("plots.txt", 1500), ("plots_ads.txt", 250)):
        lines = (SAMPLE / name).read_bytes().splitlines(keepends=True)
        (dump / name).write_bytes(b"".join(lines[:count]))
    out, converted = tmp_path / "out", tmp_path / "converted"
    options = ("--date", "2018-08-01")
    assert _track(dump, "--sensors", sensors, "--out", out, *options) == 0
    assert run(["convert", "vid", str(dump), str(converted), *options]) == 0
    again = tmp_path / "again"
    assert _track(converted, "--sensors", sensors, "--out", again) == 0
    shas = {json.loads((one / "report.json").read_text())["output_sha256"] for one in (out, again)}
    assert len(shas) == 1
    assert pl.read_parquet(out / "tracks.parquet")["time_s"].min() >= 1533110400.0  # type: ignore[operator]


def _dump_with_rejects(folder: Path, every: int) -> Path:
    # Text instead of an azimuth in each n-th line of plots.txt.
    dump = folder / "dump"
    dump.mkdir()
    for name, count in (("tracks.txt", 3000), ("plots.txt", 3000), ("plots_ads.txt", 500)):
        lines = (SAMPLE / name).read_text(encoding="utf-8", errors="replace").splitlines()[:count]
        if name == "plots.txt":
            lines[every::every] = [_without_azimuth(line) for line in lines[every::every]]
        (dump / name).write_text("\n".join([*lines, ""]), encoding="utf-8")
    return dump


def _without_azimuth(line: str) -> str:
    fields = line.split("\t")
    return "\t".join([*fields[:5], "n/a", *fields[6:]])


def _counts(folder: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return report


def _rejects(folder: Path) -> list[str]:
    return (folder / "rejects.ndjson").read_text(encoding="utf-8").splitlines()


def test_rejected_lines_of_a_dump_are_in_the_report_and_among_the_rejects(tmp_path: Path) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump = _dump_with_rejects(tmp_path, 40)
    out, converted = tmp_path / "out", tmp_path / "converted"
    assert _track(dump, "--sensors", sensors, "--out", out) == 0
    assert run(["convert", "vid", str(dump), str(converted)]) == 0
    report, lines = _counts(out), _counts(converted)["counts"]["rejected"]
    counts = report["counts"]
    assert counts["rejected"] == lines >= 2999 // 40
    assert counts["read"] == counts["accepted"] + counts["rejected"] + counts["duplicate"]
    assert _rejects(out)[:lines] == _rejects(converted)
    assert len(_rejects(out)) == counts["rejected"] + counts["duplicate"]
    assert report["rejected_by_code"]["NOT_A_NUMBER"] >= 2999 // 40


def test_only_rejected_lines_of_the_selected_kinds_count(tmp_path: Path) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump, out = _dump_with_rejects(tmp_path, 3), tmp_path / "out"
    assert _track(dump, "--sensors", sensors, "--out", out, "--kinds", "adsb") == 0
    assert {json.loads(line)["file"] for line in _rejects(out)} <= {"plots_ads.txt"}
    assert _counts(out)["counts"]["rejected"] < 20


def test_a_dump_of_which_many_lines_are_rejected_is_reported_as_by_its_conversion(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump = _dump_with_rejects(tmp_path, 2)
    assert _track(dump, "--sensors", sensors, "--out", tmp_path / "out") == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "plots.txt: 50% of its" in said
    assert "azimuth: expected a number, was 'n/a'" in said
    assert run(["align", str(dump), "--sensors", str(sensors)]) == 1
    assert "plots.txt: 50% of its" in " ".join(capsys.readouterr().err.split())


def test_a_dump_without_plots_is_recognised_by_its_other_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sensors = SAMPLE.parent / "sensors-vid-sample.toml"
    dump = _dump_with_rejects(tmp_path, 3)
    (dump / "plots.txt").unlink()
    assert _track(dump, "--sensors", sensors, "--out", tmp_path / "out") == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "missing file plots.txt; found plots_ads.txt, tracks.txt" in said
