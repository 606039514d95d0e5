"""Days of archives: their biases by day, from day to day, chained and merged."""

import json
import shutil
from pathlib import Path

import polars as pl
import pytest

from multiradar.errors import FindingsError
from multiradar.toolbox.tracking.reprocessing.reprocess import Reprocessed, reprocess
from multiradar.toolbox.tracking.reprocessing.summary import summary_of
from multiradar.toolbox.tracking.track import track
from multiradar_schemas.products.bias_days import (
    BIAS_OF_DAY_SCHEMA,
    BIAS_OF_PERIOD_SCHEMA,
    BIAS_STEP_SCHEMA,
)
from multiradar_schemas.report import Report
from multiradar_schemas.sensors.sensor import load_sensors
from support.fakes.fake_jobs import FakeJobs
from validation.tracker.archive_days import RANGE_OFFSETS_M, date_of, write_days

STEP_M = 60.0
#: Below this by chance in one of 30 000 tests.
P_MIN = 3e-5
DATES = [date_of(day) for day in range(4)]
Archive = tuple[Path, Path]


@pytest.fixture(scope="module")
def independent(archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Reprocessed:
    out = tmp_path_factory.mktemp("independent") / "out"
    return reprocess(*archive, out=out, runner=FakeJobs())


@pytest.fixture(scope="module")
def chained(archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Reprocessed:
    out = tmp_path_factory.mktemp("chained") / "out"
    return reprocess(*archive, out=out, days="chained", runner=FakeJobs())


def table(found: Reprocessed, name: str) -> pl.DataFrame:
    return pl.read_parquet(found.folder / f"{name}.parquet")


def test_each_day_has_the_output_of_track(
    archive: Archive, independent: Reprocessed, tmp_path: Path
) -> None:
    folder, sensors = archive
    run = track(folder / DATES[1], sensors, out=tmp_path / "alone")
    own = independent.folder / DATES[1]
    names = {path.name for path in own.iterdir()} - {"reprocess.json"}
    assert names == {path.name for path in run.folder.iterdir()}
    for name in sorted(names - {"report.json"}):
        assert (own / name).read_bytes() == (run.folder / name).read_bytes()


def test_the_tables_have_their_columns_and_a_row_for_each_bias(independent: Reprocessed) -> None:
    days, steps, merged = (
        table(independent, name) for name in ("biases_by_day", "drift", "biases_merged")
    )
    assert days.schema == BIAS_OF_DAY_SCHEMA
    assert steps.schema == BIAS_STEP_SCHEMA
    assert merged.schema == BIAS_OF_PERIOD_SCHEMA
    assert (len(days), len(steps), len(merged)) == (4 * 6, 3 * 6, 6)
    assert days["day"].unique(maintain_order=True).to_list() == DATES
    last = pl.read_parquet(independent.folder / DATES[0] / "biases.parquet")
    for row in days.filter(day=DATES[0]).iter_rows(named=True):
        own = last.filter(sensor_id=row["sensor_id"], parameter=row["parameter"]).row(
            -1, named=True
        )
        assert row["estimate"] == pytest.approx(own["estimate"], rel=1e-12)
        assert row["sigma"] == pytest.approx(own["sigma"], rel=1e-9)
        # The prior of a day of three radars is weak.
        assert row["own_estimate"] == pytest.approx(row["estimate"], abs=0.2 * row["sigma"])
        assert row["own_sigma"] == pytest.approx(row["sigma"], rel=0.02)
    report = Report.model_validate_json((independent.folder / "report.json").read_text())
    assert [one.file for one in report.inputs] == DATES
    assert report.counts.read == sum(one.counts.read for one in report.inputs)
    assert {one.file: one.rows for one in report.outputs} == {
        "biases_by_day.parquet": 24, "drift.parquet": 18, "biases_merged.parquet": 6,
    }  # fmt: skip


@pytest.mark.parametrize("how", ["independent", "chained"])
def test_a_step_between_days_is_found_where_it_is(how: str, request: pytest.FixtureRequest) -> None:
    """Chained days share information, which the comparison does not use."""
    found: Reprocessed = request.getfixturevalue(how)
    steps = table(found, "drift").with_columns(
        stepped=(pl.col("sensor_id") == "east")
        & (pl.col("parameter") == "range_offset_m")
        & (pl.col("day") == DATES[2])
    )
    one = steps.filter("stepped").row(0, named=True)
    assert one["p_value"] < 1e-9
    assert abs(one["difference"] - STEP_M) < 4.0 * one["sigma"]
    assert one["elapsed_days"] == pytest.approx(1.0, abs=1e-3)
    assert (steps.filter(~pl.col("stepped"))["p_value"] > P_MIN).all()
    merged = table(found, "biases_merged").filter(parameter="range_offset_m")
    constant = {row["sensor_id"]: row["p_value"] for row in merged.iter_rows(named=True)}
    assert constant["east"] < 1e-9
    assert min(constant["west"], constant["north"]) > P_MIN
    tests = {one["sensor_id"]: one for one in found.report["figures"]["tests"]}
    assert tests["east"]["p_value"] < 1e-9
    assert tests["west"]["p_value"] > P_MIN
    assert (tests[""]["degrees_of_freedom"], tests["west"]["degrees_of_freedom"]) == (18, 6)


def test_chained_days_start_from_each_other(independent: Reprocessed, chained: Reprocessed) -> None:
    days = chained.report["figures"]["days"]
    assert [one["start"] for one in days] == ["", *DATES[:3]]
    alone, linked = (
        table(one, "biases_by_day").filter(day=DATES[1]) for one in (independent, chained)
    )
    # Two days instead of one.
    ratio = (linked["sigma"] / alone["sigma"]).to_numpy()
    assert ((ratio > 0.6) & (ratio < 0.8)).all()
    # What a day says by itself is nearly the same.
    difference = (linked["own_estimate"] - alone["own_estimate"]) / alone["own_sigma"]
    assert (difference.abs() < 1.0).all()


def test_merged_days_are_priors_for_the_next_run(archive: Archive, tmp_path: Path) -> None:
    folder, sensors = archive
    steady = tmp_path / "days"
    steady.mkdir()
    for date in DATES[:2]:
        shutil.copytree(folder / date, steady / date)
    found = reprocess(steady, sensors, out=tmp_path / "out", days="merged", runner=FakeJobs())
    merged = table(found, "biases_merged").filter(parameter="range_offset_m")
    single = table(found, "biases_by_day").filter(parameter="range_offset_m", day=DATES[0])
    written = {one.id: one for one in load_sensors(found.folder / "sensors_merged.toml").sensor}
    assert list(written) == [one.id for one in load_sensors(sensors).sensor]
    for row in merged.iter_rows(named=True):
        error = row["estimate"] - RANGE_OFFSETS_M[row["sensor_id"]]
        assert abs(error) < 4.0 * row["sigma"]
        before = single.filter(sensor_id=row["sensor_id"])["sigma"][0]
        assert 0.6 * before < row["sigma"] < 0.8 * before
        prior = written[row["sensor_id"]].bias.range_offset_m
        assert prior.prior == pytest.approx(row["estimate"], abs=0.01 * row["sigma"])
        assert prior.prior_sigma == pytest.approx(row["sigma"], rel=0.01)
    kept = reprocess(steady, sensors, out=tmp_path / "out", runner=FakeJobs())
    assert {one["status"] for one in kept.report["figures"]["days"]} == {"kept"}


def test_a_linear_drift_is_recovered(tmp_path: Path) -> None:
    folder = tmp_path / "days"
    sensors = write_days(folder, [0.0, 15.0, 30.0, 45.0], seed=7)
    found = reprocess(folder, sensors, out=tmp_path / "out", runner=FakeJobs())
    rows = table(found, "biases_merged").filter(parameter="range_offset_m")
    for row in rows.iter_rows(named=True):
        true = 15.0 if row["sensor_id"] == "east" else 0.0
        assert abs(row["drift_per_day"] - true) < 3.5 * row["drift_sigma_per_day"]
        assert (row["drift_p_value"] < 1e-6) == bool(true)
        assert row["line_p_value"] > P_MIN


def test_regions_have_sensors_of_their_own_and_run_beside_each_other(
    archive: Archive, tmp_path: Path
) -> None:
    folder, sensors = archive
    for region in ("north", "south"):
        for date in DATES[:2]:
            shutil.copytree(folder / date, tmp_path / "days" / region / date)
    (tmp_path / "days" / "notes").mkdir()
    own = tmp_path / "days" / "south" / "sensors.toml"
    own.write_text(
        sensors.read_text().replace('id = "west"', 'id = "west"\nclock_tolerance_s = 5.0')
    )
    jobs = FakeJobs()
    with pytest.warns(UserWarning, match="notes: no day folders such as 2026-11-20; skipped"):
        found = reprocess(
            tmp_path / "days", sensors, out=tmp_path / "out", days="chained", jobs=8, runner=jobs
        )
    assert jobs.started == [f"north/{DATES[0]}", f"south/{DATES[0]}",
                            f"north/{DATES[1]}", f"south/{DATES[1]}"]  # fmt: skip
    assert jobs.at_once == 2
    assert jobs.closed
    assert table(found, "drift")["region"].unique().sort().to_list() == ["north", "south"]
    copied = tmp_path / "out" / "south" / DATES[0] / "sensors.toml"
    assert "clock_tolerance_s = 5.0" in copied.read_text()
    assert "north: all biases jointly" in " ".join(summary_of(found.folder).notes).lower()


def test_a_region_without_a_complete_day_has_no_biases(archive: Archive, tmp_path: Path) -> None:
    folder, sensors = archive
    for region in ("north", "south"):
        shutil.copytree(folder / DATES[0], tmp_path / "days" / region / DATES[0])
    jobs = FakeJobs({f"north/{DATES[0]}": "its process was terminated by SIGKILL"})
    with pytest.raises(FindingsError) as raised:
        reprocess(tmp_path / "days", sensors, out=tmp_path / "out", runner=jobs)
    assert raised.value.findings == (f"north/{DATES[0]}: its process was terminated by SIGKILL",)
    merged = pl.read_parquet(tmp_path / "out" / "biases_merged.parquet")
    assert merged["region"].unique().to_list() == ["south"]
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert [one["status"] for one in report["figures"]["days"]] == ["failed", "made"]
