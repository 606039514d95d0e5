"""`multiradar track` on the folder of a dump, which is converted on the fly."""

import json
from pathlib import Path

import polars as pl

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
