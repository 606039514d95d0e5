"""The types between studies, command and report reject invalid contents."""

import json

import numpy as np
import pytest

from multiradar.report.content import Series, Table, Value
from multiradar.research.studies.result import StudyResult

X = np.arange(3.0)


def _result(rows: list[dict[str, Value]]) -> StudyResult:
    return StudyResult("s", "S", 7, rows, [], [], ["note"], options={"filters": ["a"], "runs": 2})


def test_a_series_of_unequal_arrays_is_rejected() -> None:
    with pytest.raises(ValueError, match="expected arrays of equal length"):
        Series("a", X, X[:2])
    with pytest.raises(ValueError, match="expected arrays of equal length"):
        Series("a", np.zeros((3, 2)), np.zeros((3, 2)))


def test_a_band_needs_its_other_edge_and_nothing_else_has_one() -> None:
    with pytest.raises(ValueError, match="expected y2 for a band"):
        Series("a", X, X, "band")
    with pytest.raises(ValueError, match="expected y2 for a band"):
        Series("a", X, X, "line", X)
    assert Series("a", X, X, "band", X + 1).y2 is not None


def test_a_row_of_a_table_is_as_long_as_its_header() -> None:
    with pytest.raises(ValueError, match="expected 2 cells"):
        Table("t", ("a", "b"), ((1.0,),))


def test_the_object_for_programs_holds_plain_finite_values() -> None:
    row: dict[str, Value] = {
        "not a number": float("nan"),
        "infinite": np.float64("inf"),
        "double": np.float64(0.1),
        "truth": bool(np.True_),
        "text": "x",
        "none": None,
    }
    decoded = json.loads(json.dumps(_result([row]).json_object(), allow_nan=False))
    assert decoded == {
        "study": "s",
        "seed": 7,
        "options": {"filters": ["a"], "runs": 2},
        "rows": [
            {
                "not a number": None,
                "infinite": None,
                "double": 0.1,
                "truth": True,
                "text": "x",
                "none": None,
            }
        ],
        "notes": ["note"],
    }
