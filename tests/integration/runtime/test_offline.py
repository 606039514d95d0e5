"""A recording through the tracker to files: everything accounted for, the same bytes every time."""

import hashlib
import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.errors import AccountingError
from multiradar.estimation.filters.bank import FILTERS
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.offline.offline_job import OfflineJob, OfflineResult
from multiradar.runtime.offline.offline_report import offline_report
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.storage import recording as recording_module
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.bias import BIAS_SCHEMA
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.products.transition import TRANSITION_SCHEMA
from multiradar_schemas.reject import Reject
from support.scenarios import live_scene

ROWS = 3000
#: Rows of the recording that are spoilt, and the code of each.
SPOILT = {10: "OUT_OF_RANGE", 700: "UNKNOWN_SENSOR", 701: "NON_FINITE", 1500: "TIME_LATE"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    row = pl.int_range(pl.len())
    frame = live_scene.recording(ROWS).with_columns(
        azimuth_deg=pl.when(row == 10).then(360.0).otherwise(pl.col("azimuth_deg")),
        kind=pl.when(row == 10).then(pl.lit("radar")).otherwise(pl.col("kind")),
        sensor_id=pl.when(row == 10).then(pl.lit("41-10"))
        .when(row == 700).then(pl.lit("99-9"))
        .otherwise(pl.col("sensor_id")),
        range_m=pl.when(row == 10).then(1e5).otherwise(pl.col("range_m")),
        height_m=pl.when(row == 701).then(float("nan")).otherwise(pl.col("height_m")),
        time_s=pl.when(row == 1500).then(pl.col("time_s") - 50.0).otherwise(pl.col("time_s")),
    ).with_columns(
        # What the kind of row 10 does not have.
        latitude_deg=pl.when(row == 10).then(None).otherwise(pl.col("latitude_deg")),
        longitude_deg=pl.when(row == 10).then(None).otherwise(pl.col("longitude_deg")),
    )  # fmt: skip
    twice = pl.concat([frame[:2000], frame[1990:1995], frame[2000:]])
    path = tmp_path_factory.mktemp("offline") / "measurements.parquet"
    twice.write_parquet(path)
    return path


def _run(path: Path, out: Path, **options: Any) -> OfflineResult:
    out.mkdir()
    settings = options.pop("settings", TrackingSettings())
    job = OfflineJob(Recording(path), live_scene.sensors(), settings, **options)
    return track_recording(job, out)


def _hashes(folder: Path) -> list[str]:
    files = sorted(folder.iterdir())
    names = ["bias_correlations", "biases", "health", "tracks", "transitions"]
    assert [file.name for file in files] == sorted(
        ["rejects.ndjson", *(f"{name}.parquet" for name in names)]
    )
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in files]


def test_everything_read_is_accepted_rejected_or_a_duplicate(
    measured: Path, tmp_path: Path
) -> None:
    result = _run(measured, tmp_path / "out")
    assert result.read == ROWS + 5
    assert result.duplicate == 5
    assert dict(result.rejected) == {code: 1 for code in SPOILT.values()}
    assert result.accepted == ROWS - len(SPOILT)
    assert sum(result.tracker.values()) == result.accepted


def test_each_reject_has_its_row_its_reason_and_its_content(measured: Path, tmp_path: Path) -> None:
    _run(measured, tmp_path / "out")
    lines = (tmp_path / "out" / "rejects.ndjson").read_text().splitlines()
    rejects = [Reject.model_validate_json(line) for line in lines]
    rejected = {reject.offset: str(reject.code) for reject in rejects}
    twice = {row: "DUPLICATE" for row in range(2000, 2005)}
    # The first of equal rows is kept; row 1500 is one of the rejected ones.
    assert rejected == SPOILT | twice
    assert len(rejects) == len(SPOILT) + len(twice)
    written = pl.read_parquet(measured)
    for reject in rejects:
        if reject.code == "DUPLICATE" and reject.offset is not None:
            assert json.loads(reject.raw)["time_s"] == written["time_s"][reject.offset]
    assert {reject.file for reject in rejects} == {"measurements.parquet"}
    first, unknown = rejects[0], rejects[1]
    assert json.loads(first.raw)["azimuth_deg"] == 360.0
    assert json.loads(unknown.raw)["sensor_id"] == "99-9"
    assert "360" in first.reason


@pytest.mark.parametrize(
    ("options", "block_rows"),
    [
        ({"batch_rows": 1, "workers": 1}, 65_536),
        ({"batch_rows": 7, "workers": 2}, 65_536),
        ({"batch_rows": 1000, "workers": 4}, 65_536),
        ({"batch_rows": 8192, "workers": 2}, 700),
    ],
)
def test_neither_batches_nor_workers_nor_blocks_leave_a_trace(
    measured: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: dict[str, int],
    block_rows: int,
) -> None:
    expected = _run(measured, tmp_path / "expected")
    monkeypatch.setattr(recording_module, "BLOCK_ROWS", block_rows)
    result = _run(measured, tmp_path / "out", **options)
    assert result == expected
    assert _hashes(tmp_path / "out") == _hashes(tmp_path / "expected")


def test_the_tables_have_the_promised_columns_and_the_counted_rows(
    measured: Path, tmp_path: Path
) -> None:
    result = _run(measured, tmp_path / "out")
    tracks = pl.read_parquet(tmp_path / "out" / "tracks.parquet")
    biases = pl.read_parquet(tmp_path / "out" / "biases.parquet")
    assert tracks.schema == TRACK_SCHEMA
    assert biases.schema == BIAS_SCHEMA
    steps = pl.read_parquet(tmp_path / "out" / "transitions.parquet")
    assert steps.schema == TRANSITION_SCHEMA
    assert len(steps) == result.steps
    assert len(steps.filter(transition="started")) == result.tracks
    assert steps.filter(transition="started")["last_update_s"].null_count() == result.tracks
    assert tracks["sequence"].to_list() == list(range(1, result.updates + 1))
    assert tracks["track_id"].n_unique() == result.tracks == 12
    assert len(biases) == result.bias_rows
    last = biases.filter(sensor_id="41-10", parameter="range_offset_m").row(-1, named=True)
    assert result.final_biases["41-10"]["range_offset_m"] == {
        "estimate": last["estimate"],
        "sigma": last["sigma"],
        "prior_ratio": last["prior_ratio"],
    }


def test_only_the_kinds_asked_for_are_read(measured: Path, tmp_path: Path) -> None:
    result = _run(measured, tmp_path / "out", kinds={"adsb"})
    kinds = pl.read_parquet(measured)["kind"].value_counts()
    assert result.read == kinds.filter(kind="adsb")["count"].item()
    tracks = pl.read_parquet(tmp_path / "out" / "tracks.parquet")
    assert set(tracks["sensor_id"]) == {"adsb"}


def test_other_settings_make_another_output(measured: Path, tmp_path: Path) -> None:
    shas = {
        _run(measured, tmp_path / name, settings=TrackingSettings(filter_name=name)).output_sha256
        for name in FILTERS
    }
    assert len(shas) == len(FILTERS) == 6


def test_a_recording_without_rows_makes_tables_without_rows(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    live_scene.recording(1).clear().write_parquet(path)
    result = _run(path, tmp_path / "out")
    assert (result.read, result.accepted, result.updates, result.tracks) == (0, 0, 0, 0)
    assert pl.read_parquet(tmp_path / "out" / "tracks.parquet").is_empty()


def test_progress_reaches_the_number_of_measurements(measured: Path, tmp_path: Path) -> None:
    seen: list[int] = []
    (tmp_path / "out").mkdir()
    job = OfflineJob(Recording(measured), live_scene.sensors(), TrackingSettings(), batch_rows=1000)
    track_recording(job, tmp_path / "out", seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == ROWS + 5


def test_the_report_accounts_for_everything_and_names_no_batch_or_worker(
    measured: Path, tmp_path: Path
) -> None:
    settings = TrackingSettings(filter_name="blom")
    texts = set()
    for workers, name in ((1, "one"), (2, "two")):
        job = OfflineJob(
            Recording(measured), live_scene.sensors(), settings, None, workers, 8192 // workers
        )
        (tmp_path / name).mkdir()
        report = offline_report(job, track_recording(job, tmp_path / name))
        texts.add(report.model_dump_json())
    assert len(texts) == 1
    assert report.settings["filter_name"] == "blom"
    assert report.counts.read == ROWS + 5
    assert report.figures["tracks"] == 12


def test_a_measurement_without_an_outcome_stops_the_run(
    measured: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = vars(Engine)["counts"].fget

    def forgetful(engine: Engine) -> dict[str, int]:
        true_counts: dict[str, int] = counts(engine)
        return {**true_counts, "UPDATED": true_counts["UPDATED"] - 1}

    monkeypatch.setattr(Engine, "counts", property(forgetful))
    with pytest.raises(AccountingError, match="one outcome per accepted"):
        _run(measured, tmp_path / "out")
