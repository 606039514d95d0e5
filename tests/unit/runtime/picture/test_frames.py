"""A frame read back by its description, octet by octet."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.runtime.picture.frames import encoded
from support.inputs.picture_frames import decoded


@pytest.mark.parametrize("rows", [0, 1, 3, 8])
def test_columns_come_back_with_their_types(rows: int) -> None:
    columns: dict[str, NDArray[Any]] = {
        "exact": np.arange(rows) * 1e9 + 0.125,
        "short": np.arange(rows, dtype=np.float32) - 0.5,
        "number": np.arange(rows, dtype=np.int32) - 7,
        "small": np.arange(rows, dtype=np.int8) - 1,
    }
    header, tables = decoded(encoded({"next": 5}, {"first": columns, "second": columns}))
    assert header["next"] == 5
    for table in tables.values():
        for name, values in columns.items():
            np.testing.assert_array_equal(table[name], values)
            assert table[name].dtype == values.dtype


@pytest.mark.parametrize("name", ["", "a", "ä", "abcdefg", "<script>"])
def test_columns_begin_at_multiples_of_eight_octets(name: str) -> None:
    frame = encoded({"name": name}, {"t": {"a": np.ones(3, np.int8), "b": np.ones(3)}})
    header, _ = decoded(frame)
    assert header["name"] == name
    assert (8 + int.from_bytes(frame[4:8], "little")) % 8 == 0
    assert all(offset % 8 == 0 for _, offset in header["tables"]["t"]["columns"].values())


def test_a_number_that_is_not_finite_is_an_error_and_not_a_frame_that_no_browser_reads() -> None:
    with pytest.raises(ValueError, match="JSON"):
        encoded({"data_time_s": float("nan")}, {})
