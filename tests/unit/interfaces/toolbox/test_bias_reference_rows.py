"""The positions of a bias reference are merged with the measurements by time."""

from pathlib import Path

import polars as pl
import pytest

from multiradar.diagnosis.model import Diagnosis
from multiradar.storage import recording
from multiradar.storage.recording import Recording
from multiradar.toolbox.alignment.bias_reference import BiasReference, _merged
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import Sensor


def test_each_position_comes_once_also_where_blocks_go_back_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "BLOCK_ROWS", 2)
    path = tmp_path / "measurements.parquet"
    measured = pl.DataFrame(
        {"time_s": [1.0, 4.0, 2.0, 3.0, 6.0, 8.0], "sensor_id": "1-1", "kind": "radar"}
    )
    missing = [name for name in MEASUREMENT_SCHEMA if name not in measured.columns]
    measured.with_columns(
        pl.lit(None, MEASUREMENT_SCHEMA[name]).alias(name) for name in missing
    ).write_parquet(path)
    made = pl.DataFrame({"time_s": [0.5, 2.5, 3.5, 5.0, 9.0]})
    found = _merged(Recording(path), made, tmp_path / "merged.parquet", ["radar"])
    rows = pl.concat(found.blocks())
    assert rows["time_s"].to_list() == [0.5, 1.0, 2.5, 3.5, 4.0, 2.0, 3.0, 5.0, 6.0, 8.0, 9.0]
    assert rows["index"].to_list() == [6, 0, 7, 8, 1, 2, 3, 9, 4, 5, 10]
    assert (rows["sensor_id"] == "reference").to_list() == (rows["index"] >= 6).to_list()


def test_a_reference_has_no_heights_by_design() -> None:
    sensor = Sensor(id="reference", kind="mlat")
    reference = BiasReference(Path("tracks"), pl.DataFrame(), sensor, added=True)
    found = [
        Diagnosis("reference", "heights_missing", "its heights may be lost", "warning"),
        Diagnosis("reference", "clock", "its clock"),
        Diagnosis("adsb", "heights_missing", "its heights may be lost", "warning"),
    ]
    assert reference.without_heights(found) == found[1:]
