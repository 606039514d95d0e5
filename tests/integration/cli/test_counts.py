"""Counts in headlines, JSON, reports and pages are those of the rows of the files."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from support.inputs.dumps import columns, part_of_sample, write_dump
from support.scenarios.recorded_scene import command, serving

#: Aircraft of which one plot exists, at 900 m and without height: it cannot be located, and its
#: track number is not used.
UNLOCATABLE = 7


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Simulate, and track a recording with unlocatable, invalid and repeated plots."""
    folder = tmp_path_factory.mktemp("scene")
    options = ["--duration", "200", "--seed", "4", "--out", str(folder / "made")]
    assert run(["simulate", "one-radar-adsb", *options]) == EXIT_DONE
    path = folder / "made" / "measurements.parquet"
    frame = pl.read_parquet(path)
    plots = frame.filter(kind="radar")
    near = plots[:UNLOCATABLE].with_columns(
        range_m=pl.lit(900.0),
        height_m=pl.lit(None, pl.Float64),
        track_number=pl.int_range(900, 900 + UNLOCATABLE),
        mode_s_address=pl.lit(None, pl.String),
        mode_3a=pl.lit(None, pl.String),
    )
    bad = plots[:3].with_columns(azimuth_deg=pl.lit(float("nan")))
    whole = pl.concat([near, frame, bad, plots[5:7]]).sort("time_s", maintain_order=True)
    whole.write_parquet(path)
    return folder


@pytest.fixture(scope="module")
def tracks(scene: Path) -> Path:
    made = scene / "made"
    shown = ["--sensors", made / "sensors.toml", "--kinds", "radar", "--out", scene / "tracks"]
    done = command("track", made, *shown)
    assert done.returncode == 0, done.stderr
    (scene / "headline.txt").write_text(done.stdout, encoding="utf-8")
    return scene / "tracks"


def rows_of(folder: Path) -> dict[str, int]:
    tables = {path.name: len(pl.read_parquet(path)) for path in folder.glob("*.parquet")}
    lines = (folder / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
    return tables | {"rejects.ndjson": len(lines)}


def track_counts(tracks: Path) -> tuple[int, int]:
    """Return the numbers of tracks in the file: confirmed and initiated."""
    rows = pl.read_parquet(tracks / "tracks.parquet")
    confirmed = rows.filter(pl.col("state") != "tentative")
    return confirmed["track_id"].n_unique(), rows["track_id"].n_unique()


def test_the_counts_of_track_are_those_of_its_files(tracks: Path) -> None:
    report = json.loads((tracks / "report.json").read_text(encoding="utf-8"))
    figures, counts = report["figures"], report["counts"]
    outcomes = figures["measurements_by_outcome"]
    assert outcomes["unlocatable"] >= UNLOCATABLE
    assert (counts["rejected"], counts["duplicate"]) == (3, 2)
    assert {one["file"]: one["rows"] for one in report["outputs"]} == rows_of(tracks)
    assert sum(outcomes.values()) == counts["accepted"]
    assert sum(report["rejected_by_code"].values()) == counts["rejected"]
    confirmed, initiated = track_counts(tracks)
    ids = pl.read_parquet(tracks / "tracks.parquet")["track_id"]
    assert ids.max() == initiated + UNLOCATABLE
    assert (figures["tracks_confirmed"], figures["tracks"]) == (confirmed, initiated)
    steps = pl.read_parquet(tracks / "transitions.parquet")
    ended = steps.filter(transition="ended")
    unconfirmed, merged = (len(ended.filter(reason=one)) for one in ("unconfirmed", "merged"))
    assert figures["track_transitions"] == {
        "started": initiated,
        "confirmed": len(steps.filter(transition="confirmed")),
        "ended_unconfirmed": unconfirmed,
        "ended_silent": len(ended) - unconfirmed - merged,
        "merged": merged,
    }
    headline = (tracks.parent / "headline.txt").read_text(encoding="utf-8")
    assert (
        f"{confirmed} confirmed tracks ({initiated} initiated) from {counts['read']} measurements: "
        f"{counts['accepted']} accepted, 3 rejected, 2 duplicate\n" in headline
    )


def test_the_counts_of_evaluate_are_those_of_the_files(
    scene: Path, tracks: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    line = ["evaluate", str(tracks), "--truth", str(scene / "made")]
    assert run([*line, "--json"]) == EXIT_DONE
    compared = json.loads(capsys.readouterr().out)["compared"]
    confirmed, initiated = track_counts(tracks)
    rows = pl.read_parquet(tracks / "tracks.parquet").filter(pl.col("state") != "tentative")
    truth = pl.read_parquet(scene / "made" / "truth.parquet").drop_nulls("track_number")
    positions = truth.unique(["track_number", "time_s"])
    expected = {
        "tracks": confirmed, "tracks_confirmed": confirmed, "tracks_initiated": initiated,
        "updates": len(rows), "aircraft": positions["track_number"].n_unique(),
        "reference_positions": len(positions),
    }  # fmt: skip
    assert compared | expected == compared
    assert run([*line, "--html", str(tmp_path / "card.html")]) == EXIT_DONE
    headline = (
        f"{confirmed} confirmed tracks ({initiated} initiated) with {len(rows)} updates, compared "
        f"with the truth of a simulation: {expected['aircraft']} aircraft with {len(positions)} "
        "positions "
    )
    assert headline in capsys.readouterr().out.replace("\n", " ")
    assert headline in (tmp_path / "card.html").read_text(encoding="utf-8")


def test_the_counts_of_convert_are_those_of_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = part_of_sample(2000)
    rows["plots.txt"].insert(100, ["broken"])
    # All files are from the first minutes.
    del rows["plots_ads.txt"][300:]
    dump = write_dump(tmp_path / "dump", rows, columns())
    out = tmp_path / "out"
    capsys.readouterr()
    assert run(["convert", "vid", str(dump), str(out)]) == EXIT_DONE
    shown = capsys.readouterr().out
    report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
    counts, written = report["counts"], rows_of(out)
    assert counts["rejected"] == written["rejects.ndjson"] > 0
    assert {
        one["file"]: one["rows"] for one in report["outputs"] if one["file"] in written
    } == written
    for counted in (counts, *(one["counts"] for one in report["inputs"])):
        assert counted["read"] == sum(
            counted[name] for name in ("accepted", "rejected", "duplicate")
        )
    parts = zip(*(one["counts"].values() for one in report["inputs"]), strict=True)
    assert [sum(one) for one in parts] == list(counts.values())
    for name in ("read", "accepted", "rejected"):
        assert f"{counts[name]}" in shown.replace(",", "")


def test_the_counts_of_the_status_are_those_of_an_offline_run(
    scene: Path, tracks: Path, tmp_path: Path
) -> None:
    options = ["--state", tmp_path / "state", "--port", 0, "--no-zenoh", "--log-level", "error"]
    made = scene / "made"
    with serving("--sensors", made / "sensors.toml", *options) as served:
        replayed = command(
            "replay", made, "--kinds", "radar", "--to", served.http, "--speed", "max", "--json"
        )
        assert replayed.returncode == 0, replayed.stderr
        status = served.status()
    counts = json.loads((tracks / "report.json").read_text(encoding="utf-8"))["counts"]
    sent = json.loads(replayed.stdout)
    # Repeated plots are found in the journal, after acceptance.
    repeated = sum(status["duplicates_by_sensor"].values())
    assert repeated == counts["duplicate"]
    for found in (status, sent):
        assert (found["read"], found["rejected"]) == (counts["read"], counts["rejected"])
        assert found["accepted"] == counts["accepted"] + repeated
        assert found["duplicate"] == 0
    assert (status["tracks_confirmed"], status["tracks_initiated"]) == track_counts(tracks)
    ended = pl.read_parquet(tracks / "transitions.parquet").filter(transition="ended")
    assert status["tracks_ended"] == len(ended)
    assert status["tracks"] == status["tracks_initiated"] - len(ended)
