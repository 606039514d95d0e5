"""A recording is read in bounded blocks, and an unusable one is rejected with a message."""

from pathlib import Path

import polars as pl
import pytest

from multiradar.errors import InputError, MissingColumnError
from multiradar.storage import recording
from multiradar.storage.recording import Recording, measurements_path
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA


def _measurements(rows: int) -> pl.DataFrame:
    kinds = ["radar", "adsb", "radar"]
    return pl.DataFrame(
        {
            "time_s": [float(row) for row in range(rows)],
            "sensor_id": ["1-1"] * rows,
            "kind": [kinds[row % 3] for row in range(rows)],
        },
        schema_overrides={"time_s": pl.Float64},
    ).with_columns(
        pl.lit(None, dtype).alias(name)
        for name, dtype in MEASUREMENT_SCHEMA.items()
        if name not in ("time_s", "sensor_id", "kind")
    )


def test_blocks_are_bounded_and_keep_the_order_and_the_place_of_each_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "BLOCK_ROWS", 4)
    path = tmp_path / "measurements.parquet"
    _measurements(11).write_parquet(path)
    blocks = list(Recording(path).blocks())
    assert [len(block) for block in blocks] == [4, 4, 3]
    whole = pl.concat(blocks)
    assert whole["time_s"].to_list() == [float(row) for row in range(11)]
    assert whole["index"].to_list() == list(range(11))


def test_a_choice_of_kinds_keeps_the_places_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    _measurements(7).write_parquet(path)
    block = pl.concat(Recording(path).blocks({"adsb"}))
    assert block["index"].to_list() == [1, 4]
    assert set(block["kind"]) == {"adsb"}


def test_a_missing_file_is_reported_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nothing\.parquet: no such file$"):
        Recording(tmp_path / "nothing.parquet")


def test_a_file_that_is_not_parquet_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    path.write_bytes(b"time_s,sensor_id\n")
    with pytest.raises(InputError, match="expected measurements in Parquet"):
        Recording(path)


def test_a_missing_column_is_named(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    _measurements(3).drop("azimuth_deg").write_parquet(path)
    with pytest.raises(MissingColumnError, match="azimuth_deg"):
        Recording(path)


@pytest.mark.parametrize("column", ["mode_3a", "mode_s_address"])
def test_a_code_given_as_a_number_is_rejected_because_its_zeros_are_lost(
    tmp_path: Path, column: str
) -> None:
    path = tmp_path / "measurements.parquet"
    _measurements(3).with_columns(pl.lit(123).alias(column)).write_parquet(path)
    with pytest.raises(InputError, match=f"expected String in the column {column}"):
        Recording(path)


def test_numbers_of_other_widths_and_further_columns_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    frame = _measurements(3).with_columns(
        pl.col("time_s").cast(pl.Int32), pl.lit(7, pl.Int32).alias("track_number"), note=pl.lit("x")
    )
    frame.write_parquet(path)
    block = next(Recording(path).blocks())
    assert block.schema == {**MEASUREMENT_SCHEMA, "index": block.schema["index"]}
    assert block["track_number"].to_list() == [7, 7, 7]


def test_a_recording_from_before_there_were_callsigns_is_read_without_them(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    _measurements(3).drop("callsign").write_parquet(path)
    block = next(Recording(path).blocks())
    assert block.schema == {**MEASUREMENT_SCHEMA, "index": block.schema["index"]}
    assert block["callsign"].to_list() == [None] * 3
    _measurements(3).with_columns(callsign=pl.lit(12)).write_parquet(path)
    with pytest.raises(InputError, match="expected String in the column callsign, found Int32"):
        Recording(path)


def test_a_time_of_single_precision_is_rejected_because_its_seconds_are_lost(
    tmp_path: Path,
) -> None:
    path = tmp_path / "measurements.parquet"
    short = [pl.col(name).cast(pl.Float32) for name in ("range_m", "time_s")]
    _measurements(3).with_columns(short).write_parquet(path)
    with pytest.raises(InputError, match=r"expected Float64 .* column time_s, found Float32"):
        Recording(path)
    _measurements(3).with_columns(short[0]).write_parquet(path)
    assert next(Recording(path).blocks())["range_m"].dtype == pl.Float64


def test_a_folder_means_the_measurements_in_it(tmp_path: Path) -> None:
    assert measurements_path(tmp_path) == tmp_path / "measurements.parquet"
    file = tmp_path / "other.parquet"
    file.touch()
    assert measurements_path(file) == file


def test_the_content_hash_follows_the_bytes(tmp_path: Path) -> None:
    first, second = tmp_path / "a.parquet", tmp_path / "b.parquet"
    _measurements(3).write_parquet(first)
    _measurements(4).write_parquet(second)
    assert Recording(first).content_sha256() == Recording(first).content_sha256()
    assert Recording(first).content_sha256() != Recording(second).content_sha256()


def test_the_span_is_that_of_the_kinds_chosen_and_of_times_that_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "measurements.parquet"
    times = pl.Series("time_s", [5.0, None, 3.0, float("nan"), 9.0, 1e11, 4.0])
    _measurements(7).with_columns(times).write_parquet(path)
    assert Recording(path).span_s() == (3.0, 9.0)
    assert Recording(path).span_s({"adsb"}) == (9.0, 9.0)
    assert Recording(path).span_s({"mlat"}) is None
