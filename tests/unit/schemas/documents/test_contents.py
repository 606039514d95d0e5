"""A file or folder of another kind than expected is named by what it is."""

from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest

from multiradar.errors import ConfigurationError, InputError, MissingColumnError
from multiradar.settings.service import load_settings
from multiradar.simulation.scenario.file import load_scenario
from multiradar.storage.recording import Recording, check_columns
from multiradar.toolbox.conversion.convert import convert
from multiradar.toolbox.inputs import read_sensors
from multiradar_converters.errors import ProfileError
from multiradar_converters.vid.profile import load_profile
from multiradar_schemas.documents.contents import content, no_such, other_table

TEXTS = {
    "settings.toml": ("[tracking]\nepoch_s = 4.0\n", "a settings file"),
    "sensors.toml": ('[[sensor]]\nid = "1-2"\n', "a sensors file"),
    "scenario.toml": ("duration_s = 9.0\n[[sensor]]\n", "a scenario"),
    "profile.toml": ('[units]\nrange = "km"\n', "a layout of a dump"),
    "report.json": ('{"command": "track"}\n', "the report of `track`"),
    "list.json": ('[{"time": 1}]\n', "JSON"),
    "packed.gz": ("\x1f\x0b", None),
    "table.csv": ("time,icao24\n1,4b1805\n", None),
    "empty": ("", "an empty file"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_is_known_by_its_keys(tmp_path: Path, name: str) -> None:
    text, expected = TEXTS[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert content(tmp_path / name) == expected


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (["track_id", "position_sigma_m", "state"], "the output of `track`"),
        (["sensor_id", "kind", "range_m"], "the output of `convert`"),
        (["sensor_id", "parameter", "estimate"], "the biases of `track`"),
        (["x"], "Parquet"),
    ],
)
def test_a_table_is_known_by_its_columns(tmp_path: Path, columns: list[str], expected: str) -> None:
    path = tmp_path / "table.parquet"
    pl.DataFrame({name: [0.0] for name in columns}).write_parquet(path)
    assert content(path) == expected


@pytest.mark.parametrize(
    ("read", "given", "wanted"),
    [
        (read_sensors, "settings.toml", "a sensors file"),
        (read_sensors, "scenario.toml", "a sensors file"),
        (read_sensors, "report.json", "TOML"),
        (load_settings, "sensors.toml", "a settings file"),
        (load_settings, "profile.toml", "a settings file"),
        (load_scenario, "sensors.toml", "a scenario"),
        (load_profile, "sensors.toml", "a layout of a dump"),
        (Recording, "report.json", "measurements in Parquet"),
        (lambda path: convert(path, format="asterix"), "report.json", "a recording"),
        (lambda path: convert(path, format="adsb"), "sensors.toml", "a recording"),
        (lambda path: convert(path, format="vid"), "settings.toml",
         "a folder with the text files of a dump, such as plots.txt"),
    ],
)  # fmt: skip
def test_another_file_is_an_error_that_names_it(
    tmp_path: Path, read: Callable[[Path], object], given: str, wanted: str
) -> None:
    text, found = TEXTS[given]
    path = tmp_path / given
    path.write_text(text, encoding="utf-8")
    with pytest.raises((InputError, ConfigurationError, ProfileError)) as caught:
        read(path)
    message = str(caught.value).replace(", found ", ", was ")
    assert message.startswith(f"{path}: expected {wanted}, was {found}")


@pytest.mark.parametrize("read", [read_sensors, lambda path: convert(path, format="vid")])
def test_another_folder_is_an_error_that_names_it(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    (tmp_path / "measurements.parquet").touch()
    with pytest.raises((InputError, ConfigurationError), match="the output of `convert`"):
        read(tmp_path)
    (tmp_path / "measurements.parquet").unlink()
    assert no_such(tmp_path, "it") == f"{tmp_path}: expected it, was an empty folder"


def test_a_device_is_not_said_to_be_missing() -> None:
    assert no_such(Path("/dev/null"), "it") == "/dev/null: expected it, was a special file"


def test_missing_columns_name_the_table_that_was_found() -> None:
    columns = {"track_id": pl.Int64(), "position_sigma_m": pl.Float64()}
    words = "found columns of the output of `track`: track_id"
    with pytest.raises(MissingColumnError, match=words):
        check_columns("a", pl.Schema(columns))
    # One column of several: it is the wanted table.
    assert other_table(["track_id", "position_sigma_m"], ["latitude_deg"]) is None
