"""Rows of the table of mistakes: each ends with its status and names the cause."""

import shutil
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import run
from support.paths import SAMPLE
from validation.mistakes.column_mistakes import COLUMN_MISTAKES
from validation.mistakes.dump_mistakes import DUMP_MISTAKES
from validation.mistakes.file_mistakes import FILE_MISTAKES
from validation.mistakes.mistake import SENSORS, Mistake, Sample
from validation.mistakes.mistakes_catalogue import CATALOGUE
from validation.mistakes.recording_mistakes import RECORDING_MISTAKES
from validation.mistakes.value_mistakes import VALUE_MISTAKES

SENSORS_FILE = SAMPLE.parent / "sensors-vid-sample.toml"
ROWS = (
    *CATALOGUE,
    *COLUMN_MISTAKES,
    *RECORDING_MISTAKES,
    *VALUE_MISTAKES,
    *DUMP_MISTAKES,
    *FILE_MISTAKES,
)
#: Of the sample; check_mistakes.py uses all of it, 20 minutes.
DURATION_S = 480.0
#: Mistakes that only show in all of it.
SLOWLY_SHOWN = (
    "a site off by 5 km",
    "Mode 3/A codes in decimal",
    "ADS-B in GPS time (18 s ahead)",
    "a date that falls back by a day",
    "a clock off by 0.3 s",
    "azimuths of one radar off by 2.5°, without ADS-B",
)
#: One of each kind of cause; check_mistakes.py makes all of them.
CHOSEN = (
    "none: the sample as it is",
    "a site off by 5 km",
    "range 0 in all plots",
    "half the ranges",
    "heights with another pressure, 300 m off",
    "Mode 3/A codes in decimal",
    "ADS-B in GPS time (18 s ahead)",
    "times in whole seconds",
    "a clock off by 0.3 s",
    "azimuths of all radars off by 2.5°",
    "a date that falls back by a day",
    "two sensors with one id",
    "convert: another source in tracks.txt",
    "convert: heights of tracks.txt in feet",
    "convert: ground speeds in m/s in a column of knots",
    "low traffic with heights in feet",
    "azimuths of one radar off by 2.5°, without ADS-B",
    "two feeds of a radar, 0.12 s apart",
    "serve: a converted recording as its state",
    "one in ten rows of the recording",
    "height 5000 m in all plots",
    "ADS-B without heights",
    "ranges of at most 65 535 m",
    "identities of the row before",
    "code 2000 in all plots",
    "a range_max_m of 150 km for a radar of 300 km",
    "azimuths that jump by 3°",
    "azimuths of all radars anticlockwise from east",
    "ranges of all radars in statute miles",
    "one sensor_id for all radars",
    "NaN for heights",
    "convert: azimuth counts modulo 360",
    "convert: latitude and longitude exchanged in plots.txt",
    "Mode 3/A code 7000 for all aircraft of a radar, without track numbers",
    "convert: times in hours",
    "sites of the only two radars exchanged",
    "plots of kind bearing",
)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """Return the sample recording, converted."""
    out = tmp_path_factory.mktemp("sample") / "converted"
    assert run(["convert", "vid", str(SAMPLE), str(out), "--date", "2018-08-01"]) == 0
    frame = pl.read_parquet(out / "measurements.parquet")
    return Sample(SAMPLE, frame, SENSORS_FILE.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "mistake",
    [one for one in ROWS if one.name in CHOSEN],
    ids=lambda one: one.name,
)
def test_a_mistake_ends_as_the_table_says(
    mistake: Mistake,
    sample: Sample,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if mistake.name not in SLOWLY_SHOWN:
        rows = sample.measurements
        first = pl.col("time_s") < rows["time_s"].to_numpy().min() + DURATION_S
        sample = replace(sample, measurements=rows.filter(first))
    mistake.prepare(sample, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(list(mistake.command)) == mistake.status
    said = " ".join(capsys.readouterr().err.split())
    assert [words for words in mistake.message if words not in said] == []
    others = [name for name in SENSORS if name not in mistake.sensors]
    assert [name for name in others if f"multiradar: {name}: " in said] == []
    assert bool(said) == bool(mistake.message)
    shutil.rmtree(tmp_path / "out", ignore_errors=True)


def test_every_chosen_row_exists() -> None:
    assert set(CHOSEN) <= {one.name for one in ROWS}
