"""Tables of other packages become polars frames."""

from pathlib import Path

import numpy as np
import polars as pl
import pyarrow as pa
import pytest

from multiradar.errors import InputError, MissingColumnError
from multiradar.toolbox.frames import as_file, to_polars

EXPECTED = pl.DataFrame({"time_s": [1.0, 2.5], "sensor_id": ["a", "b"]})


class Stream:
    """A table that has the Arrow PyCapsule interface and nothing else, as those of pandas."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return EXPECTED.__arrow_c_stream__(requested_schema)


@pytest.mark.parametrize(
    "given",
    [
        EXPECTED,
        EXPECTED.lazy(),
        EXPECTED.to_arrow(),
        Stream(),
        {"time_s": np.array([1.0, 2.5]), "sensor_id": ["a", "b"]},
        [{"time_s": 1.0, "sensor_id": "a"}, {"time_s": 2.5, "sensor_id": "b"}],
        np.array([(1.0, "a"), (2.5, "b")], [("time_s", "f8"), ("sensor_id", "U1")]),
    ],
    ids=["polars", "lazy", "pyarrow", "capsule", "columns", "rows", "structured"],
)
def test_tables_of_other_packages_become_polars_frames(given: object) -> None:
    found = to_polars(given, "measurements")
    assert found.with_columns(pl.col("sensor_id").cast(pl.String)).equals(EXPECTED)


@pytest.mark.parametrize(
    "given",
    [
        {"time_s": np.array([1.0, np.nan])},
        np.array([(1.0,), (np.nan,)], [("time_s", "f8")]),
    ],
    ids=["columns", "structured"],
)
def test_nan_of_numpy_is_a_missing_value(given: object) -> None:
    assert to_polars(given, "measurements")["time_s"].to_list() == [1.0, None]


@pytest.mark.parametrize("given", [7, None, np.zeros(3), ["a", "b"], pa])
def test_what_is_no_table_is_named_by_its_type(given: object) -> None:
    with pytest.raises(InputError, match=f"measurements: expected .*{type(given).__name__}"):
        to_polars(given, "measurements")


def test_an_error_about_a_table_names_the_table_and_not_its_file() -> None:
    def check() -> None:
        with as_file(EXPECTED, "tracks") as (path, name):
            assert (pl.read_parquet(path).equals(EXPECTED), name) == (True, "tracks")
            raise MissingColumnError(str(path), ["time_s"], [])

    with pytest.raises(MissingColumnError) as caught:
        check()
    assert str(caught.value) == "tracks: missing column time_s; found: none"


def test_a_path_stays_a_path(tmp_path: Path) -> None:
    with as_file(str(tmp_path), "tracks") as (path, name):
        assert (path, name) == (tmp_path, str(tmp_path))
